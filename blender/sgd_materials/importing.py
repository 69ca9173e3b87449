# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials from files: a manifest, or a material file that sgdbake bakes first."""

import shutil
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path

import bpy

from . import material
from .manifest import FormatError, read_manifest

MATERIAL_FILE = ".toml"
SCENES = (".glb", ".gltf")


def read(path, sgdbake=""):
    """The materials that a file describes."""
    path = Path(path)
    if path.suffix.lower() in SCENES:
        raise FormatError(f"{path.name} is a glTF scene: open it by File > Import > glTF 2.0, which builds its "
                          "measured materials while this extension is enabled")
    if path.suffix.lower() == MATERIAL_FILE:
        return _bake(path, sgdbake)
    return read_manifest(path)


def import_file(path, name="", mode="LOBES", sgdbake=""):
    """Blender materials of a file: the one of that name, or all."""
    sources = read(path, sgdbake)
    chosen = [source for source in sources if name in ("", source.name)]
    if not chosen:
        known = ", ".join(source.name for source in sources) or "none"
        raise FormatError(f"{Path(path).name}: no material {name!r}; it has {known}")
    return create_all(chosen, mode)


def create_all(sources, mode):
    """Every source as a Blender material, or none and FormatError."""
    before, made = set(bpy.data.materials), []
    try:
        for source in sources:
            made.append(material.create(source, mode))
    except FormatError:
        for each in set(made) - before:
            bpy.data.materials.remove(each)
        raise
    return made


def assign(chosen, objects):
    """Puts a material in the active slot of objects. Returns (worn by, materials replaced, objects that cannot)."""
    worn, replaced, refused = [], [], []
    for thing in objects:
        if not hasattr(thing.data, "materials"):
            continue
        if thing.library is not None or thing.data.library is not None:
            refused.append(thing)
            continue
        before = thing.active_material
        if before is not None and before != chosen:
            before.use_fake_user = True  # stays in the file though nothing wears it
            replaced.append(before)
        thing.active_material = chosen
        worn.append(thing)
    return worn, list(dict.fromkeys(replaced)), refused


def _bake(path, sgdbake):
    """The materials of a material file, baked by the sgdbake program."""
    program = sgdbake or shutil.which("sgdbake")
    if not program or not Path(program).is_file():
        raise FormatError(f"{path.name} is a material file, which sgdbake bakes: name the program in Preferences > "
                          f"Add-ons > SGD Materials, or run `sgdbake bake --material {path.name} -o lut` and import "
                          "lut/manifest.json")
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "--quiet", "bake", "--material", str(path), "-o", folder]
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace")
        if done.returncode != 0:
            raise FormatError(f"{path.name}: sgdbake refused it: {done.stderr.strip()}")
        return [_in_memory(source) for source in read_manifest(Path(folder) / "manifest.json")]


def _in_memory(source):
    textures = tuple(replace(texture, file=None, data=texture.file.read_bytes()) for texture in source.textures)
    return replace(source, textures=textures)
