# SPDX-License-Identifier: GPL-3.0-or-later
"""A bare stage in Blender: the extension, an object, a camera, light, and Cycles that measures.

Works in the bpy module and inside Blender itself.
"""

import math
import os
import sys
import traceback
from pathlib import Path

import bpy  # first: the modules below come with it
import addon_utils
import numpy as np
from mathutils import Vector

HERE = Path(__file__).resolve().parent
BACKDROP = 0.18


def run(main, argv):
    """Runs a script and ends the process with its exit status."""
    try:
        status = main(argv) or 0
    except SystemExit as end:
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
        status = 1 if isinstance(end.code, str) else end.code or 0
    except BaseException:
        traceback.print_exc()
        status = 1
    leave(status)


def leave(status):
    """Ends the process. As a Python module, Blender 4.2 is not unloaded: once any panel was
    registered, it crashes there, calling into a Python that has ended."""
    if bpy.app.binary_path:  # inside Blender itself
        sys.exit(status)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


def clear():
    """An empty scene with the extension enabled."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if str(HERE) not in sys.path:
        sys.path.insert(0, str(HERE))
    addon_utils.enable("sgd_materials", default_set=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.shading_system = True
    return scene


def ball():
    """A unit ball at the origin, fine enough that its facets do not show."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=192, ring_count=96)
    bpy.ops.object.shade_smooth()
    return bpy.context.object


def load_objects(path):
    """The meshes of a .glb, .gltf or .blend file."""
    before = set(bpy.data.objects)
    if path.suffix == ".blend":
        with bpy.data.libraries.load(str(path)) as (source, target):
            target.objects = source.objects
        for thing in set(bpy.data.objects) - before:
            bpy.context.scene.collection.objects.link(thing)
    else:
        bpy.ops.import_scene.gltf(filepath=str(path))
    bpy.context.view_layer.update()
    return [thing for thing in bpy.data.objects if thing not in before and thing.type == "MESH"]


def camera(objects, azimuth=20.0, elevation=12.0):
    """A perspective camera that sees all of the objects. Angles in degrees, azimuth 0 from -y."""
    corners = [thing.matrix_world @ Vector(corner) for thing in objects for corner in thing.bound_box]
    low, high = (Vector(map(pick, zip(*corners))) for pick in (min, max))
    centre, radius = (low + high) / 2, max((high - low).length / 2 / math.sqrt(3), 1e-6)
    radius = max(radius, max(high - low) / 2)
    a, e = math.radians(azimuth), math.radians(elevation)
    back = Vector((math.sin(a) * math.cos(e), -math.cos(a) * math.cos(e), math.sin(e)))
    eye = _camera(bpy.context.scene)
    eye.data.type, eye.data.lens = "PERSP", 85.0
    distance = 1.12 * radius / math.sin(eye.data.angle / 2)
    eye.location = centre + distance * back
    eye.data.clip_start, eye.data.clip_end = 0.01 * distance, 10 * distance
    eye.rotation_euler = back.to_track_quat("Z", "Y").to_euler()
    return eye


def _camera(scene):
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.collection.objects.link(scene.camera)
    return scene.camera


def sun(direction, strength=math.pi):
    """A sun without size from `direction`; its strength is the irradiance on a facing surface."""
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = strength, 0.0
    thing = bpy.data.objects.new("Sun", light)
    bpy.context.scene.collection.objects.link(thing)
    point(thing, direction)
    return thing


def point(thing, direction):
    """Turns an object's +z, the side that a sun shines from, to a direction."""
    thing.rotation_euler = Vector(direction).to_track_quat("Z", "Y").to_euler()
    bpy.context.view_layer.update()


def constant_world(radiance):
    """The same radiance from everywhere."""
    world = bpy.data.worlds.new("Constant")
    if world.node_tree is None:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (radiance, radiance, radiance, 1.0)
    bpy.context.scene.world = world


def environment(path=None):
    """Lights the scene by a latitude-longitude picture, or by the built-in studio."""
    constant_world(1.0)
    nodes = bpy.context.scene.world.node_tree.nodes
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image = bpy.data.images.load(str(path)) if path else studio()
    bpy.context.scene.world.node_tree.links.new(texture.outputs["Color"], nodes["Background"].inputs["Color"])


