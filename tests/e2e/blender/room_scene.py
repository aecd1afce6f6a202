"""Builds a room in Blender, exports it with Blender's own glTF exporter, and states what Cycles measures in it.

    blender -b --factory-startup --python-exit-code 1 --python room_scene.py -- OUTDIR

writes OUTDIR/room.glb and OUTDIR/expected.json:
    {"camera": {"eye_m", "aim", "yfov_rad"},
     "points": [{"group", "light", "quantity", "point_m", "normal", "cycles": rgb, "closed_form": rgb or null,
                 "whole": rgb of a share's whole, if it is one}]}
in glTF's coordinates (+Y up, metres). Each point is lit by one of the lights `sun`, `lamp` and `spot`; "quantity" is as in probe.py.

The sun shines along SUN through three windows of the wall x = -3: a curtain (a Principled BSDF of an alpha, which Cycles renders
as it was exported), nothing, and tinted glass (exported as transmission; a Transparent BSDF of its colour in Cycles, because the
renderer under test refracts nothing). Opaque surfaces are exported as Principled and become diffuse for Cycles.
"""

import json
import math
import os
import sys

import bpy
from mathutils import Matrix, Vector

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from probe import LUMENS_PER_WATT, Probe, export_options, face_point, make_diffuse, to_gltf  # noqa: E402

SUN = Vector((1.0, 0.15, -0.9)).normalized()  # where its light goes
SUN_W_M2, SUN_COLOR = 12.0, (1.0, 0.9, 0.7)
LAMP, LAMP_W, LAMP_COLOR = Vector((1.2, 0.9, 2.5)), 120.0, (1.0, 0.8, 0.5)
SPOT, SPOT_AIM, SPOT_W, SPOT_SIZE = Vector((1.4, -0.7, 2.8)), Vector((0.1, -0.4, -1.0)).normalized(), 200.0, math.radians(60.0)
CURTAIN_ALPHA, GLASS, CLAY = 0.35, (0.4, 0.8, 0.6), (0.6, 0.3, 0.2)
SILL, LINTEL = 1.2, 2.4                                   # of the windows, m
WINDOWS = {"curtain": (-2.1, -1.3), None: (-0.7, 0.7), "glass": (1.3, 2.1)}  # y of the windows, m
UP, DOWN = Vector((0.0, 0.0, 1.0)), Vector((0.0, 0.0, -1.0))


def material(name, color, **inputs):
    result = bpy.data.materials.new(name)
    result.use_nodes = True
    shader = result.node_tree.nodes["Principled BSDF"]
    for key, value in {"Base Color": (*color, 1.0), "Roughness": 1.0, "Specular": 0.0, **inputs}.items():
        shader.inputs[key].default_value = value
    return result


