# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels in the material properties: the measured material and its mode, and the catalogue."""

import bpy

from . import browser, catalogue, interface, lobes, material, rendering, sun


class SGD_PT_material(bpy.types.Panel):
    """The measured material, its mode and what the mode cannot show"""

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
        shown = context.object.active_material
        if not material.is_sgd(shown):
            layout.operator(browser.SGD_OT_add.bl_idname, icon="ADD")
            layout.operator("import_scene.sgd_manifest", icon="IMPORT")
            return
        name = material.description(shown)["name"]
        layout.label(text=f"Measured: {catalogue.title(name)}", icon_value=browser.icon(name))
        state = getattr(shown, material.PROPERTY)
        column = layout.column()
        column.enabled = shown.library is None
        column.prop(state, "mode")
        if state.mode == "SUN":
            column.prop(state, "sun")
        if not material.nodes(shown):
            column.operator("material.sgd_restore", icon="LOOP_BACK")
        if state.mode == "LOBES" and rendering.osl_problem(context.scene):
            column.operator(rendering.SGD_OT_osl.bl_idname, icon="SCRIPT")
        for line in notes(context.scene, shown):
            layout.label(text=line, icon="INFO")


class SGD_PT_catalogue(bpy.types.Panel):
    """Measured materials to choose from"""

    bl_label = "Measured Materials"
    bl_idname = "SGD_PT_catalogue"
    bl_parent_id = "SGD_PT_material"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return bool(catalogue.sources())

    def draw(self, context):
        chooser, layout = context.window_manager.sgd_browser, self.layout
        if len(chooser.entries) != len(catalogue.sources()):
            # Properties cannot be written while a panel is drawn.
            bpy.app.timers.register(lambda: chooser.fill(), first_interval=0.0)
            return
        layout.prop(chooser, "kind")
        layout.template_list(browser.SGD_UL_catalogue.bl_idname, "", chooser, "entries", chooser, "active", rows=8)
        row = layout.row()
        row.template_icon(icon_value=browser.icon(chooser.chosen), scale=5.0)
        row.operator_context = "EXEC_DEFAULT"
        row.operator(browser.SGD_OT_add.bl_idname, icon="ADD").material = chooser.chosen


def notes(scene, shown):
    """What the chosen mode needs or loses, a line each."""
    state = getattr(shown, material.PROPERTY)
    about, groups = material.description(shown), material.nodes(shown)
    lines = [state.problem] if state.problem else _of_mode(scene, state, about)
    if not groups:
        lines.append("The measured material's node was deleted: Restore puts it back")
    for name in dict.fromkeys(name for node in groups for name in interface.changed(node)):
        lines.append(f"{name} is not as measured")
    for quantity in material.missing_textures(shown):
        lines.append(f"The {quantity} texture's file is missing: an export leaves the textures out")
    if "error" in about and "delta_e" in about["error"]:
        source = about["error"].get("source")
        lines.append(f"Differs from the measurement by {about['error']['delta_e']:.2g} ΔE"
                     + (f" ({source})" if source else ""))
    if shown.library is not None:
        lines.append("Linked from another file: make it local to change its mode")
    return lines


def _of_mode(scene, state, about):
    mode, lines = state.mode, []
    if mode in {"LOBES", "PLAIN"}:
        lines += lobes.losses(about)
    if mode == "LOBES":
        lines += [f"Not shown as lobes: {problem}" for problem in [rendering.osl_problem(scene)] if problem]
        if scene.render.engine != "CYCLES":
            lines.append("Eevee shows the glTF fit; the lobes need Cycles with Open Shading Language")
    if mode == "PLAIN":
        lines.append("Fresnel at the shading normal instead of each microfacet; Eevee shows GGX lobes")
    if mode == "SUN":
        light = sun.followed(state)
        lines.append(f"Lit by {light.name} alone, without shadows" if light else "No sun in the scene: lit from above")
        if others := sun.ignored(scene, light):
            lines.append(f"Ignored: {', '.join(others)}")
    return lines


CLASSES = (SGD_PT_material, SGD_PT_catalogue)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
