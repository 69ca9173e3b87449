# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures Cycles' pictures of SGD materials against the library's f64 values.

    python blender/truth.py                          all catalogue materials: docs/blender.md's table
    python blender/truth.py --material chrome nickel  those, to standard output

Under a sun: a ball seen by an orthographic camera, each pixel one ray through its
centre. A probe material gives the shading normal of each pixel; its radiance is
compared with f(wi, wo) cos_i from `sgdbake eval`. Two suns, and for each the whole
ball and a window in which the highlight's half width spans at least 20 pixels; the
figure is the worst of the four relative RMS errors (of all pixels and channels).

In a white furnace: tilted plates under a constant white sky, against the quadrature
of the albedo from `sgdbake sample`; relative RMS over the angles and channels.
"""

import argparse
import csv
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy  # noqa: E402
import numpy as np  # noqa: E402

import stage  # noqa: E402

ROOT = stage.HERE.parent
DOCUMENT = ROOT / "docs/blender.md"
SUNS_DEGREES = (40.0, 110.0)
PIXELS = 96
HIGHLIGHT_PIXELS = 20
# Left out: rays within 2 degrees of the horizon of sun or camera, where the facets' own horizon cuts in.
HORIZON = math.sin(math.radians(2.0))
FURNACE_DEGREES = (0.0, 20.0, 40.0, 60.0, 75.0)
FURNACE_PIXELS = 32
TOLERANCE = 1e-3
BATCH = 10


class Library:
    """The sgdbake binary: the values that are taken as true."""

    def __init__(self, binary):
        self.binary = binary

    def names(self):
        return [entry["name"] for entry in json.loads(self._run("materials", "--json"))["materials"]]

    def bake(self, names, folder):
        self._run("bake", *(part for name in names for part in ("--material", name)), "-o", str(folder),
                  "--size", "512")
        return folder / "manifest.json"

    def radiance(self, name, wi, wo):
        """f cos_i, pixels x 3, for directions in the frame of the surface, pixels x 3."""
        with tempfile.NamedTemporaryFile("w", suffix=".csv", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z"])
            writer.writerows(np.hstack([wi, wo]).tolist())
            file.flush()
            lines = self._run("eval", "--material", name, "--pairs", file.name, "--json").splitlines()
        brdf = [[json.loads(line)[channel]["brdf"] for channel in "rgb"] for line in lines]
        return np.array(brdf) * wi[:, 2:]

    def half_angle(self, name):
        """The smallest angle in radians at which some channel's D has fallen to half."""
        degrees = np.geomspace(1e-3, 60.0, 300)
        lines = self._run("slice", "--material", name, "--theta-deg", ",".join(map(str, [0.0, *degrees])),
                          "--json").splitlines()
        ndf = np.array([[json.loads(line)[channel]["ndf"] for channel in "rgb"] for line in lines])
        below = (ndf[1:] < 0.5 * ndf[0]).any(axis=1)
        return math.radians(degrees[np.argmax(below)] if below.any() else 60.0)

    def albedo(self, name, degrees):
        """The albedo for a view at that angle by quadrature, per channel."""
        wo = f"{math.sin(math.radians(degrees))},0,{math.cos(math.radians(degrees))}"
        answer = json.loads(self._run("sample", "--material", name, "--wo", wo, "-n", "1", "--seed", "1", "--json"))
        return np.array([answer[channel]["quadrature"] for channel in "rgb"])

    def _run(self, *arguments):
        return subprocess.run([str(self.binary), "--quiet", *arguments], check=True, text=True,
                              stdout=subprocess.PIPE).stdout


