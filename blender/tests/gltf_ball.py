# SPDX-License-Identifier: GPL-3.0-or-later
"""Radiance of a ball under one sun with glTF materials as Blender renders them, as CSV.

The materials are Principled BSDFs with the values that Blender's glTF importer gives them, and
the single-scattering GGX that glTF's appendix B describes. One line a pixel:
case,x,y,r,g,b with (x, y) the point of the picture plane; the sun of irradiance pi stands at
(-0.5, 0.5, 0.7071), the camera looks down -z.

    python blender/tests/gltf_ball.py > tests/data/blender-gltf-ball.csv
"""

import math
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np

SIZE = 32
CASES = {
    "metal": {"Base Color": (0.9, 0.6, 0.3, 1), "Metallic": 1.0, "Roughness": 0.4},
    "rough-metal": {"Base Color": (0.2, 0.5, 0.8, 1), "Metallic": 1.0, "Roughness": 0.8},
    "plastic": {"Base Color": (0.5, 0.2, 0.1, 1), "Metallic": 0.0, "Roughness": 0.3},
    "tinted": {
        "Base Color": (0.3, 0.1, 0.02, 1),
        "Metallic": 0.0,
        "Roughness": 0.5,
        "Specular IOR Level": 0.4,
        "Specular Tint": (5.0, 3.0, 1.0, 1),
    },
    "coated": {
        "Base Color": (0.3, 0.1, 0.02, 1),
        "Metallic": 0.0,
        "Roughness": 0.6,
        "Coat Weight": 1.0,
        "Coat Roughness": 0.2,
    },
}


def scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    s = bpy.context.scene
    s.render.engine = "CYCLES"
    s.cycles.device = "CPU"
    s.cycles.samples = 1
    s.cycles.use_denoising = False
    s.cycles.use_adaptive_sampling = False
    s.cycles.sample_clamp_direct = 0
    s.cycles.sample_clamp_indirect = 0
    s.cycles.max_bounces = 0
    s.cycles.pixel_filter_type = "BOX"
    s.cycles.filter_width = 0.01
    s.render.resolution_x = s.render.resolution_y = SIZE
    s.render.film_transparent = True
    s.view_settings.view_transform = "Raw"
    s.render.image_settings.file_format = "OPEN_EXR"
    s.render.image_settings.color_depth = "32"
    s.render.threads_mode = "FIXED"
    s.render.threads = 1
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = 2
    camera.location = (0, 0, 5)
    s.collection.objects.link(camera)
    s.camera = camera
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy = math.pi
    sun.data.angle = 0
    from mathutils import Vector
    sun.rotation_euler = Vector((-0.5, 0.5, math.sqrt(0.5))).to_track_quat("Z", "Y").to_euler()
    s.collection.objects.link(sun)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128, radius=1)
    bpy.ops.object.shade_smooth()
    return s, bpy.context.object


def material(values):
    m = bpy.data.materials.new("m")
    if bpy.app.version < (5, 0):
        m.use_nodes = True
    node = next(n for n in m.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    node.distribution = "GGX"
    node.inputs["IOR"].default_value = 1.5
    for key, value in values.items():
        node.inputs[key].default_value = value
    return m


def main():
    s, ball = scene()
    out = Path(tempfile.mkdtemp()) / "ball.exr"
    s.render.filepath = str(out)
    print("case,x,y,r,g,b")
    ball.data.materials.append(None)
    for name, values in CASES.items():
        ball.data.materials[0] = material(values)
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(str(out))
        image.colorspace_settings.name = "Non-Color"
        pixels = np.array(image.pixels[:]).reshape(SIZE, SIZE, 4)
        bpy.data.images.remove(image)
        for row in range(1, SIZE, 3):
            for column in range(1, SIZE, 3):
                x, y = (2 * (i + 0.5) / SIZE - 1 for i in (column, row))
                r, g, b, a = pixels[row, column]
                if x * x + y * y < 0.97 and max(r, g, b) > 1e-4:
                    print(f"{name},{x},{y},{r:.7g},{g:.7g},{b:.7g}")


if __name__ == "__main__":
    main()
