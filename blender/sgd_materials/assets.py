# SPDX-License-Identifier: GPL-3.0-or-later
"""The catalogue as an asset library: a .blend of materials marked as assets, with catalogs, tags and pictures."""

import uuid
from pathlib import Path

import bpy

from . import catalogue, importing, material
from .manifest import FormatError

LIBRARY = "SGD Measured Materials"
BLEND, CATALOGS = "sgd_materials.blend", "blender_assets.cats.txt"
NAMESPACE = uuid.UUID("6f6dd0f1-7ee4-5f11-9a4b-7c1c2b1b6c5e")


def write(folder, sources, pictures=catalogue.picture, mode="LOBES"):
    """Writes the library of those materials. The open file has the materials after it too."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    before = set(bpy.data.materials)
    made = importing.create_all(sources, mode)
    for each in made:
        _mark(each, pictures(material.description(each)["name"]))
    part = folder / f"{BLEND}.part"
    try:
        bpy.data.libraries.write(str(part), set(made), fake_user=True, compress=True)
    finally:
        for each in set(made) & before:  # the artist's own: they are not assets of this file
            each.asset_clear()
    part.replace(folder / BLEND)
    (folder / CATALOGS).write_text(_catalogs(), encoding="utf-8")
    return made


def _mark(made, picture):
    name = material.description(made)["name"]
    made.asset_mark()
    data = made.asset_data
    data.catalog_id = str(catalog_id(catalogue.kind(name)))
    data.author, data.license = catalogue.AUTHOR, catalogue.LICENCE
    data.description = f"{catalogue.title(name)}: measured (MERL), as a shifted gamma microfacet material"
    for tag in ("measured", "sgd", catalogue.kind(name).lower(), *name.split(catalogue.EDITION)[0].split("-")):
        data.tags.new(tag, skip_if_exists=True)
    if picture.is_file():
        _preview(made, picture)


def _preview(made, picture):
    image = bpy.data.images.load(str(picture))
    try:
        preview = made.preview_ensure()
        preview.image_size = image.size
        preview.image_pixels_float[:] = image.pixels[:]
    finally:
        bpy.data.images.remove(image)


def catalog_id(kind):
    """The UUID of a kind's catalog, the same in every library."""
    return uuid.uuid5(NAMESPACE, kind)


def _catalogs():
    lines = ["VERSION 1"] + [f"{catalog_id(kind)}:Measured/{kind}:Measured-{kind}"
                             for kind in (*catalogue.KINDS, catalogue.OTHER)]
    return "\n".join(lines) + "\n"


def is_registered(preferences, folder):
    return any(Path(library.path).resolve() == Path(folder).resolve()
               for library in preferences.filepaths.asset_libraries)


class SGD_OT_asset_library(bpy.types.Operator):
    """Write the measured materials as an asset library into a folder, and register it in the preferences"""

    bl_idname = "preferences.sgd_asset_library"
    bl_label = "Create Asset Library"

    directory: bpy.props.StringProperty(name="Folder", subtype="DIR_PATH",
                                        description="The folder of the library; it is made where there is none")

    @classmethod
    def poll(cls, context):
        if not catalogue.sources():
            cls.poll_message_set("This copy of the extension is built without the catalogue")
            return False
        return True

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        folder = Path(bpy.path.abspath(self.directory))
        if (folder / BLEND).exists() and not is_registered(context.preferences, folder):
            self.report({"ERROR"}, f"{folder / BLEND} exists already: choose another folder, or remove it")
            return {"CANCELLED"}
        before = set(bpy.data.materials)
        try:
            write(folder, list(catalogue.sources().values()))
        except (FormatError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            for each in set(bpy.data.materials) - before:
                bpy.data.materials.remove(each)
        if not is_registered(context.preferences, folder):
            context.preferences.filepaths.asset_libraries.new(name=LIBRARY, directory=str(folder))
        self.report({"INFO"}, f"{len(catalogue.sources())} materials in {folder}, registered as {LIBRARY}")
        return {"FINISHED"}


def register():
    bpy.utils.register_class(SGD_OT_asset_library)


def unregister():
    bpy.utils.unregister_class(SGD_OT_asset_library)
