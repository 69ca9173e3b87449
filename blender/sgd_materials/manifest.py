# SPDX-License-Identifier: GPL-3.0-or-later
"""What sgdbake wrote, as Python values: `manifest.json` and the glTF extension.

Needs no Blender. The schema is docs/lut-format.md; whatever departs from it is a
`FormatError` whose text says where, what was found and what is accepted.
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path

MANIFEST_SCHEMA = "sgdbake/manifest/2"
EXTENSION_NAME = "SGD_materials_shifted_gamma"
EXTENSION_VERSION = 2
SHAPE = ("alpha", "p")
MASKING = ("lambda", "c", "k")
COLOURS = ("rho_s", "f0", "f1")
MAX_LOBES = 3
EMPTY = {"lobes": [], "ndf_peak": [], "mixture": {"alpha": [], "weights": []}, "row": None, "fresnel_rows": []}
# Version 1 had one lobe per colour channel.
OLD_SCHEMA = "sgdbake/manifest/1"
CHANNELS = ("r", "g", "b")


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
    if document.get("schema") not in (MANIFEST_SCHEMA, OLD_SCHEMA):
        raise FormatError(f"{where}: schema is {document.get('schema')!r}; this extension reads "
                          f"{MANIFEST_SCHEMA!r}, the manifest.json of sgdbake bake")
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
    if version not in (1, EXTENSION_VERSION):
        raise FormatError(f"{EXTENSION_NAME}: version is {version!r}; this extension reads versions 1 and "
                          f"{EXTENSION_VERSION}. Update the extension, or export the scene again with this sgdbake")
    textures = tuple(_embedded_texture(entry, buffer_view, folder, f"{EXTENSION_NAME}: textures[{i}]")
                     for i, entry in enumerate(_list({"textures": [], **extension}, "textures", EXTENSION_NAME)))
    # Blender's glTF exporter leaves out what is null or empty.
    return Material(description({**EMPTY, **extension}, EXTENSION_NAME), textures)


def description(entry, where):
    """The part of a material's entry that manifest and glTF extension share, checked."""
    if "channels" in entry:
        entry = _from_version_1(entry, where)
    given = _list(entry, "lobes", where)
    if len(given) > MAX_LOBES:
        raise FormatError(f"{where}: lobes has {len(given)} entries; expected at most {MAX_LOBES}")
    for i, lobe in enumerate(given):
        _check_lobe(lobe, f"{where}: lobes[{i}]")
    shared = {
        "version": EXTENSION_VERSION,
        "name": _get(entry, "name", str, where),
        "diffuse": _numbers(entry, "diffuse", 3, where),
        "lobes": given,
        "ndf_peak": _numbers(entry, "ndf_peak", None, where),
        "mixture": _mixture(_get(entry, "mixture", dict, where), len(given), f"{where}: mixture"),
        "row": _get(entry, "row", (int, type(None)), where),
        "fresnel_rows": _list(entry, "fresnel_rows", where),
    }
    return shared | {key: entry[key] for key in ("error",) if isinstance(entry.get(key), dict)}


def _mixture(mixture, lobes, where):
    """The Beckmann mixture: one row of weights per width, one column per lobe."""
    alphas, weights = _numbers(mixture, "alpha", None, where), _list(mixture, "weights", where)
    if len(alphas) != len(weights):
        raise FormatError(f"{where}: {len(alphas)} alpha and {len(weights)} weights; expected as many")
    return {"alpha": alphas, "weights": [_numbers({"weights": row}, "weights", lobes, where) for row in weights]}


def _from_version_1(entry, where):
    """Version 2 of an entry that had three channels: one lobe for each, which colours it alone."""
    channels = [_get(_get(entry, "channels", dict, where), name, dict, f"{where}: channels") for name in CHANNELS]
    for name, channel in zip(CHANNELS, channels):
        for key in ("rho_d", *SHAPE, *MASKING, *COLOURS):
            _number(channel, key, f"{where}: channels.{name}")
    f0, f1 = ([channel[key] for channel in channels] for key in ("f0", "f1"))
    lobes = [{"alpha": channel["alpha"], "p": channel["p"], "masking": {key: channel[key] for key in MASKING},
              "rho_s": [channel["rho_s"] if i == j else 0.0 for j in range(3)], "f0": f0, "f1": f1}
             for i, channel in enumerate(channels)]
    row = entry.get("row")
    return {"name": entry.get("name"), "diffuse": [channel["rho_d"] for channel in channels], "lobes": lobes,
            "ndf_peak": entry.get("ndf_peak"), "mixture": entry.get("lobes"), "row": row,
            "fresnel_rows": [] if row is None else [row] * 3}


def rows_of(description, quantity):
    """The texture rows that a material's lobes read of a quantity."""
    if description["row"] is None:
        return []
    return description["fresnel_rows"] if quantity == "fresnel" else [description["row"]]


def _manifest_material(entry, textures, where):
    shared = description(entry, where)
    for texture in textures:
        rows, used = texture.entry["size"][1], rows_of(shared, texture.quantity)
        if max(used, default=0) >= rows:
            raise FormatError(f"{where}: row is {max(used)}; {texture.quantity} has {rows} rows")
    return Material(shared, tuple(textures), _get(entry, "gltf", dict, where))


def _texture(entry, folder, where):
    file = folder / _get(entry, "file", str, where)
    if not file.is_file():
        raise FormatError(f"{where}: texture {file} is missing; keep the textures in the manifest's folder, "
                          "or bake again")
    return Texture(_check_texture(entry, where), _without(entry, "file"), file=file)


def _embedded_texture(entry, buffer_view, folder, where):
    quantity = _check_texture(entry, where)
    plain = _without(entry, "uri", "bufferView", "mimeType")
    if "bufferView" in entry:
        return Texture(quantity, plain, data=buffer_view(entry["bufferView"]))
    file = Path(folder or ".") / _get(entry, "uri", str, where)
    if not file.is_file():
        raise FormatError(f"{where}: texture {file} is missing; keep the textures in the glTF file's folder")
    return Texture(quantity, plain, file=file)


def _check_texture(entry, where):
    size = _list(entry, "size", where)
    if len(size) < 2 or not all(isinstance(n, int) and n > 0 for n in size):
        raise FormatError(f"{where}: size is {size!r}; expected positive whole numbers")
    _list(entry, "axes", where)
    _get(entry, "encoding", dict, where)
    return _get(entry, "quantity", str, where)


def _check_lobe(lobe, where):
    for key in SHAPE:
        _number(lobe, key, where)
    for key in COLOURS:
        _numbers(lobe, key, 3, where)


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


def _number(entry, key, where):
    value = _get(entry, key, (int, float), where)
    if not math.isfinite(value):
        raise FormatError(f"{where}: {key} is {value!r}; expected a finite number")
    return value


def _numbers(entry, key, count, where):
    """A list of finite numbers, of that count where one is given."""
    values = _list(entry, key, where)
    if count is not None and len(values) != count:
        raise FormatError(f"{where}: {key} has {len(values)} numbers; expected {count}")
    return [_number({key: value}, key, where) for value in values]


def _list(entry, key, where):
    return _get(entry, key, list, where)


def _without(entry, *keys):
    return {key: value for key, value in entry.items() if key not in keys}
