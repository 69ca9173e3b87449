# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures Cycles' pictures of SGD materials against the library's f64 values.

    python blender/truth.py                          all catalogue materials: docs/blender.md's table
    python blender/truth.py --material chrome nickel  those, to standard output

Under a sun: the picture of a ball so large that the half width of the highlight spans 20
pixels, through an orthographic camera, for two suns. It is sampled by a pyramid of
windows around the highlight, each 8 times wider than the one it surrounds, every pixel
a ray through its centre that counts by its area. A probe material gives the shading
normal of each pixel; its radiance is compared with f(wi, wo) cos_i from `sgdbake eval`.
The figure is the larger of the two suns' relative RMS errors over pixels and channels.

In a white furnace: tilted plates under a constant white sky, against the quadrature
of the albedo from `sgdbake sample`; relative RMS over the angles and channels.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy  # noqa: E402
import numpy as np  # noqa: E402

import stage  # noqa: E402

ROOT = stage.HERE.parent
DOCUMENT = ROOT / "docs/blender.md"
SUNS_DEGREES = (40.0, 110.0)
PIXELS = 64
HIGHLIGHT_PIXELS = 20
WIDER = 8.0
# Left out: rays within 2 degrees of the horizon of sun or camera, where the facets' own horizon cuts in.
HORIZON = math.sin(math.radians(2.0))
FURNACE_DEGREES = (0.0, 20.0, 40.0, 60.0, 75.0)
FURNACE_PIXELS = 32
TEXELS = 512
BATCH = 10


