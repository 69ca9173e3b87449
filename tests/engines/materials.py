"""Lists the glTF materials that `sgdbake export` writes for the catalogue: what the engines draw.

    python materials.py [NAME …] [--refit] [--check SGDBAKE] > materials.json

All of the catalogue if no name is given. An entry is {"label", "material", "name"}: a file name that
changes with the material, the material as in a glTF file without our extension and extras, and the catalogue's name for
it, which is NAME@refit with --refit. They are read from the table that the library embeds; --check exports every 33rd
and stops where the file says otherwise.
"""
import argparse
import hashlib
import json
import math
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

TABLE = Path(__file__).resolve().parents[2] / "src/asset/merl100-direct.jsonl"


def gltf_json(path):
    data = Path(path).read_bytes()
    length, = struct.unpack_from("<I", data, 12)
    return json.loads(data[20:20 + length])


def exported(binary, name):
    """The glTF material that `sgdbake export` writes for a material of the catalogue."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "ball.glb"
        subprocess.run([binary, "--quiet", "export", "--shape", "ball", "--size", "16", "--assign", f"*={name}", "-o", str(path)],
                       check=True, stdout=subprocess.DEVNULL)
        material = gltf_json(path)["materials"][0]
    material.pop("extras", None)
    material["extensions"] = {key: value for key, value in material.get("extensions", {}).items() if key.startswith("KHR_")}
    return {**material, "name": name}


def as_gltf(fit, name):
    """A fit of the table as a glTF material."""
    extensions = {}
    if fit["specular_factor"] != 1 or any(c != 1 for c in fit["specular_color"]):
        extensions["KHR_materials_specular"] = {"specularFactor": fit["specular_factor"], "specularColorFactor": fit["specular_color"]}
    if fit["clearcoat"] is not None:
        extensions["KHR_materials_clearcoat"] = {"clearcoatFactor": fit["clearcoat"], "clearcoatRoughnessFactor": fit["clearcoat_roughness"]}
    core = {"baseColorFactor": [*fit["base_color"], 1], "metallicFactor": fit["metallic"], "roughnessFactor": fit["roughness"]}
    return {"name": name, "pbrMetallicRoughness": core, "extensions": extensions}


def catalogue(refit):
    """Every catalogue material's glTF material by its name."""
    fits = {fits["name"]: fits["gltf"] for fits in map(json.loads, TABLE.read_text().splitlines())}
    if refit:
        return {f"{name}@refit": as_gltf(fit["measured"]["material"], f"{name}@refit") for name, fit in fits.items()}
    return {name: as_gltf(fit["of_published"]["material"], name) for name, fit in fits.items()}


def equal(a, b):
    """Equal but for the last digits of numbers, in which a fit depends on the system's mathematical library."""
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(equal(a[key], b[key]) for key in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(map(equal, a, b))
    return math.isclose(a, b, rel_tol=1e-9) if isinstance(a, (int, float)) else a == b


def label(name, material):
    """A file name for the material's pictures: another one as soon as a number in it changes."""
    return f"{name.replace('@', '-')}-{hashlib.sha256(json.dumps(material, sort_keys=True).encode()).hexdigest()[:8]}"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*")
    parser.add_argument("--refit", action="store_true")
    parser.add_argument("--check", metavar="SGDBAKE")
    options = parser.parse_args()
    materials = catalogue(options.refit)
    for name in list(materials)[::33] if options.check else []:
        if not equal(exported(options.check, name), materials[name]):
            sys.exit(f"materials: {options.check} exports another glTF material of {name} than {TABLE} holds: built from other sources?")
    names = [name + "@refit" * options.refit for name in options.names] or list(materials)
    if unknown := [name for name in names if name not in materials]:
        sys.exit(f"materials: not in the catalogue: {', '.join(unknown)}")
    json.dump([{"label": label(name, materials[name]), "material": materials[name], "name": name} for name in names], sys.stdout, indent=1)


if __name__ == "__main__":
    main()
