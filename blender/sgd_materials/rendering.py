# SPDX-License-Identifier: GPL-3.0-or-later
"""What the render settings must be for a mode, and the button that sets them."""

import bpy


def osl_problem(scene):
    """Why Cycles would not run the OSL lobes of this scene; empty where it would."""
    if not bpy.app.build_options.cycles_osl:
        return "this Blender is built without Open Shading Language"
    if scene.render.engine != "CYCLES":
        return ""
    if not scene.cycles.shading_system:
        return "Open Shading Language is off"
    if scene.cycles.device == "GPU" and _compute_device() not in {"NONE", "OPTIX"}:
        return f"Open Shading Language runs on the CPU and on OptiX, not on {_compute_device()}"
    return ""


def _compute_device():
    """The kind of GPU that Cycles is set to in the preferences."""
    addon = bpy.context.preferences.addons.get("cycles")
    return addon.preferences.compute_device_type if addon else "NONE"


def turn_on_osl(scene):
    """Turns Open Shading Language on. Returns whether it was off."""
    if not bpy.app.build_options.cycles_osl or scene.cycles.shading_system:
        return False
    scene.cycles.shading_system = True
    return True


class SGD_OT_osl(bpy.types.Operator):
    """Turn on Open Shading Language in Cycles, which Lobes (OSL) needs"""

    bl_idname = "scene.sgd_osl"
    bl_label = "Turn On Open Shading Language"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        turn_on_osl(context.scene)
        if problem := osl_problem(context.scene):
            self.report({"WARNING"}, problem)
        return {"FINISHED"}


def register():
    bpy.utils.register_class(SGD_OT_osl)


def unregister():
    bpy.utils.unregister_class(SGD_OT_osl)
