# SPDX-License-Identifier: GPL-3.0-or-later
"""The catalogue in Blender: a list with pictures to search, and the operator that puts a material on objects."""

import bpy
import bpy.utils.previews

from . import catalogue, importing, material, rendering
from .manifest import FormatError

ALL = "ALL"
_pictures = None


def icon(name):
    """The picture of a material as an icon."""
    path = catalogue.picture(name)
    if name not in _pictures and path.is_file():
        _pictures.load(name, str(path), "IMAGE")
    return _pictures[name].icon_id if name in _pictures else 0


# Blender keeps no reference to the strings of a callback's items.
_items = []


def items(self=None, context=None):
    """Every material of the catalogue as an item of an enumeration."""
    if len(_items) != len(catalogue.sources()):
        _items[:] = [(name, catalogue.title(name), f"{catalogue.kind(name)}, measured", icon(name), i)
                     for i, name in enumerate(catalogue.sources())]
    return _items


KINDS = [(ALL, "All", "Every kind")] + [(kind, kind, f"{kind} only") for kind in (*catalogue.KINDS, catalogue.OTHER)]


class SGDEntry(bpy.types.PropertyGroup):
    """A line of the list; `name` is the material's."""


class SGDBrowser(bpy.types.PropertyGroup):
    """The list of measured materials, and what is chosen in it."""

    entries: bpy.props.CollectionProperty(type=SGDEntry)
    active: bpy.props.IntProperty(name="Measured Material", description="The measured material to add")
    kind: bpy.props.EnumProperty(name="Kind", items=KINDS, description="Show one kind of measured material")

    def fill(self):
        """Has a line for every material of the catalogue."""
        if [entry.name for entry in self.entries] != list(catalogue.sources()):
            self.entries.clear()
            for name in catalogue.sources():
                self.entries.add().name = name

    @property
    def chosen(self):
        return self.entries[self.active].name if self.active < len(self.entries) else ""


class SGD_UL_catalogue(bpy.types.UIList):
    """Measured materials with their pictures"""

    bl_idname = "SGD_UL_catalogue"

    def draw_item(self, context, layout, data, item, icon_value, active_data, active_property):
        layout.label(text=catalogue.title(item.name), icon_value=icon(item.name))

    def filter_items(self, context, data, property):
        """Lines whose title has the words searched for, of the chosen kind."""
        wanted = self.filter_name.casefold().split()
        shown = [self.bitflag_filter_item if _matches(entry.name, data.kind, wanted) else 0
                 for entry in getattr(data, property)]
        order = bpy.types.UI_UL_list.sort_items_by_name(getattr(data, property)) if self.use_filter_sort_alpha else []
        return shown, order


def _matches(name, kind, words):
    text = f"{catalogue.title(name)} {name} {catalogue.kind(name)}".casefold()
    return kind in (ALL, catalogue.kind(name)) and all(word in text for word in words)


class SGD_OT_add(bpy.types.Operator):
    """Put a measured material on all selected objects, or in the file where none is selected"""

    bl_idname = "material.sgd_add"
    bl_label = "Add Measured Material"
    bl_options = {"REGISTER", "UNDO"}
    bl_property = "material"

    material: bpy.props.EnumProperty(name="Material", items=items, description="A material of the catalogue")
    mode: bpy.props.EnumProperty(name="Mode", items=material.MODES, default="LOBES",
                                 description="How the material is shown")
    use_osl: bpy.props.BoolProperty(name="Turn On OSL", default=True,
                                    description="Turn on Open Shading Language in Cycles, which Lobes (OSL) needs")

    @classmethod
    def poll(cls, context):
        if not catalogue.sources():
            cls.poll_message_set("This copy of the extension is built without the catalogue")
            return False
        return True

    def invoke(self, context, event):
        context.window_manager.invoke_search_popup(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        try:
            made = material.create(catalogue.sources()[self.material], self.mode)
        except FormatError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finish_import(self, context, [made], selected(context))
        return {"FINISHED"}


def selected(context):
    """The selected objects, or else the active one."""
    return list(context.selected_objects) or [thing for thing in [context.object] if thing is not None]


def finish_import(operator, context, made, objects):
    """Assigns the first material to objects, turns OSL on where it is wanted, and says so."""
    worn, replaced, refused = importing.assign(made[0], objects)
    said = [f"Added {', '.join(each.name for each in made)}"]
    if worn:
        said.append(f"{made[0].name} is on {', '.join(thing.name for thing in worn)}")
    if replaced:
        said.append(f"replaced {', '.join(each.name for each in replaced)}, kept in the file")
    if operator.mode == "LOBES" and operator.use_osl and rendering.turn_on_osl(context.scene):
        said.append("Open Shading Language is on")
    operator.report({"INFO"}, "; ".join(said))
    if refused:
        operator.report({"WARNING"}, f"Linked from another file, not changed: {', '.join(o.name for o in refused)}")


def menu(self, context):
    self.layout.separator()
    self.layout.operator_context = "INVOKE_DEFAULT"
    self.layout.operator(SGD_OT_add.bl_idname, icon="MATERIAL")


CLASSES = (SGDEntry, SGDBrowser, SGD_UL_catalogue, SGD_OT_add)
MENUS = ("MATERIAL_MT_context_menu", "VIEW3D_MT_object")


def register():
    global _pictures
    _pictures = bpy.utils.previews.new()
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.WindowManager.sgd_browser = bpy.props.PointerProperty(type=SGDBrowser)
    for name in MENUS:
        getattr(bpy.types, name).append(menu)


def unregister():
    for name in MENUS:
        getattr(bpy.types, name).remove(menu)
    del bpy.types.WindowManager.sgd_browser
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
    bpy.utils.previews.remove(_pictures)
    _items.clear()