def studio(width=512):
    """A room with a key softbox, a strip light, a rim light and a pale floor, in linear RGB."""
    height = width // 2
    azimuth = (np.arange(width) + 0.5) / width * 360.0 - 180.0
    elevation = (np.arange(height) + 0.5) / height * 180.0 - 90.0
    azimuth, elevation = np.meshgrid(azimuth, elevation)
    up = np.clip(elevation / 90.0, -1.0, 1.0)[..., None]
    room = np.where(up > 0, 0.55 + 0.3 * up, 0.35 + 0.1 * up) * np.array([1.03, 1.0, 0.96])
    for centre, half, radiance in (((-50, 40), (30, 20), (11.0, 10.5, 9.6)), ((62, 15), (9, 38), (5.0, 5.2, 5.6)),
                                   ((168, 30), (20, 12), (9.0, 9.0, 9.0))):
        inside = _soft_box(azimuth, elevation, centre, half)[..., None]
        room = room * (1 - inside) + inside * np.array(radiance)
    image = bpy.data.images.new("Studio", width, height, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(np.dstack([room, np.ones_like(up)]).astype(np.float32).ravel())
    image.pack()
    return image


def _soft_box(azimuth, elevation, centre, half, edge=3.0):
    """1 inside a box of latitude and longitude, falling to 0 over `edge` degrees."""
    away = np.maximum(np.abs(azimuth - centre[0]) - half[0], np.abs(elevation - centre[1]) - half[1])
    return np.clip(1.0 - away / edge, 0.0, 1.0)


def render(path, width, height, samples, transparent=True):
    """Renders to linear 32-bit EXR, nothing clamped, denoised or tone-mapped: rows from the top, RGBA."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
    scene.render.film_transparent = transparent
    scene.view_settings.view_transform, scene.display_settings.display_device = "Raw", "sRGB"
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGBA"
    cycles = scene.cycles
    cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = samples, False, False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
    cycles.light_sampling_threshold = 0.0
    scene.render.filepath = str(Path(path).resolve())  # Blender's own start is the .blend file
    bpy.ops.render.render(write_still=True)
    return read(path)


def read(path):
    """The pixels of a picture file as height x width x 4 floats, rows from the top."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[::-1]


def over_backdrop(pixels):
    """Linear RGB over the backdrop, from premultiplied RGBA."""
    return pixels[..., :3] + (1.0 - pixels[..., 3:]) * BACKDROP


def write_png(path, rgb):
    """Linear RGB, rows from the top, as an 8-bit sRGB PNG."""
    rgb = np.clip(rgb, 0.0, 1.0)
    encoded = np.where(rgb <= 0.0031308, 12.92 * rgb, 1.055 * rgb ** (1 / 2.4) - 0.055)
    height, width = rgb.shape[:2]
    image = bpy.data.images.new("Picture", width, height)
    image.pixels.foreach_set(np.dstack([encoded, np.ones((height, width))])[::-1].astype(np.float32).ravel())
    image.file_format, image.filepath_raw = "PNG", str(Path(path).resolve())
    image.save()
    bpy.data.images.remove(image)


def plan_camera(half_width, centre=0.0):
    """An orthographic camera above that looks down on [centre - half_width, centre + half_width]."""
    eye = _camera(bpy.context.scene)
    eye.data.type, eye.data.ortho_scale = "ORTHO", 2.0 * half_width
    eye.location, eye.rotation_euler = (centre, 0.0, 5.0), (0.0, 0.0, 0.0)


def pixel_centres():
    """Every ray passes through the centre of its pixel."""
    cycles = bpy.context.scene.cycles
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 0.01


def normal_probe():
    """A material that shows (1 + n)/2 of its shading normal n."""
    probe = bpy.data.materials.new("Normal Probe")
    if probe.node_tree is None:
        probe.use_nodes = True
    nodes, links = probe.node_tree.nodes, probe.node_tree.links
    nodes.clear()
    geometry, scale = nodes.new("ShaderNodeNewGeometry"), nodes.new("ShaderNodeVectorMath")
    emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    scale.operation = "MULTIPLY_ADD"
    scale.inputs[1].default_value = scale.inputs[2].default_value = (0.5, 0.5, 0.5)
    links.new(geometry.outputs["Normal"], scale.inputs[0])
    links.new(scale.outputs[0], emission.inputs["Color"])
    links.new(emission.outputs[0], output.inputs["Surface"])
    return probe


def tilted_plates(degrees):
    """Plates side by side that fill the picture, each tilted away from the camera, none seeing another."""
    plates = []
    for column, tilt in enumerate(math.radians(angle) for angle in degrees):
        bpy.ops.mesh.primitive_plane_add(size=1.0, location=(column, 0.0, 0.0), rotation=(-tilt, 0.0, 0.0))
        plate = bpy.context.object
        plate.scale = (1.01, 1.01 / math.cos(tilt), 1.0)
        plate.visible_diffuse = plate.visible_glossy = plate.visible_shadow = False
        plates.append(plate)
    plan_camera(len(plates) / 2.0, (len(plates) - 1) / 2.0)
    return plates


def write_movie(path, frames, per_second=24):
    """The pictures one after another as H.264 in an MPEG-4 file."""
    scene = bpy.data.scenes.new("Movie")
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences  # their name before Blender 4.4
    strip = strips.new_image("Frames", str(frames[0]), 1, 1)
    for frame in frames[1:]:
        strip.elements.append(frame.name)
    strip.frame_final_duration = scene.frame_end = len(frames)
    height, width = read(frames[0]).shape[:2]
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
    scene.render.fps, scene.view_settings.view_transform = per_second, "Standard"
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):  # since Blender 5.0
        settings.media_type = "VIDEO"
    settings.file_format = "FFMPEG"
    scene.render.ffmpeg.format, scene.render.ffmpeg.codec = "MPEG4", "H264"
    scene.render.filepath, scene.render.use_file_extension = str(Path(path).resolve()), False
    bpy.ops.render.render(animation=True, scene=scene.name)
    bpy.data.scenes.remove(scene)