def add_mesh(scene, name, corners, surface):
    """corners: four for each quadrilateral."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [tuple(range(k, k + 4)) for k in range(0, len(corners), 4)])
    mesh.materials.append(surface)
    result = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(result)
    return result


def upright(x, y0, y1, z0, z1):
    return [(x, y0, z0), (x, y1, z0), (x, y1, z1), (x, y0, z1)]


def flat(x0, x1, y0, y1, z):
    return [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]


def build_room(scene):
    add_mesh(scene, "floor", flat(-3, 3, -2.5, 2.5, 0), material("boards", (0.6, 0.5, 0.4)))
    plaster = material("plaster", (0.8, 0.75, 0.7))
    add_mesh(scene, "ceiling", flat(-3, 3, -2.5, 2.5, 3), plaster)
    add_mesh(scene, "walls", upright(3, -2.5, 2.5, 0, 3) + [(-3, -2.5, 0), (3, -2.5, 0), (3, -2.5, 3), (-3, -2.5, 3)]
             + [(-3, 2.5, 0), (3, 2.5, 0), (3, 2.5, 3), (-3, 2.5, 3)], plaster)
    wall = upright(-3, -2.5, 2.5, 0, SILL) + upright(-3, -2.5, 2.5, LINTEL, 3)
    sides = [-2.5, *(y for window in WINDOWS.values() for y in window), 2.5]
    for y0, y1 in zip(sides[0::2], sides[1::2]):
        wall += upright(-3, y0, y1, SILL, LINTEL)
    add_mesh(scene, "window wall", wall, plaster)
    curtain = material("curtain", (0.9, 0.9, 0.9), Alpha=CURTAIN_ALPHA)
    curtain.blend_method = "BLEND"
    add_mesh(scene, "curtain", upright(-3, *WINDOWS["curtain"], SILL, LINTEL), curtain)
    add_mesh(scene, "glass", upright(-3, *WINDOWS["glass"], SILL, LINTEL), material("glass", GLASS, Transmission=1.0))


def paint(surface, layer, factor=None):
    """The base colour becomes the colour attribute, times a factor where there is one."""
    nodes, links = surface.node_tree.nodes, surface.node_tree.links
    attribute = nodes.new("ShaderNodeVertexColor")
    attribute.layer_name = layer
    color = attribute.outputs["Color"]
    if factor:
        mix = nodes.new("ShaderNodeMix")
        mix.data_type, mix.blend_type = "RGBA", "MULTIPLY"
        mix.inputs[0].default_value = 1.0
        links.new(color, mix.inputs[6])  # A and B of colours: by name they are those of floats
        mix.inputs[7].default_value = (*factor, 1.0)
        color = mix.outputs[2]
    links.new(color, nodes["Principled BSDF"].inputs["Base Color"])


def build_coloured(scene):
    """A rug of smooth colours at its vertices, floats; tiles of colours at their corners, bytes, times a factor."""
    rug = add_mesh(scene, "rug", flat(-1.6, -0.6, -0.3, 0.3, 0.02), material("rug", (1, 1, 1)))
    colors = rug.data.color_attributes.new("pile", "FLOAT_COLOR", "POINT")
    for datum, rgb in zip(colors.data, [(0.9, 0.1, 0.05), (0.2, 0.6, 0.1), (0.05, 0.1, 0.8), (0.7, 0.7, 0.2)]):
        datum.color = (*rgb, 1.0)
    paint(rug.data.materials[0], "pile")
    tiles = add_mesh(scene, "tiles", flat(-1.5, -1.0, -1.6, -1.2, 0.02) + flat(-1.0, -0.5, -1.6, -1.2, 0.02),
                     material("tiles", (1, 1, 1)))
    colors = tiles.data.color_attributes.new("glaze", "BYTE_COLOR", "CORNER")
    for k, datum in enumerate(colors.data):
        datum.color = (0.5, 0.05, 0.1, 1.0) if k < 4 else (0.1, 0.4, 0.6, 1.0)
    paint(tiles.data.materials[0], "glaze", (0.9, 0.8, 0.7))


def build_blocks(scene):
    """Objects that share one mesh: plain, turned and mirrored, below a parent, and in a collection that an empty shows. Its backs
    are culled. Result: their matrices."""
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    first = bpy.context.object
    first.name = "block"
    first.data.materials.append(material("clay", CLAY))
    first.data.materials[0].use_backface_culling = True
    first.matrix_world = Matrix.Translation((2.3, 1.6, 0.3)) @ Matrix.Diagonal((0.5, 0.6, 0.6, 1.0))
    stand = bpy.data.objects.new("stand", None)
    stand.location, stand.rotation_euler = (0.6, -0.2, 0.0), (0.0, 0.0, math.radians(30.0))
    hall = bpy.data.collections.new("shelf")  # not linked into the scene: seen through its instance alone
    inside = Matrix.Translation((0.0, 0.2, 0.5)) @ Matrix.Diagonal((0.3, 0.4, 0.2, 1.0))
    empty = bpy.data.objects.new("shelf instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", hall
    empty.matrix_world = Matrix.Translation((1.7, -1.5, 0.1)) @ Matrix.Rotation(math.radians(-20.0), 4, "Z")
    for name, owner, place, collection in [
            ("turned", None, Matrix.Translation((-0.95, 0.7, 0.15)) @ Matrix.Rotation(math.radians(25.0), 4, "Z")
             @ Matrix.Diagonal((-0.3, 0.3, 0.3, 1.0)), scene.collection),
            ("child", stand, Matrix.Translation((0.0, 0.8, 0.4)) @ Matrix.Diagonal((0.4, 0.5, 0.8, 1.0)), scene.collection),
            ("shelved", None, inside, hall)]:
        instance = bpy.data.objects.new(name, first.data)
        instance.parent = owner
        instance.matrix_basis = place
        collection.objects.link(instance)
    scene.collection.objects.link(stand)
    scene.collection.objects.link(empty)
    bpy.context.view_layer.update()
    places = {name: bpy.data.objects[name].matrix_world.copy() for name in ("block", "turned", "child")}
    places["shelved"] = empty.matrix_world @ inside
    return places


def add_light(scene, rig, name, kind, energy, color, position, aim):
    data = bpy.data.lights.new(name, kind)
    data.energy, data.color = energy, color
    if kind == "SPOT":
        data.spot_size, data.spot_blend = SPOT_SIZE, 0.3
    if kind != "SUN":  # it keeps Blender's angle, 0.526°
        data.shadow_soft_size = 0.0
    result = bpy.data.objects.new(name, data)
    scene.collection.objects.link(result)
    result.parent = rig
    bpy.context.view_layer.update()
    turn = aim.to_track_quat("-Z", "Y").to_matrix().to_4x4()
    result.matrix_world = Matrix.Translation(position) @ turn @ Matrix.Diagonal((2.0, 2.0, 2.0, 1.0))


def build():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    build_room(scene)
    build_coloured(scene)
    blocks = build_blocks(scene)
    rig = bpy.data.objects.new("rig", None)
    rig.location, rig.rotation_euler, rig.scale = (0.3, 0.2, 0.1), (0.2, 0.3, 0.4), (2.0, 2.0, 2.0)  # it scales no light
    scene.collection.objects.link(rig)
    add_light(scene, rig, "sun", "SUN", SUN_W_M2, SUN_COLOR, Vector((0, 0, 1)), SUN)
    add_light(scene, rig, "lamp", "POINT", LAMP_W, LAMP_COLOR, LAMP, DOWN)
    add_light(scene, rig, "spot", "SPOT", SPOT_W, (1, 1, 1), SPOT, SPOT_AIM)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.matrix_world = Matrix.Translation((2.7, -2.2, 1.9)) @ Vector((-1, 0.8, -0.4)).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.context.view_layer.update()
    return scene, blocks


def through(window, u, v, z=0.0):
    """Where the sun's ray through (u, v) of a window, each 0 to 1, meets the height z."""
    y0, y1 = WINDOWS[window]
    start = Vector((-3.0, y0 + u * (y1 - y0), SILL + v * (LINTEL - SILL)))
    return start + SUN * ((z - start.z) / SUN.z)


