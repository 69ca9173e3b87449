# SPDX-License-Identifier: GPL-3.0-or-later
"""Import of a manifest.json through the file browser."""

from pathlib import Path

import bpy
from bpy_extras.io_utils import ImportHelper

from . import material
from .manifest import FormatError, read_manifest


class SGD_OT_import(bpy.types.Operator, ImportHelper):
    """Make materials from the manifest.json that sgdbake wrote beside its textures"""

    bl_idname = "import_scene.sgd_manifest"
    bl_label = "Import SGD Materials"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".json"
    filter_glob: bpy.props.StringProperty(default="*.json", options={"HIDDEN"})
    material: bpy.props.StringProperty(name="Material", description="One material's name; empty for all of them")
    mode: bpy.props.EnumProperty(name="Mode", items=material.MODES, default="LOBES")
    assign: bpy.props.BoolProperty(name="Assign to Active Object", default=True,
                                   description="Put the first imported material on the active object")

    def execute(self, context):
        try:
            made = import_manifest(self.filepath, self.material, self.mode)
        except FormatError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if self.assign and context.object is not None and hasattr(context.object.data, "materials"):
            context.object.active_material = made[0]
        self.report({"INFO"}, f"Imported {', '.join(each.name for each in made)}")
        return {"FINISHED"}


def import_manifest(path, name="", mode="LOBES"):
    """Blender materials of a manifest: the one of that name, or all."""
    sources = read_manifest(path)
    chosen = [source for source in sources if name in ("", source.name)]
    if not chosen:
        known = ", ".join(source.name for source in sources) or "none"
        raise FormatError(f"{Path(path).name}: no material {name!r}; it has {known}")
    made = []
    try:
        for source in chosen:
            made.append(material.create(source, mode))
    except FormatError:
        for each in made:
            bpy.data.materials.remove(each)
        raise
    return made


def menu(self, context):
    self.layout.operator(SGD_OT_import.bl_idname, text="SGD Materials (manifest.json)")


def register():
    bpy.utils.register_class(SGD_OT_import)
    bpy.types.TOPBAR_MT_file_import.append(menu)


def unregister():
    bpy.types.TOPBAR_MT_file_import.remove(menu)
    bpy.utils.unregister_class(SGD_OT_import)
