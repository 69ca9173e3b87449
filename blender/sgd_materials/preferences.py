# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's preferences: where the sgdbake program is, and the asset library."""

import bpy


class SGDPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    sgdbake: bpy.props.StringProperty(
        name="sgdbake", subtype="FILE_PATH",
        description="The sgdbake program, which bakes material files; empty to look for it on the system's path")

    def draw(self, context):
        self.layout.prop(self, "sgdbake")
        self.layout.operator("preferences.sgd_asset_library", icon="ASSET_MANAGER")


def sgdbake(context):
    """The program that the preferences name, or nothing."""
    addon = context.preferences.addons.get(__package__)
    return addon.preferences.sgdbake if addon and addon.preferences else ""


def register():
    bpy.utils.register_class(SGDPreferences)


def unregister():
    bpy.utils.unregister_class(SGDPreferences)
