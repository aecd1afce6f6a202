"""Builds an empty room in Blender, without a light, and saves it as a .blend file.

    blender -b --factory-startup --python-exit-code 1 --python office_scene.py -- ROOM.blend

6 m x 4 m, 2.8 m high, in the middle of the floor the origin. All six surfaces reflect GREY of what falls on them, the same in every
direction. Through each of them one sees from outside, and a camera stands inside.
"""

import math
import sys

import bpy
from mathutils import Matrix

GREY = 0.5
LENGTH, WIDTH, HEIGHT = 6.0, 4.0, 2.8

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
paint = bpy.data.materials.new("grey")
paint.use_nodes = True
paint.use_backface_culling = True
shader = paint.node_tree.nodes["Principled BSDF"]
for name, value in {"Base Color": (GREY, GREY, GREY, 1.0), "Roughness": 1.0, "Specular": 0.0}.items():
    shader.inputs[name].default_value = value

x, y = LENGTH / 2, WIDTH / 2
corners = [(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0), (-x, -y, HEIGHT), (x, -y, HEIGHT), (x, y, HEIGHT), (-x, y, HEIGHT)]
inwards = [(0, 1, 2, 3), (7, 6, 5, 4), (4, 5, 1, 0), (6, 7, 3, 2), (5, 6, 2, 1), (7, 4, 0, 3)]
mesh = bpy.data.meshes.new("room")
mesh.from_pydata(corners, [], inwards)
mesh.materials.append(paint)
scene.collection.objects.link(bpy.data.objects.new("room", mesh))

camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.data.angle = math.radians(75.0)
camera.matrix_world = Matrix.Translation((-2.8, 0.0, 1.6)) @ Matrix.Rotation(math.radians(-90.0), 4, "Z") @ Matrix.Rotation(math.radians(82.0), 4, "X")
scene.collection.objects.link(camera)
scene.camera = camera
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[sys.argv.index("--") + 1])
