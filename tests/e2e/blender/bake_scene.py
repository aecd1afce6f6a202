"""In Blender: imports the .glb of a bake and says of each mesh what it has: its texture coordinates, its emission."""

import json
import sys

import bpy
import numpy

# Blender 3.4's importer asks numpy for a name that 1.24 has no more.
if "bool" not in numpy.__dict__:
    numpy.bool = bool
glb = sys.argv[sys.argv.index("--") + 1]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=glb)
meshes = []
for thing in bpy.data.objects:
    if thing.type != "MESH":
        continue
    low, high = 1e9, -1e9
    layers = [layer.name for layer in thing.data.uv_layers]
    if len(layers) > 1:
        for corner in thing.data.uv_layers[1].data:
            low, high = min(low, *corner.uv), max(high, *corner.uv)
    emits = []
    for slot in thing.material_slots:
        for node in slot.material.node_tree.nodes:
            if node.type == "TEX_IMAGE" and any(
                    "mission" in link.to_socket.name for link in slot.material.node_tree.links
                    if link.from_node == node):
                uses = [link.from_node.uv_map for link in slot.material.node_tree.links
                        if link.to_node == node and link.from_node.type == "UVMAP"]
                emits.append({"size": list(node.image.size), "uv": uses,
                              "greatest": max(node.image.pixels[:])})
    meshes.append({"name": thing.name, "layers": layers, "low": low, "high": high, "emits": emits})
print("BAKE " + json.dumps(meshes))