class SunBall:
    """The ball under one sun in one window: its normals, and pictures of materials on it."""

    def __init__(self, degrees, half_width=1.0, centre=0.0):
        self.scene = stage.clear()
        self.ball = stage.ball()
        angle = math.radians(degrees)
        self.wi = np.array([math.sin(angle), 0.0, math.cos(angle)])
        stage.sun(self.wi, 1.0).data.use_shadow = False
        stage.plan_camera(half_width, centre)
        stage.pixel_centres()
        self.normals = self._normals()
        self.seen = (self.normals @ self.wi > HORIZON) & (self.normals[..., 2] > HORIZON)

    def picture(self, material):
        """The radiance of the pixels that count, pixels x 3."""
        return self._render(material)[self.seen]

    def truth(self, library, name):
        return library.radiance(name, *(self._local(w) for w in (self.wi, np.array([0.0, 0.0, 1.0]))))

    def _render(self, material):
        self.ball.data.materials.clear()
        self.ball.data.materials.append(material)
        with tempfile.TemporaryDirectory() as folder:
            return stage.render(Path(folder) / "ball.exr", PIXELS, PIXELS, 1)[..., :3].astype(float)

    def _normals(self):
        normals = 2.0 * self._render(stage.normal_probe()) - 1.0
        length = np.linalg.norm(normals, axis=-1, keepdims=True)
        return np.where(np.abs(length - 1.0) < 1e-3, normals / length, 0.0)

    def _local(self, w):
        """w in a frame of each pixel's normal whose y is at right angles to sun and view."""
        n = self.normals[self.seen]
        x = np.cross([0.0, 1.0, 0.0], n)
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        return np.stack([x @ w, np.cross(n, x) @ w, n @ w], axis=1)


def relative_rms(seen, true):
    return math.sqrt(np.sum((seen - true) ** 2) / np.sum(true ** 2))


def sun_windows(library, name):
    """(sun, half width, centre) of the views of a material: the ball, and its highlight."""
    half_angle = library.half_angle(name)
    for degrees in SUNS_DEGREES:
        yield degrees, 1.0, 0.0
        tilt = math.radians(degrees / 2.0)
        half_width = half_angle * math.cos(tilt) * PIXELS / HIGHLIGHT_PIXELS
        if half_width < 0.5:
            yield degrees, half_width, math.sin(tilt)


def sun_errors(library, manifest, name, modes):
    """The worst relative RMS error of each mode."""
    from sgd_materials import material, operators

    worst = dict.fromkeys(modes, 0.0)
    for window in sun_windows(library, name):
        view = SunBall(*window)
        true = view.truth(library, name)
        shown = operators.import_manifest(manifest, name, "FIT")[0]
        for mode in modes:
            material.set_mode(shown, mode)
            worst[mode] = max(worst[mode], relative_rms(view.picture(shown), true))
    return worst


def furnace_error(library, manifest, name, mode, samples=256):
    """Relative RMS error of the albedo over the angles and channels."""
    stage.clear()
    from sgd_materials import operators

    plates = stage.tilted_plates(FURNACE_DEGREES)
    stage.constant_world(1.0)
    shown = operators.import_manifest(manifest, name, mode)[0]
    for plate in plates:
        plate.data.materials.append(shown)
    with tempfile.TemporaryDirectory() as folder:
        pixels = stage.render(Path(folder) / "furnace.exr", FURNACE_PIXELS * len(plates), FURNACE_PIXELS, samples)
    seen = pixels[..., :3].astype(float).reshape(FURNACE_PIXELS, len(plates), FURNACE_PIXELS, 3).mean(axis=(0, 2))
    return relative_rms(seen, np.array([library.albedo(name, degrees) for degrees in FURNACE_DEGREES]))


def measure(library, names, report):
    """One row per material: (name, lobes, exact, plain, furnace, what the panel says)."""
    for start in range(0, len(names), BATCH):
        with tempfile.TemporaryDirectory() as folder:
            batch = names[start:start + BATCH]
            manifest = library.bake(batch, Path(folder))
            for name in batch:
                report(_row(library, manifest, name))


def _row(library, manifest, name):
    errors = sun_errors(library, manifest, name, ("LOBES", "SUN", "PLAIN"))
    furnace = furnace_error(library, manifest, name, "LOBES")
    from sgd_materials import lobes, manifest as reader

    about = next(each for each in reader.read_manifest(manifest) if each.name == name).description
    return (name, len(lobes.specular(about)), errors["LOBES"], furnace, errors["SUN"], errors["PLAIN"],
            "; ".join(lobes.losses(about)))


HEADER = ("| Material | Lobes | Lobes under a sun | Lobes in the furnace | Exact under a sun | Plain nodes | Notes |\n"
          "|---|---:|---:|---:|---:|---:|---|\n")


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
    main(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:])
