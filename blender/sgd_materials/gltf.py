# SPDX-License-Identifier: GPL-3.0-or-later
"""The glTF extension through Blender's own importer and exporter."""

import copy
import importlib
import os

import bpy

from . import material
from .manifest import EXTENSION_NAME, FormatError, read_extension

MIME_TYPES = {"exr": "image/x-exr", "png": "image/png"}


class glTF2ImportUserExtension:
    """Builds the SGD material on a glTF material that carries the extension."""

    def __init__(self):
        from io_scene_gltf2.io.com.gltf2_io_extensions import Extension

        self.extensions = [Extension(name=EXTENSION_NAME, extension={}, required=False)]

    def gather_import_material_after_hook(self, gltf_material, vertex_color, blender_material, gltf):
        extension = (gltf_material.extensions or {}).get(EXTENSION_NAME)
        if extension is None:
            return
        try:
            source = read_extension(extension, lambda index: _buffer_view(gltf, index), os.path.dirname(gltf.filename))
            material.attach(blender_material, source)
        except FormatError as error:
            gltf.log.error(f"{gltf_material.name}: {error}")


class glTF2ExportUserExtension:
    """Writes the extension back, its textures byte for byte."""

    def __init__(self):
        from io_scene_gltf2.io.com.gltf2_io_extensions import Extension

        self.Extension = Extension

    def gather_material_hook(self, gltf_material, blender_material, export_settings):
        if not material.is_sgd(blender_material):
            return
        source = material.detach_source(blender_material)
        extension = {**source.description, "textures": [_texture(texture) for texture in source.textures]}
        gltf_material.extensions[EXTENSION_NAME] = self.Extension(EXTENSION_NAME, extension, required=False)
        gltf_material.extras = _extras(gltf_material.extras, source.description)


def glTF2_pre_export_callback(export_settings):
    """The exporter reads the Principled BSDF that is linked to the output: links it."""
    for each in _sgd_materials():
        material.link(each, "FIT")


def glTF2_post_export_callback(export_settings):
    for each in _sgd_materials():
        material.show(each)


def _sgd_materials():
    return [each for each in bpy.data.materials if material.is_sgd(each)]


def _buffer_view(gltf, index):
    binary = importlib.import_module("io_scene_gltf2.io.imp.gltf2_io_binary")
    return bytes(binary.BinaryData.get_buffer_view(gltf, index))


def _texture(texture):
    entry = copy.deepcopy(texture.entry)
    entry["bufferView"] = _binary_data(texture.data)
    entry["mimeType"] = MIME_TYPES[entry["format"]]
    return entry


def _binary_data(data):
    try:
        module = importlib.import_module("io_scene_gltf2.io.exp.binary_data")
    except ModuleNotFoundError:  # its name before Blender 4.4
        module = importlib.import_module("io_scene_gltf2.io.exp.gltf2_io_binary_data")
    return module.BinaryData(data)


def _extras(extras, description):
    """extras.sgd, which generic tools keep, without this extension's own property."""
    kept = {key: value for key, value in (extras or {}).items() if key != material.PROPERTY}
    return {**kept, "sgd": {key: description[key] for key in ("version", "name", "channels")}}
