# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders every material of a manifest on the ball in the studio: lobes next to the glTF fit.

    python blender/gallery.py target/gallery/manifest.json -o docs/gallery.png
"""

import argparse
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy  # noqa: E402, F401  first: the modules below come with it
import numpy as np  # noqa: E402

import stage  # noqa: E402

COLUMNS = 3
MODES = ("LOBES", "FIT")


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("manifest", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--size", type=int, default=128, help="pixels on a side of one ball")
    parser.add_argument("--samples", type=int, default=48)
    args = parser.parse_args(argv)

    stage.clear()
    from sgd_materials import importing

    ball = stage.ball()
    stage.environment()
    stage.camera([ball])
    bpy.context.scene.render.use_persistent_data = True
    pairs = [_pair(ball, material, args) for material in importing.import_file(args.manifest, "", "FIT")]
    stage.write_png(args.output, _grid(pairs))


def _pair(ball, shown, args):
    """One material in the modes, side by side."""
    from sgd_materials import material

    ball.data.materials.clear()
    ball.data.materials.append(shown)
    return np.concatenate([_render(shown, mode, args, material) for mode in MODES], axis=1)


def _render(shown, mode, args, material):
    material.set_mode(shown, mode)
    print(f"{shown.name}: {mode}", file=sys.stderr)
    with tempfile.TemporaryDirectory() as folder:
        return stage.over_backdrop(stage.render(Path(folder) / "ball.exr", args.size, args.size, args.samples))


def _grid(pairs):
    blank = np.full_like(pairs[0], stage.BACKDROP)
    pairs = pairs + [blank] * (-len(pairs) % COLUMNS)
    rows = [np.concatenate(pairs[i:i + COLUMNS], axis=1) for i in range(0, len(pairs), COLUMNS)]
    return np.concatenate(rows)


if __name__ == "__main__":
    stage.run(main, sys.argv[1:])
