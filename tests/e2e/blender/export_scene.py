"""Builds a small scene in Blender, exports it with Blender's own glTF exporter, and states what Cycles measures in it.

    blender -b --factory-startup --python-exit-code 1 --python export_scene.py -- OUTDIR

writes OUTDIR/scene.glb, OUTDIR/scene.gltf (separate files) and OUTDIR/expected.json:
    {"points": [{"name", "point_m": [x,y,z], "normal": [x,y,z], "direct_lx": E}], "light_cd": I}
in glTF's coordinates (+Y up, metres).

Units. A Blender point lamp of P watts has the radiant intensity P / (4 pi) W/sr in Cycles, so that the file says
I = 683 P / (4 pi) cd (probe.py). All surfaces are white for Cycles.
The lamp has no extent, so the samples do not differ and the figures carry no noise.
"""

import json
import math
import os
import sys

import bpy
from mathutils import Matrix, Vector

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from probe import LUMENS_PER_WATT, Probe, export_options, face_point, make_diffuse, to_gltf  # noqa: E402

POWER_W = 12.0
LAMP = Vector((0.4, -0.3, 2.6))


def chequered_image():
    size = 64
    image = bpy.data.images.new("chequers", size, size)
    pixels = []
    for y in range(size):
        for x in range(size):
            light = (x // 8 + y // 8) % 2 == 0
            pixels += [0.8, 0.7, 0.5, 1.0] if light else [0.2, 0.3, 0.45, 1.0]
    image.pixels = pixels
    image.pack()
    return image


def material(name, color, image=None):
    result = bpy.data.materials.new(name)
    result.use_nodes = True
    shader = result.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1.0)
    if image:
        texture = result.node_tree.nodes.new("ShaderNodeTexImage")
        texture.image = image
        result.node_tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    return result


def build():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("dark")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0

    bpy.ops.mesh.primitive_plane_add(size=6.0)
    floor = bpy.context.object
    floor.name = "floor"
    floor.data.materials.append(material("chequered", (1, 1, 1), chequered_image()))

    bpy.ops.mesh.primitive_cube_add(size=1.0)
    block = bpy.context.object
    block.name = "block"
    block.data.materials.append(material("clay", (0.6, 0.3, 0.2)))
    block.matrix_world = Matrix.Translation((1.6, 0.9, 0.5))
    # Instances: objects that share one mesh, each with its own turn and scale, one of them below a parent.
    parent = bpy.data.objects.new("stand", None)
    scene.collection.objects.link(parent)
    parent.location = (-1.5, 0.6, 0.0)
    parent.rotation_euler = (0.0, 0.0, math.radians(30.0))
    places = [
        (None, Matrix.Translation((-0.9, -1.6, 0.75)) @ Matrix.Diagonal((0.6, 0.6, 1.5, 1.0))),
        (None, Matrix.Translation((1.2, -1.5, 0.4)) @ Matrix.Rotation(math.radians(25.0), 4, "Z")
         @ Matrix.Diagonal((0.8, 0.8, 0.8, 1.0))),
        (parent, Matrix.Translation((0.0, 0.0, 0.9)) @ Matrix.Diagonal((0.7, 0.9, 1.8, 1.0))),
    ]
    for number, (owner, place) in enumerate(places):
        instance = bpy.data.objects.new(f"instance {number + 1}", block.data)
        scene.collection.objects.link(instance)
        if owner:
            instance.parent = owner
        instance.matrix_basis = place

    lamp = bpy.data.lights.new("lamp", "POINT")
    lamp.energy = POWER_W
    lamp.shadow_soft_size = 0.0
    lamp_object = bpy.data.objects.new("lamp", lamp)
    lamp_object.location = LAMP
    scene.collection.objects.link(lamp_object)

    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.matrix_world = Matrix.Translation((0.0, -6.5, 2.4)) @ Matrix.Rotation(math.radians(78.0), 4, "X")
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.context.view_layer.update()
    return scene


def all_white():
    white = bpy.data.materials.new("white receiver")
    white.use_nodes = True
    white.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    make_diffuse(white)
    bpy.context.view_layer.material_override = white


def main():
    directory = os.path.abspath(sys.argv[sys.argv.index("--") + 1])
    os.makedirs(directory, exist_ok=True)
    scene = build()
    options = export_options(bpy.ops.export_scene.gltf)
    bpy.ops.export_scene.gltf(filepath=os.path.join(directory, "scene.glb"), export_format="GLB", **options)
    bpy.ops.export_scene.gltf(filepath=os.path.join(directory, "scene.gltf"), export_format="GLTF_SEPARATE", **options)

    up = Vector((0.0, 0.0, 1.0))
    stands = {name: bpy.data.objects[name].matrix_world for name in ("block", "instance 2", "instance 3")}
    places = [
        ("floor below the lamp", LAMP * Vector((1.0, 1.0, 0.0)), up),
        ("floor aside", Vector((-0.35, -0.5, 0.0)), up),
        ("top of the block", *face_point(stands["block"], 2, 1, (0.1, -0.2))),
        ("front of the block", *face_point(stands["block"], 1, -1, (-0.2, 0.2))),
        ("turned instance", *face_point(stands["instance 2"], 1, 1, (-0.1, 0.2))),
        ("instance below a parent", *face_point(stands["instance 3"], 0, 1, (0.15, 0.2))),
        ("floor in shadow", Vector((2.75, 1.7, 0.0)), up),
    ]
    all_white()
    probe = Probe(scene, directory)
    points = []
    for name, point, normal in places:
        points.append({
            "name": name,
            "point_m": to_gltf(point),
            "normal": to_gltf(normal),
            "direct_lx": probe.measure(point, normal)[0],
        })
    light_cd = LUMENS_PER_WATT * POWER_W / (4.0 * math.pi)
    with open(os.path.join(directory, "expected.json"), "w", encoding="utf-8") as file:
        json.dump({"points": points, "light_cd": light_cd, "light_m": to_gltf(LAMP)}, file, indent=1)


main()