def by_sun(normal, passes=(1.0, 1.0, 1.0)):
    cosine = max(0.0, -SUN.dot(normal))
    return [LUMENS_PER_WATT * SUN_W_M2 * c * p * cosine for c, p in zip(SUN_COLOR, passes)]


def by_source(point, normal, position, watt, color):
    way = point - position
    cosine = max(0.0, -way.normalized().dot(normal))
    return [LUMENS_PER_WATT * watt / (4.0 * math.pi) * c * cosine / way.length_squared for c in color]


def sun_points(blocks):
    rows = []
    curtain = (1.0 - CURTAIN_ALPHA,) * 3
    for u, v in ((0.75, 0.3), (0.05, 0.3), (0.95, 0.2), (0.3, 0.95)):  # beside the rug
        rows.append(("sun", "sun", "direct_lx", through(None, u, v), UP, by_sun(UP)))
    for u, v in ((0.2, 0.3), (0.1, 0.8), (0.85, 0.6)):  # beside the tiles
        rows.append(("sun, through the curtain", "sun", "direct_lx", through("curtain", u, v), UP, by_sun(UP, curtain)))
        rows.append(("sun, through the glass", "sun", "direct_lx", through("glass", u, v), UP, by_sun(UP, GLASS)))
    for axis, sign, offset in ((2, 1, (0.2, 0.1)), (0, 1, (0.2, 0.3))):
        point, normal = face_point(blocks["turned"], axis, sign, offset)
        rows.append(("sun, an instance", "sun", "direct_lx", point, normal, by_sun(normal)))
        rows.append(("sun, an instance", "sun", "direct_nit", point, normal, by_sun(normal, [c / math.pi for c in CLAY])))
    return rows


