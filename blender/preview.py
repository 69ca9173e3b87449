# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders SGD materials with Cycles, headless.

    python blender/preview.py teapot.glb -o teapot.png
    python blender/preview.py lut/manifest.json --material gold-paint --mode fit lobes -o gold.png
    blender -b -P blender/preview.py -- lut/manifest.json --turntable 36 -o turn.mp4

A glTF scene is shown as it is; the materials of a manifest on a ball or on --object.
Several materials make rows, several modes columns, and each mode after the first adds
its absolute difference to the first, four times brighter.
"""

import argparse
import re
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy  # noqa: E402
import numpy as np  # noqa: E402

import stage  # noqa: E402

MODES = ("fit", "lobes", "plain", "sun")
SUN_FROM = (-0.5, -0.7, 0.6)
DIFFERENCE_GAIN = 4.0


def arguments(argv):
    parser = argparse.ArgumentParser(prog="preview.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", type=Path, help="a .glb or .gltf scene, or a manifest.json")
    parser.add_argument("-o", "--output", type=Path, required=True, help="a .png; with --turntable also .mp4")
    parser.add_argument("--material", nargs="+", default=[], help="materials to show on the ball or --object")
    parser.add_argument("--mode", nargs="+", choices=MODES, default=["lobes"], help="default: lobes")
    parser.add_argument("--object", type=Path, help="a .glb, .gltf or .blend whose meshes wear the material")
    parser.add_argument("--environment", help="a latitude-longitude .hdr or .exr, `studio` or `sun`; "
                                              "default: studio, with mode sun: sun")
    parser.add_argument("--turntable", type=int, metavar="FRAMES", help="turn the camera once around")
    parser.add_argument("--samples", type=_positive, default=64)
    parser.add_argument("--size", type=_positive, default=512, help="pixels on a side of one picture")
    args = parser.parse_args(argv)
    for path in (args.input, args.object):
        if path is not None and not path.is_file():
            parser.error(f"{path}: no such file")
    if args.environment is None:
        args.environment = "sun" if "sun" in args.mode else "studio"
    if args.environment not in {"studio", "sun"} and not Path(args.environment).is_file():
        parser.error(f"{args.environment}: no such file; name a .hdr or .exr, `studio` or `sun`")
    return args


def main(argv):
    args = arguments(argv)
    stage.clear()
    from sgd_materials import material
    from sgd_materials.manifest import FormatError

    try:
        rows = _rows(args)
        light(args.environment)
        if args.turntable:
            turntable(args, rows, material)
        else:
            stage.write_png(args.output, picture(args, rows, material, azimuth=20.0))
    except FormatError as error:
        sys.exit(f"preview.py: {error}")


def _rows(args):
    """(objects, material to put on them or None) for each row of the picture."""
    from sgd_materials import importing, material
    from sgd_materials.manifest import FormatError

    if args.input.suffix == ".json":
        made = [each for name in args.material or [""] for each in importing.import_file(args.input, name, "FIT")]
        made = made if args.material else made[:1]
        scene = []
    else:
        scene = stage.load_objects(args.input)
        found = {each.name: each for each in bpy.data.materials if material.is_sgd(each)}
        unknown = [name for name in args.material if name not in found]
        if unknown:
            raise FormatError(f"{args.input}: no SGD material {unknown[0]!r}; it has {', '.join(found) or 'none'}")
        if not args.material:
            return [(scene, None)]
        made = [found[name] for name in args.material]
    for thing in scene:
        bpy.data.objects.remove(thing)
    shown = stage.load_objects(args.object) if args.object else [stage.ball()]
    return [(shown, each) for each in made]


def light(environment):
    """Lights the scene by a file, the built-in studio or a sun."""
    if environment == "sun":
        stage.sun(SUN_FROM)
    else:
        stage.environment(None if environment == "studio" else environment)


def picture(args, rows, material, azimuth):
    """All rows of one picture, linear RGB."""
    return np.concatenate([_row(args, objects, worn, material, azimuth) for objects, worn in rows])


def _row(args, objects, worn, material, azimuth):
    for thing in objects if worn else []:
        thing.data.materials.clear()
        thing.data.materials.append(worn)
    stage.camera(objects, azimuth)
    panels = [_panel(args, mode, material) for mode in args.mode]
    panels += [DIFFERENCE_GAIN * np.abs(panel - panels[0]) for panel in panels[1:]]
    return np.concatenate(panels, axis=1)


def _panel(args, mode, material):
    for each in bpy.data.materials:
        if material.is_sgd(each):
            material.set_mode(each, mode.upper())
    with tempfile.TemporaryDirectory() as folder, _progress(mode):
        return stage.over_backdrop(stage.render(Path(folder) / "panel.exr", args.size, args.size, args.samples))


def turntable(args, rows, material):
    """Frames in the output's folder as NAME_0001.png, or one .mp4."""
    movie = args.output.suffix == ".mp4"
    with tempfile.TemporaryDirectory() as folder:
        stem = Path(folder) / "frame" if movie else args.output.with_suffix("")
        for frame in range(args.turntable):
            name = f"{stem}_{frame + 1:04d}.png"
            stage.write_png(name, picture(args, rows, material, 20.0 + 360.0 * frame / args.turntable))
        if movie:
            stage.write_movie(args.output, sorted(Path(folder).glob("frame_*.png")))


class _progress:
    """Says on stderr which panel is rendered and how far it is."""

    def __init__(self, mode):
        self.mode, self.shown = mode, None

    def __enter__(self):
        bpy.app.handlers.render_stats.append(self._show)

    def __exit__(self, *_):
        bpy.app.handlers.render_stats.remove(self._show)

    def _show(self, stats, *_):
        sample = re.search(r"Sample \d+/\d+", str(stats))
        if sample and sample[0] != self.shown:
            self.shown = sample[0]
            print(f"{self.mode}: {sample[0]}", file=sys.stderr)


def _positive(text):
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a positive number")
    return value


def own_arguments(argv):
    """What follows `--` under `blender -b -P`, or everything after the script's name."""
    return argv[argv.index("--") + 1:] if "--" in argv else argv[1:]


if __name__ == "__main__":
    stage.run(main, own_arguments(sys.argv))
