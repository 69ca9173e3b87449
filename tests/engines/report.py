"""Compares the engines' pictures with the materials and the measurement, and each with its form; writes docs/engines.md.

    python report.py SGDBAKE PICTURES MATERIALS.json … [--measured FOLDER] [-o docs/engines.md]

PICTURES/LIST/ENGINE/LABEL.f32 are pictures of draw.mjs and blender.py, LIST the stem of a MATERIALS.json.
"""
import argparse
import json
import sys
from pathlib import Path

import numpy as np

import forms
import truth
from picture import EDGE, SIZE, SunPixels, delta_e, normals

ENGINES = {"three": "three.js 0.187.0", "babylon": "Babylon.js 9.35.0", "filament": "Filament 1.53.4", "khronos": "Khronos viewer 1.1.0",
           "blender": "Blender 4.5, Cycles"}
EXPOSURE = 0.5  # under the environment: a white diffuse ball is then about half of white
BRIGHTEST = 30.0  # Babylon.js clamps radiance to it


class Row:
    """One material: per engine the colour differences to the material and to the measurement, and the form's error."""

    def __init__(self, entry, folder, pixels, binary, nets, panorama):
        self.name = entry["name"]
        references = {"surface": truth.exact(binary, self.name, pixels.wi, pixels.wo)}
        net = nets.get(self.name.split("@")[0])
        if net:
            references["measurement"] = truth.measured(net, pixels.wi, pixels.wo)
        self.references = {key: pixels.radiance(np.maximum(f, 0)) for key, f in references.items()}
        self.exact = None if not net else delta_e(self.references["surface"], self.references["measurement"])
        self.engines = {}
        material = forms.Material.from_gltf(entry["material"])
        paths = {engine: folder / engine / f"{entry['label']}.f32" for engine in ENGINES}
        lit = {engine: pixels.read_environment(path) for engine, path in paths.items() if path.is_file()}
        for engine in lit:
            self.engines[engine] = self._measure(engine, pixels, pixels.read(paths[engine]), material)
        if panorama and any(picture is not None for picture in lit.values()):
            inside = normals()[1] < EDGE
            reference = truth.under_environment(binary, self.name, panorama, SIZE)[inside]
            for engine, picture in lit.items():
                if picture is not None:
                    d = delta_e(EXPOSURE * picture[inside], EXPOSURE * reference)
                    self.engines[engine]["environment"] = (d.mean(), d.max())

    def _measure(self, engine, pixels, seen, material):
        form = pixels.radiance(forms.FORMS[engine](material, forms.Angles.of(pixels.wi, pixels.wo)))
        counted = (form < BRIGHTEST).all(1)
        off = np.abs(seen - form)[counted] / np.maximum(form[counted], 1e-3)
        found = {key: delta_e(seen, reference) for key, reference in self.references.items()}
        return {"form": off.max(), **{key: (d.mean(), d.max()) for key, d in found.items()}}


def summary(rows, key):
    """A table: per engine the median, 90th percentile and largest of the materials' mean differences, and the largest of a pixel."""
    lines = ["| Engine | median | 90th percentile | largest | largest of a pixel |", "|---|---|---|---|---|"]
    for engine, name in ENGINES.items():
        found = [row.engines[engine][key] for row in rows if key in row.engines.get(engine, {})]
        if found:
            mean, most = np.array(found).T
            lines.append(f"| {name} | {np.median(mean):.2f} | {np.percentile(mean, 90):.2f} | {mean.max():.2f} | {most.max():.1f} |")
    if key == "measurement":
        mean = [row.exact.mean() for row in rows if row.exact is not None]
        lines.append(f"| the material itself | {np.median(mean):.2f} | {np.percentile(mean, 90):.2f} | {max(mean):.2f} | |")
    return lines


def table(rows, key):
    """A table: per material and engine the mean and largest difference."""
    used = [engine for engine in ENGINES if any(engine in row.engines for row in rows)]
    lines = ["| Material | " + " | ".join(ENGINES[e] for e in used) + " |", "|---|" + "---|" * len(used)]
    for row in rows:
        cells = (row.engines.get(e, {}).get(key) for e in used)
        lines.append(f"| {row.name} | " + " | ".join("–" if c is None else f"{c[0]:.2f} / {c[1]:.1f}" for c in cells) + " |")
    return lines