class Library:
    """The sgdbake binary: the values that are taken as true."""

    def __init__(self, binary):
        self.binary = binary

    def names(self):
        return json.loads(self._run("materials", "--json"))["materials"]

    def bake(self, names, folder):
        self._run("bake", *(part for name in names for part in ("--material", name)), "-o", str(folder),
                  "--size", str(TEXELS))
        return folder / "manifest.json"

    def radiance(self, name, wi, wo):
        """f cos_i, pixels x 3, for directions in the frame of the surface, pixels x 3."""
        with tempfile.NamedTemporaryFile("w", suffix=".csv", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z"])
            writer.writerows(np.hstack([wi, wo]).tolist())
            file.flush()
            lines = self._run("eval", "--material", name, "--pairs", file.name, "--json").splitlines()
        pairs = map(json.loads, lines)
        return np.array([[pair[channel]["brdf"] for channel in "rgb"] for pair in pairs]) * wi[:, 2:]

    def half_angle(self, name):
        """The smallest angle in radians at which some lobe's D has fallen to half."""
        degrees = np.geomspace(1e-3, 60.0, 300)
        lines = self._run("slice", "--material", name, "--theta-deg", ",".join(map(str, [0.0, *degrees])),
                          "--json").splitlines()
        ndf = np.array([[factors["ndf"] for factors in _factors(json.loads(line))] for line in lines])
        below = (ndf[1:] < 0.5 * ndf[0]).any(axis=1)
        return math.radians(degrees[np.argmax(below)] if below.any() else 60.0)

    def albedo(self, name, degrees):
        """The albedo for a view at that angle by quadrature, per channel."""
        wo = f"{math.sin(math.radians(degrees))},0,{math.cos(math.radians(degrees))}"
        answer = json.loads(self._run("sample", "--material", name, "--wo", wo, "-n", "2", "--seed", "1", "--json"))
        return np.array([answer[channel]["quadrature"] for channel in "rgb"])

    def _run(self, *arguments):
        return subprocess.run([str(self.binary), "--quiet", *arguments], check=True, text=True,
                              stdout=subprocess.PIPE).stdout


def _factors(angle):
    """The factors of each lobe; of a published fit, where each channel has its lobe, they go by channel."""
    return angle["lobes"] if "lobes" in angle else [angle[channel] for channel in "rgb"]


@dataclass(frozen=True)
class Window:
    """A square part of the picture around x = centre, without the hole that a finer one shows."""

    half_width: float
    centre: float
    hole: Window | None


def windows(half_angle, degrees):
    """The pyramid from the highlight to the whole ball."""
    tilt = math.radians(degrees / 2.0)
    half_width = half_angle * math.cos(tilt) * PIXELS / HIGHLIGHT_PIXELS
    window = None
    while half_width < 0.5:
        window = Window(half_width, math.sin(tilt), window)
        yield window
        half_width *= WIDER
    yield Window(1.0, 0.0, window)


class SunBall:
    """A ball under one sun, and what a window shows of it."""

    def __init__(self):
        stage.clear()
        self.ball, self.sun = stage.ball(), stage.sun((0.0, 0.0, 1.0), 1.0)
        self.sun.data.use_shadow = False
        self.probe = stage.normal_probe()
        stage.pixel_centres()
        bpy.context.scene.render.use_persistent_data = True

    def look(self, degrees, window):
        """Points sun and camera; finds the normals and which pixels count."""
        angle = math.radians(degrees)
        stage.point(self.sun, (math.sin(angle), 0.0, math.cos(angle)))
        stage.plan_camera(window.half_width, window.centre)
        self.wi = np.array(self.sun.matrix_world.col[2][:3])
        normals = 2.0 * self._render(self.probe) - 1.0
        length = np.linalg.norm(normals, axis=-1, keepdims=True)
        hit = np.abs(length[..., 0] - 1.0) < 1e-3
        self.seen = hit & ~_hole(window) & (normals @ self.wi > HORIZON) & (normals[..., 2] > HORIZON)
        self.normals = (normals / np.where(length, length, 1.0))[self.seen]

    def picture(self, material):
        """The radiance of the pixels that count, pixels x 3."""
        return self._render(material)[self.seen]

    def truth(self, library, name):
        return library.radiance(name, self._local(self.wi), self._local(np.array([0.0, 0.0, 1.0])))

    def _render(self, material):
        self.ball.data.materials.clear()
        self.ball.data.materials.append(material)
        with tempfile.TemporaryDirectory() as folder:
            return stage.render(Path(folder) / "ball.exr", PIXELS, PIXELS, 1)[..., :3].astype(float)

    def _local(self, w):
        """w in a frame of each pixel's normal n with x at right angles to the picture's vertical."""
        n = self.normals
        x = np.cross([0.0, 1.0, 0.0], n)
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        return np.stack([x @ w, np.cross(n, x) @ w, n @ w], axis=1)


def _hole(window):
    """The pixels that lie in the finer window."""
    if window.hole is None:
        return np.zeros((PIXELS, PIXELS), bool)
    offset = window.half_width * ((np.arange(PIXELS) + 0.5) / PIXELS * 2.0 - 1.0)
    x, y = np.meshgrid(offset + window.centre - window.hole.centre, offset)
    return np.maximum(np.abs(x), np.abs(y)) < window.hole.half_width


def relative_rms(seen, true):
    return math.sqrt(np.sum((seen - true) ** 2) / np.sum(true ** 2))


def sun_errors(library, manifest, name, modes):
    """The relative RMS error of each mode, the larger of the two suns."""
    view = SunBall()
    from sgd_materials import importing, material

    shown = importing.import_file(manifest, name, "FIT")[0]
    half_angle, worst = library.half_angle(name), dict.fromkeys(modes, 0.0)
    for degrees in SUNS_DEGREES:
        pixels = {mode: [] for mode in ("TRUTH", *modes)}
        for window in windows(half_angle, degrees):
            view.look(degrees, window)
            pixels["TRUTH"].append(window.half_width * view.truth(library, name))
            for mode in modes:
                material.set_mode(shown, mode)
                pixels[mode].append(window.half_width * view.picture(shown))
        whole = {mode: np.concatenate(parts) for mode, parts in pixels.items()}
        for mode in modes:
            worst[mode] = max(worst[mode], relative_rms(whole[mode], whole["TRUTH"]))
    return worst


def furnace_error(library, manifest, name, mode, samples=64):
    """Relative RMS error of the albedo over the angles and channels."""
    stage.clear()
    from sgd_materials import importing

    plates = stage.tilted_plates(FURNACE_DEGREES)
    stage.pixel_centres()  # a wider filter would reach past the plates' edges
    stage.constant_world(1.0)
    shown = importing.import_file(manifest, name, mode)[0]
    for plate in plates:
        plate.data.materials.append(shown)
    with tempfile.TemporaryDirectory() as folder:
        pixels = stage.render(Path(folder) / "furnace.exr", FURNACE_PIXELS * len(plates), FURNACE_PIXELS, samples)
    seen = pixels[..., :3].astype(float).reshape(FURNACE_PIXELS, len(plates), FURNACE_PIXELS, 3).mean(axis=(0, 2))
    return relative_rms(seen, np.array([library.albedo(name, degrees) for degrees in FURNACE_DEGREES]))


def measure(library, names, report):
    """Reports one row per material: name, lobes, the three errors, what the panel says."""
    for start in range(0, len(names), BATCH):
        with tempfile.TemporaryDirectory() as folder:
            batch = names[start:start + BATCH]
            manifest = library.bake(batch, Path(folder))
            for name in batch:
                report(_row(library, manifest, name))


def _row(library, manifest, name):
    errors = sun_errors(library, manifest, name, ("LOBES", "SUN"))
    furnace = furnace_error(library, manifest, name, "LOBES")
    from sgd_materials import lobes, manifest as reader

    about = next(each for each in reader.read_manifest(manifest) if each.name == name).description
    return (name, len(lobes.specular(about)), errors["LOBES"], furnace, errors["SUN"],
            "; ".join(lobes.losses(about)))


HEADER = ("| Material | Lobes | Lobes under a sun | Lobes in the furnace | Exact under a sun | Notes |\n"
          "|---|---:|---:|---:|---:|---|\n")


def line(row):
    name, count, *errors, notes = row
    return f"| {name} | {count} | {' | '.join(f'{100 * error:.2f} %' for error in errors)} | {notes} |\n"


def write_table(path, rows):
    """Replaces what stands between the markers of the document."""
    begin, end = "<!-- table: begin -->\n", "<!-- table: end -->"
    before, rest = path.read_text(encoding="utf-8").split(begin)
    after = rest.split(end)[1]
    table = HEADER + "".join(map(line, rows))
    path.write_text(f"{before}{begin}{table}{end}{after}", encoding="utf-8")


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--material", nargs="+", help="default: the catalogue, and the table is written")
    parser.add_argument("--sgdbake", type=Path, default=ROOT / "target/debug/sgdbake", help="the binary")
    args = parser.parse_args(argv)
    library, rows = Library(args.sgdbake), []

    def report(row):
        rows.append(row)
        print(line(row), end="", flush=True)

    measure(library, args.material or library.names(), report)
    if args.material is None:
        write_table(DOCUMENT, rows)


if __name__ == "__main__":
    stage.run(main, sys.argv[1:])
