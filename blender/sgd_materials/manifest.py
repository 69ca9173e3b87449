# SPDX-License-Identifier: GPL-3.0-or-later
"""What sgdbake wrote, as Python values: `manifest.json` and the glTF extension.

Needs no Blender. The schema is docs/lut-format.md; whatever departs from it is a
`FormatError` whose text says where, what was found and what is accepted.
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path

MANIFEST_SCHEMA = "sgdbake/manifest/1"
EXTENSION_NAME = "SGD_materials_shifted_gamma"
EXTENSION_VERSION = 1
CHANNELS = ("r", "g", "b")
PARAMETERS = ("rho_d", "rho_s", "alpha", "p", "f0", "f1", "lambda", "c", "k")


class FormatError(Exception):
    """A file that is not what sgdbake writes."""


@dataclass(frozen=True)
class Texture:
    """One lookup texture: `entry` is its description, `file` or `data` its bytes."""

    quantity: str
    entry: dict
    file: Path | None = None
    data: bytes | None = None


@dataclass(frozen=True)
class Material:
    """One material: `description` is the glTF extension's object, without its textures."""

    description: dict
    textures: tuple[Texture, ...]
    gltf: dict | None = None

    @property
    def name(self):
        return self.description["name"]


def read_manifest(path):
    """The materials of a `manifest.json`, in its order."""
    path = Path(path)
    where = path.name
    document = _read_json(path)
    if document.get("schema") != MANIFEST_SCHEMA:
        raise FormatError(f"{where}: schema is {document.get('schema')!r}; "
                          f"this extension reads {MANIFEST_SCHEMA!r}")
    textures = [_texture(entry, path.parent, f"{where}: textures[{i}]")
                for i, entry in enumerate(_list(document, "textures", where))]
    return [_manifest_material(entry, textures, f"{where}: materials[{i}]")
            for i, entry in enumerate(_list(document, "materials", where))]


def read_extension(extension, buffer_view, folder):
    """The material of a glTF extension object.

    `buffer_view(index)` gives the bytes of one bufferView, `folder` is where a
    relative uri starts (None where there are no files).
    """
    version = extension.get("version")
    if version != EXTENSION_VERSION:
        raise FormatError(f"{EXTENSION_NAME}: version is {version!r}; "
                          f"this extension reads version {EXTENSION_VERSION}")
    textures = tuple(_embedded_texture(entry, buffer_view, folder, f"{EXTENSION_NAME}: textures[{i}]")
                     for i, entry in enumerate(_list(extension, "textures", EXTENSION_NAME)))
    return Material(description(extension, EXTENSION_NAME), textures)


def description(entry, where):
    """The part of a material's entry that manifest and glTF extension share, checked."""
    channels = _get(entry, "channels", dict, where)
    for channel in CHANNELS:
        _check_channel(_get(channels, channel, dict, f"{where}: channels"), f"{where}: channels.{channel}")
    lobes = _get(entry, "lobes", dict, where)
    alphas, weights = _list(lobes, "alpha", where), _list(lobes, "weights", where)
    if len(alphas) != len(weights) or any(len(weight) != 3 for weight in weights):
        raise FormatError(f"{where}: lobes has {len(alphas)} alpha and {len(weights)} weights; "
                          "each alpha needs one [r, g, b] weight")
    return {
        "version": EXTENSION_VERSION,
        "name": _get(entry, "name", str, where),
        "channels": channels,
        "ndf_peak": _list(entry, "ndf_peak", where),
        "lobes": lobes,
        "row": _get(entry, "row", (int, type(None)), where),
    }


def _manifest_material(entry, textures, where):
    shared = description(entry, where)
    for texture in textures:
        if shared["row"] is not None and shared["row"] >= texture.entry["size"][1]:
            raise FormatError(f"{where}: row is {shared['row']}; {texture.quantity} has {texture.entry['size'][1]} rows")
    return Material(shared, tuple(textures), _get(entry, "gltf", dict, where))


def _texture(entry, folder, where):
    file = folder / _get(entry, "file", str, where)
    if not file.is_file():
        raise FormatError(f"{where}: texture {file} is missing; keep the textures beside the manifest, "
                          "or bake again")
    return Texture(_check_texture(entry, where), _without(entry, "file"), file=file)


def _embedded_texture(entry, buffer_view, folder, where):
    quantity = _check_texture(entry, where)
    plain = _without(entry, "uri", "bufferView", "mimeType")
    if "bufferView" in entry:
        return Texture(quantity, plain, data=buffer_view(entry["bufferView"]))
    file = Path(folder or ".") / _get(entry, "uri", str, where)
    if not file.is_file():
        raise FormatError(f"{where}: texture {file} is missing; keep the textures beside the glTF file")
    return Texture(quantity, plain, file=file)


def _check_texture(entry, where):
    size = _list(entry, "size", where)
    if len(size) < 2 or not all(isinstance(n, int) and n > 0 for n in size):
        raise FormatError(f"{where}: size is {size!r}; expected positive whole numbers")
    _list(entry, "axes", where)
    _get(entry, "encoding", dict, where)
    return _get(entry, "quantity", str, where)


def _check_channel(channel, where):
    for key in PARAMETERS:
        value = _get(channel, key, (int, float), where)
        if not math.isfinite(value):
            raise FormatError(f"{where}: {key} is {value!r}; expected a finite number")


def _read_json(path):
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FormatError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise FormatError(f"{path}: not JSON: {error}") from error
    if not isinstance(document, dict):
        raise FormatError(f"{path.name}: expected an object with a schema, found {type(document).__name__}")
    return document


def _get(entry, key, kind, where):
    value = entry.get(key) if isinstance(entry, dict) else None
    if not isinstance(value, kind) or isinstance(value, bool):
        expected = " or ".join(each.__name__ for each in (kind if isinstance(kind, tuple) else (kind,)))
        raise FormatError(f"{where}: {key} is {value!r}; expected {expected}")
    return value


def _list(entry, key, where):
    return _get(entry, key, list, where)


def _without(entry, *keys):
    return {key: value for key, value in entry.items() if key not in keys}
