"""Renders a .glb that carries its luminaire as EXT_lights_ies with Blender's Cycles.

    blender -b --factory-startup --python-exit-code 1 --python cycles_scene.py -- DIRECTORY SIZE SAMPLES NAME...

reads DIRECTORY/NAME.glb and writes DIRECTORY/NAME-direct.exr and NAME-indirect.exr: irradiance in lux, rgb, SIZE pixels
square, direct and after one diffuse bounce.

Units. The fac of an IES texture, as emission strength of a point lamp of 1 W, gives a white diffuse surface the radiance
L with E_lux = 177.83 pi L: Blender takes 177.83 cd for a lamp's watt. calibrate() measures that with a lamp of
1000 cd in all directions 2 m above a plane, which must read 250 lx, before anything else is rendered.

Frames. glTF is +Y up, Blender +Z up: p_blender = C p_gltf with C (x, y, z) = (x, -z, y). A lamp of Blender and a node of
EXT_lights_ies both send photometric zero along their own -Z, so the lamp's matrix is C times the node's. Cycles looks the
azimuth up at atan2(x, y) + pi of the direction it is given; C0 on +X and C90 on +Y need (-y, -x, z).
"""

import json
import math
import os
import struct
import sys

import bpy
import numpy
from mathutils import Matrix, Quaternion, Vector

# Debian's glTF importer is older than its numpy, which has dropped this alias.
if "bool" not in vars(numpy):
    numpy.bool = bool

LUX_PER_RADIANCE = 177.83 * math.pi  # of a white surface
CALIBRATION_TOLERANCE = 0.002
BLENDER_FROM_GLTF = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))


def read_glb(path):
    """Result: the JSON and the binary chunk."""
    with open(path, "rb") as file:
        data = file.read()
    json_size = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20:20 + json_size])
    return document, data[28 + json_size:]


def node_matrix(node):
    x, y, z, w = node["rotation"]
    return Matrix.Translation(Vector(node["translation"])) @ Quaternion((w, x, y, z)).to_matrix().to_4x4()


def luminaire(document, binary, ies_path):
    """Writes the luminaire's photometric file. Result: its node's matrix in Blender's world."""
    node = next(n for n in document["nodes"] if "EXT_lights_ies" in n.get("extensions", {}))
    use = node["extensions"]["EXT_lights_ies"]
    light = document["extensions"]["EXT_lights_ies"]["lights"][use["light"]]
    view = document["bufferViews"][light["bufferView"]]
    start = view.get("byteOffset", 0)
    with open(ies_path, "wb") as file:
        file.write(binary[start:start + view["byteLength"]])
    return BLENDER_FROM_GLTF @ node_matrix(node)


def add_lamp(scene, ies_path, matrix):
    lamp = bpy.data.lights.new("lamp", "POINT")
    lamp.energy = 1.0
    lamp.shadow_soft_size = 0.0
    lamp.use_nodes = True
    nodes, links = lamp.node_tree.nodes, lamp.node_tree.links
    nodes.clear()
    direction = nodes.new("ShaderNodeTexCoord").outputs["Normal"]
    split, join = nodes.new("ShaderNodeSeparateXYZ"), nodes.new("ShaderNodeCombineXYZ")
    links.new(direction, split.inputs["Vector"])
    for source, target in (("Y", "X"), ("X", "Y")):
        negate = nodes.new("ShaderNodeMath")
        negate.operation = "MULTIPLY"
        negate.inputs[1].default_value = -1.0
        links.new(split.outputs[source], negate.inputs[0])
        links.new(negate.outputs[0], join.inputs[target])
    links.new(split.outputs["Z"], join.inputs["Z"])
    ies = nodes.new("ShaderNodeTexIES")
    ies.mode = "EXTERNAL"
    ies.filepath = ies_path
    links.new(join.outputs["Vector"], ies.inputs["Vector"])
    emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputLight")
    links.new(ies.outputs["Fac"], emission.inputs["Strength"])
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    lamp_object = bpy.data.objects.new("lamp", lamp)
    lamp_object.matrix_world = matrix
    scene.collection.objects.link(lamp_object)


