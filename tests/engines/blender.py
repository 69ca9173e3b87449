# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws glTF materials in Blender's Cycles, as its glTF importer makes them.

    python blender.py MATERIALS.json OUT [--size 48] [--suns 15,40,70,110,140] [--environment FILE.hdr --samples 1024] [--keep]

With the bpy module of PyPI, 4.5. The arguments and the files written are those of draw.mjs. The ball is one
small facet per pixel, tangent to the ball at the pixel's centre, seen by a ray through that centre; nothing casts a
shadow, and the ball is convex: pictures under suns are without noise.
"""
import argparse
import json
import math
import os
import tempfile
from pathlib import Path

import bpy
import numpy as np


def facets(size):
    """A mesh of squares, each a fifth of a pixel wide, tangent to the unit ball at the centres of its pixels."""
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size * 2 - 1
    inside = x * x + y * y < 1
    normal = np.stack([x, y, np.sqrt(np.clip(1 - x * x - y * y, 0, 1))], -1)[inside]
    side = np.cross(normal, [0.0, 1, 0])
    side /= np.linalg.norm(side, axis=1)[:, None]
    up = np.cross(side, normal)
    half = 0.2 / size
    corners = [normal + half * (a * side + b * up) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    vertices = np.stack(corners, 1).reshape(-1, 3)
    mesh = bpy.data.meshes.new("ball")
    mesh.from_pydata(vertices.tolist(), [], np.arange(len(vertices)).reshape(-1, 4)[:, ::-1].tolist())
    centre, facing = mesh.polygons[len(mesh.polygons) // 2], normal[len(normal) // 2]
    if np.dot(centre.normal, facing) < 0:
        mesh.flip_normals()
    return mesh


def imported(materials):
    """The materials that Blender's importer makes of a glTF file, in order."""
    json_file = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(materials)))}],
        "nodes": [{"mesh": k} for k in range(len(materials))],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": k}]} for k in range(len(materials))],
        "materials": [{**m["material"], "name": str(k)} for k, m in enumerate(materials)],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "triangle.bin"}],
        "extensionsUsed": sorted({name for m in materials for name in m["material"].get("extensions", {})}),
    }
    with tempfile.TemporaryDirectory() as folder:
        np.array([0, 0, 0, 1, 0, 0, 0, 1, 0], "<f4").tofile(Path(folder) / "triangle.bin")
        (Path(folder) / "all.gltf").write_text(json.dumps(json_file))
        bpy.ops.import_scene.gltf(filepath=str(Path(folder) / "all.gltf"))
    found = [bpy.data.materials[str(k)] for k in range(len(materials))]
    for thing in list(bpy.data.objects):
        if thing.type == "MESH":
            bpy.data.objects.remove(thing)
    return found


def stage(size):
    """A camera that looks along -z through the pixels' centres, and Cycles without approximations."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 1, False, False
    scene.cycles.max_bounces = 0
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "GAUSSIAN", 0.01  # BOX has no width
    scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0
    scene.render.threads_mode, scene.render.threads = "FIXED", 2
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.film_transparent = True
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 2.0, (0, 0, 5)
    scene.collection.objects.link(camera)
    scene.camera = camera
    return scene


def picture(scene, folder):
    """r, g, b of the rendered pixels, rows upwards."""
    scene.render.filepath = str(Path(folder) / "picture.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath, check_existing=False)
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(-1, 4)[:, :3].copy()


def environment(path):
    """A world lit by an equirectangular image whose centre lies behind the ball, as `sgdbake preview` has it."""
    world = bpy.data.worlds.new("environment")
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    direction, split, turned = (nodes.new("ShaderNode" + kind) for kind in ("TexCoord", "SeparateXYZ", "CombineXYZ"))
    links.new(direction.outputs["Generated"], split.inputs[0])
    for source, sign, target in (("Z", -1, "X"), ("X", -1, "Y"), ("Y", 1, "Z")):  # the picture's up is y, Blender's z
        scaled = nodes.new("ShaderNodeMath")
        scaled.operation, scaled.inputs[1].default_value = "MULTIPLY", sign
        links.new(split.outputs[source], scaled.inputs[0])
        links.new(scaled.outputs[0], turned.inputs[target])
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image = bpy.data.images.load(str(path))
    links.new(turned.outputs[0], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], nodes["Background"].inputs["Color"])
    return world


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("materials", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--size", type=int, default=48)
    parser.add_argument("--suns", default="15,40,70,110,140")
    parser.add_argument("--environment", type=Path)
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--keep", action="store_true", help="draw only what OUT does not hold yet")
    options = parser.parse_args()
    materials = [entry for entry in json.loads(options.materials.read_text())
                 if not (options.keep and (options.out / f"{entry['label']}.f32").is_file())]
    if not materials:
        return
    scene = stage(options.size)
    shaders = imported(materials)
    ball = bpy.data.objects.new("ball", facets(options.size))
    scene.collection.objects.link(ball)
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.data.angle, sun.data.use_shadow = math.pi, 0.0, False
    scene.collection.objects.link(sun)
    dark, world = bpy.data.worlds.new("dark"), options.environment and environment(options.environment)
    dark.color = (0, 0, 0)
    options.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        for entry, shader in zip(materials, shaders):
            ball.data.materials.clear()
            ball.data.materials.append(shader)
            pictures = []
            scene.world, sun.hide_render, scene.cycles.samples = dark, False, 1
            for angle in (math.radians(float(a)) for a in options.suns.split(",") if a):
                sun.rotation_euler = (0, angle, 0)
                pictures.append(picture(scene, folder))
            if world:
                scene.world, sun.hide_render, scene.cycles.samples = world, True, options.samples
                pictures.append(picture(scene, folder))
            path = options.out / f"{entry['label']}.f32"
            np.concatenate(pictures).astype("<f4").tofile(path.with_suffix(".tmp"))
            os.replace(path.with_suffix(".tmp"), path)
    print(f"Blender {bpy.app.version_string}", flush=True)
    os._exit(0)  # bpy may crash while Python ends


if __name__ == "__main__":
    main()
