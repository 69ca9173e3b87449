# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the measured materials as an asset library for Blender.

    python blender/assets.py -o ~/Blender/Measured
    python blender/assets.py -o DIR --material gold-paint chrome

In Blender: Preferences > File Paths > Asset Libraries > Add, and choose the folder. The extension's
preferences have a button that does both.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy  # noqa: E402, F401  first: the modules below come with it

import package  # noqa: E402
import stage  # noqa: E402


def main(argv):
    parser = argparse.ArgumentParser(prog="assets.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True, help="the library's folder")
    parser.add_argument("--sgdbake", type=Path, default=os.environ.get("SGDBAKE_BIN", package.PROGRAM),
                        help="the program that bakes the catalogue; default: SGDBAKE_BIN or target/release/sgdbake")
    parser.add_argument("--material", nargs="+", help="these materials only; default: all")
    parser.add_argument("--force", action="store_true", help="replace a library that is there")
    args = parser.parse_args(argv)
    if not Path(args.sgdbake).is_file():
        parser.error(f"{args.sgdbake}: no such program; build it with `cargo build --release`, or name another")
    stage.clear()
    from sgd_materials import assets, manifest

    if (args.output / assets.BLEND).exists() and not args.force:
        parser.error(f"{args.output / assets.BLEND} exists; --force replaces it")
    with tempfile.TemporaryDirectory() as folder:
        baked = Path(folder) / "catalogue"
        package.catalogue(baked, package.Sgdbake(args.sgdbake), args.material)
        made = assets.write(args.output, manifest.read_manifest(baked / "manifest.json"),
                            lambda name: baked / f"{name}.png")
    print(f"{len(made)} materials in {args.output / assets.BLEND}")


if __name__ == "__main__":
    stage.run(main, sys.argv[1:])
