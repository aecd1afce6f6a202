"""What the scripts that run inside Blender share: frames, and light that Cycles measures at single points.

Units. Blender's watt becomes 683 lm, as its exporter's lighting mode 'SPEC' has it. A diffuse surface of reflectance 1 under the
irradiance E has the radiance E / pi, hence E_lux = 683 pi L for the radiance L of a white surface, and 683 L cd/m².
"""

import math
import os

import bpy
from mathutils import Matrix, Vector

LUMENS_PER_WATT = 683.0


def to_gltf(v):
    """Blender is +Z up, glTF +Y up."""
    return [v[0], v[2], -v[1]]


def export_options(bpy_export):
    """The exporter's lighting mode is 'SPEC': candela and lux. The option's name has changed since Blender 3.4."""
    known = bpy_export.get_rna_type().properties.keys()
    return {"export_cameras": True, "export_lights": True,
            next(name for name in known if name.endswith("convert_lighting_mode")): "SPEC"}


def face_point(matrix, axis, sign, offset=(0.0, 0.0)):
    """A point on a face of a unit cube that stands at `matrix`, and the face's world normal."""
    local = [offset[0], offset[1], offset[1]]
    others = [k for k in range(3) if k != axis]
    local[axis], local[others[0]], local[others[1]] = 0.5 * sign, offset[0], offset[1]
    direction = [0.0, 0.0, 0.0]
    direction[axis] = sign
    normal = (matrix.to_3x3().inverted().transposed() @ Vector(direction)).normalized()
    return matrix @ Vector(local), normal


def make_diffuse(material):
    """Puts a diffuse shader with the same base colour in the Principled one's place: the renderer under test knows no other."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    principled = nodes["Principled BSDF"]
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    color = principled.inputs["Base Color"]
    diffuse.inputs["Color"].default_value = color.default_value
    if color.is_linked:
        links.new(color.links[0].from_socket, diffuse.inputs["Color"])
    links.new(diffuse.outputs["BSDF"], nodes["Material Output"].inputs["Surface"])
    nodes.remove(principled)


class Probe:
    """A camera that sees 2 mm x 2 mm of a surface from 2 cm above it. A camera casts no shadow."""

    def __init__(self, scene, directory):
        self.scene = scene
        self.path = os.path.join(directory, "probe.exr")
        scene.render.engine = "CYCLES"
        scene.cycles.device = "CPU"
        scene.cycles.use_adaptive_sampling = False
        scene.cycles.use_denoising = False
        scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0.0
        for bounces in ("glossy_bounces", "transmission_bounces", "volume_bounces"):
            setattr(scene.cycles, bounces, 0)
        scene.render.resolution_x = scene.render.resolution_y = 8
        scene.render.resolution_percentage = 100
        scene.render.threads_mode = "FIXED"
        scene.render.threads = 1
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.image_settings.color_depth = "32"
        scene.view_layers[0].use_pass_diffuse_direct = scene.view_layers[0].use_pass_diffuse_indirect = True
        scene.use_nodes = True
        scene.node_tree.nodes.clear()
        self.layers = scene.node_tree.nodes.new("CompositorNodeRLayers")
        self.composite = scene.node_tree.nodes.new("CompositorNodeComposite")
        camera = bpy.data.cameras.new("probe")
        camera.type = "ORTHO"
        camera.ortho_scale = 0.002
        camera.clip_start = 0.001
        self.camera = bpy.data.objects.new("probe", camera)
        scene.collection.objects.link(self.camera)
        scene.camera = self.camera

    def measure(self, point, normal, quantity="direct_lx", samples=16):
        """Result: rgb of "direct_lx", "disc_lx" (the same) or "bounce_lx" (after one diffuse bounce), lux, or "direct_nit" (cd/m²)."""
        bounces = 1 if quantity == "bounce_lx" else 0
        self.scene.cycles.samples = samples
        self.scene.cycles.max_bounces = self.scene.cycles.diffuse_bounces = bounces
        output, factor = {"bounce_lx": ("DiffInd", math.pi), "direct_nit": ("Image", 1.0)}.get(quantity, ("DiffDir", math.pi))
        self.scene.node_tree.links.new(self.layers.outputs[output], self.composite.inputs["Image"])
        # A camera looks along its -Z: its +Z is the normal.
        turn = normal.to_track_quat("Z", "Y").to_matrix().to_4x4()
        self.camera.matrix_world = Matrix.Translation(point + 0.02 * normal) @ turn
        self.scene.render.filepath = self.path
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(self.path, check_existing=False)
        pixels, channels = list(image.pixels), image.channels
        bpy.data.images.remove(image)
        os.remove(self.path)
        return [LUMENS_PER_WATT * factor * sum(pixels[k::channels]) * channels / len(pixels) for k in range(3)]
