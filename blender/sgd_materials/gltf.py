# SPDX-License-Identifier: GPL-3.0-or-later
"""The glTF extension through Blender's own importer and exporter."""

import copy
import importlib
import os

from . import fallback, material
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
            fallback.adopt(blender_material, source)
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
        try:
            about, textures = material.description(blender_material), _textures(blender_material, export_settings)
        except FormatError as error:
            export_settings["log"].error(f"{blender_material.name}: {error}", popup=True)
            return
        extension = {**about, "textures": textures}
        gltf_material.extensions = gltf_material.extensions or {}
        gltf_material.extensions[EXTENSION_NAME] = self.Extension(EXTENSION_NAME, extension, required=False)
        gltf_material.extras = _extras(gltf_material.extras, about)


def glTF2_pre_export_callback(export_settings):
    """The exporter reads a Principled BSDF that is linked to the output: links one for as long."""
    fallback.show_all()


def glTF2_post_export_callback(export_settings):
    fallback.restore_all()


def _textures(blender_material, export_settings):
    """The lookup textures; none, said aloud, where a file is missing: the parameters are written all the same."""
    try:
        return [_texture(each) for each in material.detach_source(blender_material).textures]
    except FormatError as error:
        export_settings["log"].warning(f"{blender_material.name}: exported without lookup textures: {error}",
                                       popup=True)
        return []


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


def _extras(extras, about):
    """extras.sgd, which generic tools keep, without this extension's own property."""
    kept = {key: value for key, value in (extras or {}).items() if key != material.PROPERTY}
    return {**kept, "sgd": {key: about[key] for key in ("version", "name", "diffuse", "lobes")}}
