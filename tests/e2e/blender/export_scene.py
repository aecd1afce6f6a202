"""Builds a small scene in Blender, exports it with Blender's own glTF exporter, and states what Cycles measures in it.

    blender -b --factory-startup --python-exit-code 1 --python export_scene.py -- OUTDIR

writes OUTDIR/scene.glb, OUTDIR/scene.gltf (separate files) and OUTDIR/expected.json:
    {"points": [{"name", "point_m": [x,y,z], "normal": [x,y,z], "direct_lx": E}], "light_cd": I}
in glTF's coordinates (+Y up, metres).

Units. A Blender point lamp of P watts has the radiant intensity P / (4 pi) W/sr in Cycles. The exporter's lighting mode
'SPEC' turns watts into lumens by 683 lm/W, so that the file says I = 683 P / (4 pi) cd. A diffuse receiver of
reflectance 1 under the irradiance E has the radiance E / pi, hence
    E_lux = 683 pi L
for the radiance L that Cycles renders with the receiver's material replaced by white and no bounces. (The exporter's
other modes, 'COMPAT' and 'RAW', leave out the 683 or the 4 pi: their numbers are not candela.)
The lamp has no extent, so the samples do not differ and the figures carry no noise.
"""

import json
import math
import os
import sys

import bpy
from mathutils import Matrix, Vector

LUMENS_PER_WATT = 683.0
POWER_W = 12.0
LAMP = Vector((0.4, -0.3, 2.6))


def to_gltf(v):
    """Blender is +Z up, glTF +Y up."""
    return [v[0], v[2], -v[1]]


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


def face_point(name, axis, sign, offset=(0.0, 0.0)):
    """A point on a face of a block (unit cube in its own space) and the face's world normal."""
    matrix = bpy.data.objects[name].matrix_world
    local = [offset[0], offset[1], offset[1]]
    others = [k for k in range(3) if k != axis]
    local[axis], local[others[0]], local[others[1]] = 0.5 * sign, offset[0], offset[1]
    direction = [0.0, 0.0, 0.0]
    direction[axis] = sign
    normal = (matrix.to_3x3().inverted().transposed() @ Vector(direction)).normalized()
    return matrix @ Vector(local), normal


def prepare_probe(scene):
    white = bpy.data.materials.new("white receiver")
    white.use_nodes = True
    nodes = white.node_tree.nodes
    nodes.clear()
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    output = nodes.new("ShaderNodeOutputMaterial")
    white.node_tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
    bpy.context.view_layer.material_override = white
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 16
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    for bounces in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "volume_bounces"):
        setattr(scene.cycles, bounces, 0)
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.resolution_percentage = 100
    scene.render.threads_mode = "FIXED"
    scene.render.threads = 1
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    probe = bpy.data.cameras.new("probe")
    probe.type = "ORTHO"
    probe.ortho_scale = 0.002
    probe.clip_start = 0.001
    probe_object = bpy.data.objects.new("probe", probe)
    scene.collection.objects.link(probe_object)
    scene.camera = probe_object
    return probe_object


def illuminance_lx(scene, probe, point, normal, directory):
    """Renders 2 mm x 2 mm of the surface from 2 cm above it. A camera casts no shadow."""
    # A camera looks along its -Z: its +Z is the normal.
    turn = normal.to_track_quat("Z", "Y").to_matrix().to_4x4()
    probe.matrix_world = Matrix.Translation(point + 0.02 * normal) @ turn
    path = os.path.join(directory, "probe.exr")
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(path, check_existing=False)
    pixels = list(image.pixels)
    bpy.data.images.remove(image)
    os.remove(path)
    red = pixels[0::4]
    return LUMENS_PER_WATT * math.pi * sum(red) / len(red)


def main():
    directory = os.path.abspath(sys.argv[sys.argv.index("--") + 1])
    os.makedirs(directory, exist_ok=True)
    scene = build()
    options = dict(export_cameras=True, export_lights=True)
    known = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
    # The option's name has changed since Blender 3.4.
    options[next(name for name in known if name.endswith("convert_lighting_mode"))] = "SPEC"
    bpy.ops.export_scene.gltf(filepath=os.path.join(directory, "scene.glb"), export_format="GLB", **options)
    bpy.ops.export_scene.gltf(filepath=os.path.join(directory, "scene.gltf"), export_format="GLTF_SEPARATE", **options)

    up = Vector((0.0, 0.0, 1.0))
    places = [
        ("floor below the lamp", LAMP * Vector((1.0, 1.0, 0.0)), up),
        ("floor aside", Vector((-0.35, -0.5, 0.0)), up),
        ("top of the block", *face_point("block", 2, 1, (0.1, -0.2))),
        ("front of the block", *face_point("block", 1, -1, (-0.2, 0.2))),
        ("turned instance", *face_point("instance 2", 1, 1, (-0.1, 0.2))),
        ("instance below a parent", *face_point("instance 3", 0, 1, (0.15, 0.2))),
        ("floor in shadow", Vector((2.75, 1.7, 0.0)), up),
    ]
    probe = prepare_probe(scene)
    points = []
    for name, point, normal in places:
        points.append({
            "name": name,
            "point_m": to_gltf(point),
            "normal": to_gltf(normal),
            "direct_lx": illuminance_lx(scene, probe, point, normal, directory),
        })
    light_cd = LUMENS_PER_WATT * POWER_W / (4.0 * math.pi)
    with open(os.path.join(directory, "expected.json"), "w", encoding="utf-8") as file:
        json.dump({"points": points, "light_cd": light_cd, "light_m": to_gltf(LAMP)}, file, indent=1)


main()
