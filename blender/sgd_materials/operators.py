# SPDX-License-Identifier: GPL-3.0-or-later
"""Import through the file browser or by dropping a file, and putting back a node that was deleted."""

import bpy
from bpy_extras.io_utils import ImportHelper

from . import browser, importing, material
from .manifest import FormatError
from .preferences import sgdbake


class SGD_OT_import(bpy.types.Operator, ImportHelper):
    """Make materials from a manifest.json that sgdbake wrote with its textures, or from a material file"""

    bl_idname = "import_scene.sgd_manifest"
    bl_label = "Import SGD Materials"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".json"
    filter_glob: bpy.props.StringProperty(default="*.json;*.toml", options={"HIDDEN"})
    material: bpy.props.StringProperty(name="Material", description="One material's name; empty for all of them")
    mode: bpy.props.EnumProperty(name="Mode", items=material.MODES, default="LOBES",
                                 description="How the materials are shown")
    assign: bpy.props.BoolProperty(
        name="Assign to Selected Objects", default=True,
        description="Put the material on the selected objects, where the file has one or one is named")
    use_osl: bpy.props.BoolProperty(name="Turn On OSL", default=True,
                                    description="Turn on Open Shading Language in Cycles, which Lobes (OSL) needs")

    def execute(self, context):
        try:
            made = importing.import_file(self.filepath, self.material, self.mode, sgdbake(context))
        except FormatError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        browser.finish_import(self, context, made, browser.selected(context) if self.assign and len(made) == 1 else [])
        return {"FINISHED"}

    def invoke(self, context, event):
        if self.filepath:  # dropped in
            return self.execute(context)
        return super().invoke(context, event)


class SGD_FH_import(bpy.types.FileHandler):
    """Manifests and material files that are dropped into Blender"""

    bl_idname = "SGD_FH_import"
    bl_label = "SGD Materials"
    bl_import_operator = SGD_OT_import.bl_idname
    bl_file_extensions = ".json;.toml"

    @classmethod
    def poll_drop(cls, context):
        return context.area is not None and context.area.type in {"VIEW_3D", "PROPERTIES", "NODE_EDITOR"}


class SGD_OT_restore(bpy.types.Operator):
    """Put the measured material back into the nodes, linked to the outputs that show nothing"""

    bl_idname = "material.sgd_restore"
    bl_label = "Restore Measured Material"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return material.is_sgd(context.material if hasattr(context, "material") else context.object.active_material)

    def execute(self, context):
        material.show(context.object.active_material)
        return {"FINISHED"}


def menu(self, context):
    self.layout.operator(SGD_OT_import.bl_idname, text="SGD Materials (.json, .toml)")


CLASSES = (SGD_OT_import, SGD_FH_import, SGD_OT_restore)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.TOPBAR_MT_file_import.append(menu)


def unregister():
    bpy.types.TOPBAR_MT_file_import.remove(menu)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
