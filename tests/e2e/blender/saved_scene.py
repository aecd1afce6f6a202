"""In Blender: imports a .glb and says what it has, in glTF's axes: meshes with their bounds, lights, cameras."""

import json
import sys

import bpy
import numpy
from mathutils import Vector

# Blender 3.4's importer asks numpy for a name that 1.24 has no more.
if "bool" not in numpy.__dict__:
    numpy.bool = bool


def to_gltf(v):
    return [v.x, v.z, -v.y]


glb = sys.argv[sys.argv.index("--") + 1]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=glb)
bpy.context.view_layer.update()
meshes, lights = [], []
for thing in bpy.data.objects:
    if thing.type == "MESH":
        corners = [to_gltf(thing.matrix_world @ vertex.co) for vertex in thing.data.vertices]
        meshes.append({"name": thing.name, "triangles": sum(len(face.vertices) - 2 for face in thing.data.polygons),
                       "low": [min(corner[k] for corner in corners) for k in range(3)],
                       "high": [max(corner[k] for corner in corners) for k in range(3)]})
    if thing.type == "LIGHT":
        aim = thing.matrix_world.to_3x3() @ Vector((0.0, 0.0, -1.0))
        lights.append({"name": thing.name, "type": thing.data.type, "watts": thing.data.energy, "color": list(thing.data.color),
                       "position": to_gltf(thing.matrix_world.translation), "aim": to_gltf(aim.normalized()),
                       "cone_rad": thing.data.spot_size if thing.data.type == "SPOT" else 0.0})
print("SAVED " + json.dumps({"meshes": meshes, "lights": lights, "cameras": sum(thing.type == "CAMERA" for thing in bpy.data.objects)}))