def make_diffuse(material):
    """Replaces the importer's shader: the renderer under test knows diffuse reflection only."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    color = tuple(nodes["Principled BSDF"].inputs["Base Color"].default_value)
    nodes.clear()
    diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = color
    diffuse.inputs["Roughness"].default_value = 0.0
    links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])


def prepare(scene, size, samples, bounces):
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = samples
    cycles.seed = 0
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.max_bounces = cycles.diffuse_bounces = bounces
    cycles.glossy_bounces = cycles.transmission_bounces = cycles.volume_bounces = 0
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 1.0
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.world = None
    layer = scene.view_layers[0]
    layer.use_pass_diffuse_direct = layer.use_pass_diffuse_indirect = True


def render(scene, directory, name):
    """Writes the light that falls on the surfaces: Cycles' diffuse passes without the colour, E / pi in its own unit."""
    scene.use_nodes = True
    nodes, links = scene.node_tree.nodes, scene.node_tree.links
    nodes.clear()
    layers, files = nodes.new("CompositorNodeRLayers"), nodes.new("CompositorNodeOutputFile")
    files.base_path = directory
    files.format.file_format = "OPEN_EXR"
    files.format.color_depth = "32"
    files.format.color_mode = "RGB"
    files.file_slots.clear()
    for part, output in (("direct", "DiffDir"), ("indirect", "DiffInd")):
        scale = nodes.new("CompositorNodeMixRGB")
        scale.blend_type = "MULTIPLY"
        scale.inputs[0].default_value = 1.0
        scale.inputs[2].default_value = (LUX_PER_RADIANCE, LUX_PER_RADIANCE, LUX_PER_RADIANCE, 1.0)
        links.new(layers.outputs[output], scale.inputs[1])
        files.file_slots.new(f"{name}-{part}")
        links.new(scale.outputs[0], files.inputs[f"{name}-{part}"])
    scene.frame_set(1)
    bpy.ops.render.render()
    for part in ("direct", "indirect"):
        path = os.path.join(directory, f"{name}-{part}")
        os.replace(f"{path}0001.exr", f"{path}.exr")  # Blender appends the frame's number


def empty_scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def calibrate(directory):
    scene = empty_scene()
    path = os.path.join(directory, "isotropic.ies")
    with open(path, "w", encoding="ascii") as file:
        file.write("IESNA:LM-63-2002\r\n[TEST] calibration\r\nTILT=NONE\r\n1 -1 1 3 1 1 2 0 0 0\r\n1 1 0\r\n"
                   "0 90 180\r\n0\r\n1000 1000 1000\r\n")
    add_lamp(scene, path, Matrix.Translation((0.0, 0.0, 2.0)))
    bpy.ops.mesh.primitive_plane_add(size=4.0)
    material = bpy.data.materials.new("white")
    material.use_nodes = True
    make_diffuse(material)
    bpy.context.object.data.materials.append(material)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = 0.002
    camera.matrix_world = Matrix.Translation((0.0, 0.0, 1.0))
    scene.collection.objects.link(camera)
    scene.camera = camera
    prepare(scene, 8, 16, 0)
    render(scene, directory, "calibration")
    image = bpy.data.images.load(os.path.join(directory, "calibration-direct.exr"))
    red = list(image.pixels)[0::4]
    lux = sum(red) / len(red)
    print(f"calibration: 1000 cd at 2 m reads {lux:.3f} lx")
    if abs(lux / 250.0 - 1.0) > CALIBRATION_TOLERANCE:
        raise SystemExit("this Blender has another unit: 250 lx expected")


def render_scene(directory, name, size, samples):
    scene = empty_scene()
    path = os.path.join(directory, f"{name}.glb")
    bpy.ops.import_scene.gltf(filepath=path)
    for material in bpy.data.materials:
        if material.use_nodes and "Principled BSDF" in material.node_tree.nodes:
            make_diffuse(material)
    document, binary = read_glb(path)
    ies_path = os.path.join(directory, f"{name}.ies")
    add_lamp(scene, ies_path, luminaire(document, binary, ies_path))
    node = next(n for n in document["nodes"] if "camera" in n)
    camera = bpy.data.objects.new("view", bpy.data.cameras.new("view"))
    camera.data.sensor_fit = "VERTICAL"
    camera.data.angle = document["cameras"][node["camera"]]["perspective"]["yfov"]
    camera.matrix_world = BLENDER_FROM_GLTF @ node_matrix(node)
    scene.collection.objects.link(camera)
    scene.camera = camera
    prepare(scene, size, samples, 1)
    render(scene, directory, name)


def main():
    arguments = sys.argv[sys.argv.index("--") + 1:]
    directory, size, samples = os.path.abspath(arguments[0]), int(arguments[1]), int(arguments[2])
    calibrate(directory)
    for name in arguments[3:]:
        render_scene(directory, name, size, samples)


main()