def dark_points(blocks):
    def floor(x, y):
        return Vector((x, y, 0.0)), UP

    places = [("sun", *floor(-1.0, -0.7)), ("sun", *floor(-1.0, 1.3)), ("sun", *floor(1.0, 0.0)), ("sun", *floor(-0.73, 0.73)),
              ("sun", *face_point(blocks["turned"], 0, -1)), ("lamp", *floor(1.95, -2.01)), ("lamp", *face_point(blocks["block"], 0, 1)),
              ("spot", *floor(-0.5, 1.5)), ("spot", *face_point(blocks["shelved"], 2, -1))]
    return [("dark", light, "direct_lx", point, normal, [0.0] * 3) for light, point, normal in places]


def shadow_points(blocks):
    """On the floor, 2 cm inside and outside of where an instance's shadow ends: of its upper edge on the far side of the light."""
    rows = []
    for name, light, axis, sign in (("turned", "sun", 0, -1), ("block", "lamp", 1, 1), ("child", "lamp", 0, -1), ("shelved", "lamp", 1, -1)):
        face, normal = face_point(blocks[name], axis, sign)
        edge = face + 0.5 * blocks[name].col[2].to_3d()
        ray = SUN if light == "sun" else edge - LAMP
        end = edge - ray * (edge.z / ray.z)
        lit, dark = end + 0.02 * normal, end - 0.02 * normal
        truth = by_sun(UP) if light == "sun" else by_source(lit, UP, LAMP, LAMP_W, LAMP_COLOR)
        rows += [("beside shadows of instances", light, "direct_lx", lit, UP, truth), ("dark", light, "direct_lx", dark, UP, [0.0] * 3)]
    return rows


def penumbra_points():
    """Below the lintel, at shares c of the radius of the sun's disc: 1/2 + (c √(1-c²) + asin c) / π is in sight."""
    radius = 0.5 * bpy.data.lights["sun"].angle
    steeper = Vector((0.0, 1.0, 0.0)).cross(SUN).normalized()
    rows = []
    for c in (-0.5, 0.0, 0.5):
        ray = SUN + c * math.tan(radius) * steeper
        start = Vector((-3.0, 0.0, LINTEL))
        share = 0.5 + (c * math.sqrt(1.0 - c * c) + math.asin(c)) / math.pi
        rows.append(("penumbra", "sun", "disc_lx", start - ray * (start.z / ray.z), UP, by_sun(UP, (share,) * 3)))
    return rows


