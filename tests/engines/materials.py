"""Lists the glTF materials that `sgdbake export` writes: what the engines draw.

    python materials.py SGDBAKE [NAME …] [--refit] > materials.json

All of the catalogue if no name is given. An entry is {"label", "material", "name"}: a file name, the material as in a
glTF file without our extension and extras, and the catalogue's name for it, which is NAME@refit with --refit.
"""
import argparse
import json
import struct
import subprocess
import sys
import tempfile
from pathlib import Path


def gltf_json(path):
    data = Path(path).read_bytes()
    length, = struct.unpack_from("<I", data, 12)
    return json.loads(data[20:20 + length])


def exported(binary, name):
    """The glTF material of a material of the catalogue."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "ball.glb"
        subprocess.run([binary, "--quiet", "export", "--shape", "ball", "--assign", f"*={name}", "-o", str(path)],
                       check=True, stdout=subprocess.DEVNULL)
        material = gltf_json(path)["materials"][0]
    material.pop("extras", None)
    material["extensions"] = {key: value for key, value in material.get("extensions", {}).items() if key.startswith("KHR_")}
    return {**material, "name": name}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("binary")
    parser.add_argument("names", nargs="*")
    parser.add_argument("--refit", action="store_true")
    options = parser.parse_args()
    listed = subprocess.run([options.binary, "materials", "--json"], check=True, text=True, stdout=subprocess.PIPE).stdout
    names = options.names or [name for name in json.loads(listed)["materials"] if "@" not in name]
    names = [name + "@refit" * options.refit for name in names]
    json.dump([{"label": name.replace("@", "-"), "material": exported(options.binary, name), "name": name} for name in names],
              sys.stdout, indent=1)


if __name__ == "__main__":
    main()
