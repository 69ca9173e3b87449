# SPDX-License-Identifier: GPL-3.0-or-later
"""SGD materials from sgdbake in Blender: import, three ways to render, glTF in and out."""

from . import assets, browser, fallback, material, operators, panel, preferences, rendering, watch
# Blender's glTF importer and exporter look these up by name in the add-on's module.
from .gltf import (  # noqa: F401
    glTF2_post_export_callback,
    glTF2_pre_export_callback,
    glTF2ExportUserExtension,
    glTF2ImportUserExtension,
)

MODULES = (preferences, material, fallback, rendering, browser, assets, operators, panel, watch)


def register():
    for module in MODULES:
        module.register()


def unregister():
    for module in reversed(MODULES):
        module.unregister()
