# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the extension's zip: validated, with every material that sgdbake offers and a picture of each.

    python blender/package.py -o target          the zip, target/sgd_materials-VERSION.zip
    python blender/package.py --into FOLDER      the extension's folder alone, unpacked
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "blender/sgd_materials"
PROGRAM = ROOT / "target/release/sgdbake"
PICTURE_SIZE = 128


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "target", help="the zip's folder; default: target")
    parser.add_argument("--into", type=Path, help="write the extension's folder here, and no zip")
    parser.add_argument("--sgdbake", type=Path, default=os.environ.get("SGDBAKE_BIN", PROGRAM),
                        help="the program that bakes the catalogue; default: SGDBAKE_BIN or target/release/sgdbake")
    parser.add_argument("--size", type=int, default=PICTURE_SIZE, help="pixels on a side of a material's picture")
    parser.add_argument("--material", nargs="+", help="these materials only; default: all")
    args = parser.parse_args(argv)
    if not Path(args.sgdbake).is_file():
        parser.error(f"{args.sgdbake}: no such program; build it with `cargo build --release`, or name another")
    with tempfile.TemporaryDirectory() as folder:
        staged = args.into or Path(folder) / SOURCE.name
        stage(staged, Sgdbake(Path(args.sgdbake)), args.material, args.size)
        if args.into is None:
            args.output.mkdir(parents=True, exist_ok=True)
            packer("build", "--source-dir", staged, "--output-dir", args.output)


class Sgdbake:
    """The sgdbake program."""

    def __init__(self, program):
        self.program = program

    def names(self):
        """Both editions, first the one nearer the surfaces."""
        published = json.loads(self.run("materials", "--json"))["materials"]
        return [f"{name}@refit" for name in published] + published

    def bake(self, names, folder):
        self.run("bake", *(part for name in names for part in ("--material", name)), "-o", folder)

    def picture(self, name, size, path):
        self.run("preview", "--material", name, "--size", str(size), "-o", path)

    def run(self, *arguments):
        return subprocess.run([self.program, "--quiet", *arguments], check=True, text=True,
                              stdout=subprocess.PIPE).stdout


def stage(folder, sgdbake, names=None, size=PICTURE_SIZE):
    """A copy of the extension with its catalogue."""
    shutil.copytree(SOURCE, folder, ignore=shutil.ignore_patterns("__pycache__", "catalogue"))
    catalogue(folder / "catalogue", sgdbake, names, size)


def catalogue(folder, sgdbake, names=None, size=PICTURE_SIZE):
    """Bakes materials, all by default, and makes a picture of each."""
    names = names or sgdbake.names()
    sgdbake.bake(names, folder)
    for decoder in folder.glob("sgd_lut.*"):  # for engines: Blender decodes in nodes
        decoder.unlink()
    print(f"pictures of {len(names)} materials", file=sys.stderr)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(lambda name: sgdbake.picture(name, size, folder / f"{name}.png"), names))


def packer(*arguments):
    """Runs Blender's own extension tool."""
    tool = Path(bpy.utils.resource_path("LOCAL")) / "scripts/addons_core/bl_pkg/cli/blender_ext.py"
    subprocess.run([sys.executable, tool, *arguments], check=True)


if __name__ == "__main__":
    main(sys.argv[1:])