def document(lists):
    lines = HEAD.strip().splitlines() + [""]
    for name, rows in lists.items():
        lines += [f"## {name.capitalize()}, under suns", "", f"{len(rows)} materials. ΔE2000 of the engine's picture to the exact material:", "",
                  *summary(rows, "surface"), ""]
        if any("measurement" in e for row in rows for e in row.engines.values()):
            lines += ["To the measurement (its stand-in, see below):", "", *summary(rows, "measurement"), ""]
        if any("environment" in e for row in rows for e in row.engines.values()):
            lines += ["Under royal_esplanade_1k.hdr, exposure 0.5, to a converged picture of the exact material:", "", *summary(rows, "environment"), ""]
    lines += ["## The engines' forms", "", "Largest deviation of [engine-forms.md](engine-forms.md) from a pixel, over all materials above:", "",
              "| " + " | ".join(ENGINES.values()) + " |", "|---" * len(ENGINES) + "|"]
    cells = []
    for engine in ENGINES:
        found = [row.engines[engine]["form"] for rows in lists.values() for row in rows if engine in row.engines]
        cells.append(f"{100 * max(found):.2f} %" if found else "–")
    lines += ["| " + " | ".join(cells) + " |", "", *LIMITS.strip().splitlines(), ""]
    for name, rows in lists.items():
        for key, to in (("surface", "the exact material"), ("measurement", "the measurement"), ("environment", "the exact material")):
            if any(key in e for row in rows for e in row.engines.values()):
                lines += [f"## {name.capitalize()} {'under the environment' if key == 'environment' else 'under suns'}, to {to}", "", "Mean / largest ΔE2000.", "", *table(rows, key), ""]
    return "\n".join(lines)


HEAD = """
# The glTF material in real engines

<!-- Generated by scripts/engines.sh. -->

Every engine that reads an exported file without our extension draws its glTF material. This page measures these pictures: the engines' own packages, run headless, their own glTF loaders, no tone mapping.

The picture is a ball of 48 × 48 pixels, orthographic, under a sun of irradiance π at 15, 40, 70, 110 and 140° from the view in turn: white facing the sun is 1. Pixels within 0.97 of the radius count, where the light is above the horizon (cosine above 0.05). ΔE2000 of linear sRGB clipped to 0 … 1, D65. A material's figure is the mean over its pixels.
"""

LIMITS = """
## Conditions

* three.js, Babylon.js, Filament and the Khronos viewer run in headless Chromium (Debian's) with software GL (SwiftShader), into float targets. Each pixel's normal is drawn on a flat patch: screen-space widening of lobes (three.js, Babylon.js, Filament) is therefore absent, as it is on a large smooth surface.
* Blender: the `bpy` module, Cycles on the CPU, materials as its glTF importer makes them.
* npm's Filament reads environments that its tool cmgen prefiltered (KTX) only, and that tool is not in the package: it has no figure under the environment. The Khronos viewer filters its maps itself; in software GL that takes many minutes.
* The measurement is a stand-in: networks trained on the MERL database (Sztrajman et al. 2021), a mean ΔE2000 of about 1 off the real measurements.
* The figures of [fits.md](fits.md) are taken under one dim area light and are smaller for that reason alone.
"""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("binary", type=Path)
    parser.add_argument("pictures", type=Path)
    parser.add_argument("materials", type=Path, nargs="+")
    parser.add_argument("--measured", type=Path, default=truth.ROOT.parent / "shared/measured")
    parser.add_argument("--environment", type=Path)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    pixels, nets = SunPixels(), truth.networks(options.measured)
    lists = {path.stem: [Row(entry, options.pictures / path.stem, pixels, options.binary, nets, options.environment) for entry in json.loads(path.read_text())]
             for path in options.materials}
    text = document(lists)
    if options.output:
        options.output.write_text(text + "\n")
    else:
        print(text)


if __name__ == "__main__":
    sys.exit(main())