def source_points(blocks):
    rows = []
    for name, position, watt, color in (("lamp", LAMP, LAMP_W, LAMP_COLOR), ("spot", SPOT, SPOT_W, (1, 1, 1))):
        axis = SPOT + SPOT_AIM * (-SPOT.z / SPOT_AIM.z)
        places = {"lamp": [(Vector((1.2, 0.9, 0.0)), UP), (Vector((-0.8, -1.5, 0.02)), UP), (Vector((3.0, 0.5, 1.4)), Vector((-1, 0, 0))),
                           face_point(blocks["block"], 2, 1, (0.1, -0.2)), face_point(blocks["child"], 0, 1, (0.2, 0.3)),
                           face_point(blocks["shelved"], 1, 1, (0.2, 0.2)), face_point(blocks["shelved"], 2, 1, (0.2, 0.2))],
                  "spot": [(axis + Vector((-0.3, 0.1, 0.0)), UP), (axis + Vector((0.5, -0.3, 0.0)), UP),
                           face_point(blocks["shelved"], 2, 1, (-0.3, 0.1)), face_point(blocks["shelved"], 1, 1, (-0.3, 0.3))]}[name]
        rows += [(name, name, "direct_lx", point, normal, by_source(point, normal, position, watt, color)) for point, normal in places]
    return rows


def coloured_points(blocks):
    rows = []
    for x, y in ((-1.5, -0.2), (-1.4, 0.2), (-1.1, 0.05), (-0.75, -0.15)):
        rows.append(("vertex colours", "sun", "direct_nit", Vector((x, y, 0.02)), UP, None))
    for x in (-1.3, -0.8):
        rows.append(("vertex colours, through the curtain", "sun", "direct_nit", Vector((x, -1.4, 0.02)), UP, None))
    for point, normal in ((Vector((-1.1, 0.0, 3.0)), DOWN), (Vector((-1.0, -2.5, 0.4)), Vector((0, 1, 0))),
                          face_point(blocks["child"], 0, -1)):
        rows.append(("one bounce of the sun", "sun", "bounce_lx", point, normal, None))
    return rows


def prepare_for_cycles():
    """What Cycles has in place of the exported shaders. The curtain keeps its own."""
    for surface in bpy.data.materials:
        if surface.name == "glass":
            nodes, links = surface.node_tree.nodes, surface.node_tree.links
            transparent = nodes.new("ShaderNodeBsdfTransparent")
            transparent.inputs["Color"].default_value = (*GLASS, 1.0)
            links.new(transparent.outputs["BSDF"], nodes["Material Output"].inputs["Surface"])
        elif surface.name != "curtain":
            make_diffuse(surface)


SAMPLES = {"direct_lx": 16, "direct_nit": 16, "disc_lx": 256, "bounce_lx": 1024}  # of each of 64 pixels


def main():
    directory = os.path.abspath(sys.argv[sys.argv.index("--") + 1])
    scene, blocks = build()
    bpy.ops.export_scene.gltf(filepath=os.path.join(directory, "room.glb"), export_format="GLB",
                              **export_options(bpy.ops.export_scene.gltf))
    seen_from = scene.camera.matrix_world
    shape = scene.render.resolution_y / scene.render.resolution_x  # wider than high: the lens' angle is that of the width
    camera = {"eye_m": to_gltf(seen_from.translation), "aim": to_gltf(-seen_from.col[2].to_3d()),
              "yfov_rad": 2.0 * math.atan(shape * math.tan(0.5 * scene.camera.data.angle))}
    prepare_for_cycles()
    probe = Probe(scene, directory)
    points = []
    for group, light, quantity, point, normal, truth in (sun_points(blocks) + penumbra_points() + source_points(blocks)
                                                         + coloured_points(blocks) + shadow_points(blocks) + dark_points(blocks)):
        for other in ("sun", "lamp", "spot"):
            bpy.data.objects[other].hide_render = other != light
        points.append({"group": group, "light": light, "quantity": quantity, "point_m": to_gltf(point), "normal": to_gltf(normal),
                       "cycles": probe.measure(point, normal, quantity, SAMPLES[quantity]), "closed_form": truth})
        if quantity == "disc_lx":
            points[-1]["whole"] = by_sun(normal)
    with open(os.path.join(directory, "expected.json"), "w", encoding="utf-8") as file:
        json.dump({"camera": camera, "points": points}, file, indent=1)


main()
