# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the material properties: which material, which mode, what it loses."""

import bpy

from . import lobes, material


class SGD_PT_material(bpy.types.Panel):
    """Choice of mode and what the mode cannot show"""

    bl_label = "SGD Material"
    bl_idname = "SGD_PT_material"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"

    @classmethod
    def poll(cls, context):
        return context.object is not None and hasattr(context.object.data, "materials")

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.template_ID(context.object, "active_material")
        layout.operator("import_scene.sgd_manifest", icon="IMPORT")
        shown = context.object.active_material
        if not material.is_sgd(shown):
            return
        state = getattr(shown, material.PROPERTY)
        layout.prop(state, "mode")
        if state.mode == "SUN":
            layout.prop(state, "sun")
        for line in notes(context.scene, shown):
            layout.label(text=line, icon="INFO")


def notes(scene, shown):
    """What the chosen mode needs or loses, a line each."""
    state = getattr(shown, material.PROPERTY)
    if state.problem:
        return [state.problem]
    mode, lines = state.mode, []
    if mode in {"LOBES", "PLAIN"}:
        lines += lobes.losses(material.description(shown))
    if mode == "LOBES" and not (scene.render.engine == "CYCLES" and scene.cycles.shading_system):
        lines.append("Needs Cycles with Open Shading Language (Render properties)")
    if mode == "PLAIN":
        lines.append("Fresnel at the shading normal instead of each microfacet; Eevee shows GGX lobes")
    if mode == "SUN":
        lines.append("Lit by this sun alone, without shadows")
    return lines


def register():
    bpy.utils.register_class(SGD_PT_material)


def unregister():
    bpy.utils.unregister_class(SGD_PT_material)
