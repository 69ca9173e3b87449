"""Compares the engines' pictures with the materials and the measurement, and each with its form; writes docs/engines.md.

    python report.py SGDBAKE PICTURES MATERIALS.json … [--measured FOLDER] [--environment FILE.hdr] [-o docs/engines.md]
    python report.py … --environment FILE.hdr --only-environment -o docs/engines.md     only that section is written anew

--measured holds the networks, PICTURES/measurements the same as NAME.binary (examples/networks_to_measurements).

PICTURES/LIST/ENGINE/LABEL.f32 are pictures under suns of draw.mjs and blender.py, LIST the stem of a MATERIALS.json;
PICTURES/LIST/environment/ENGINE/LABEL.f32 those under the environment alone.
"""
import argparse
import json
import sys
from pathlib import Path

import numpy as np

import forms
import truth
from picture import EDGE, SunPixels, delta_e, normals

ENGINES = {"three": "three.js 0.187.0", "babylon": "Babylon.js 9.35.0", "filament": "Filament 1.53.4", "khronos": "Khronos viewer 1.1.0",
           "blender": "Blender 4.5, Cycles"}
LIT_SIZE = 24  # pixels of a ball under the environment: pictures take long to converge
FINER = 3  # samples a side that the engines draw of such a pixel
EXPOSURE = 0.5  # under the environment: a white diffuse ball is then about half of white
ITSELF = "itself"  # the exact material, beside the engines
GOAL = (1.3, 2.0)  # median and 90th percentile of the mean ΔE2000 to the measured surface
BRIGHTEST = 30.0  # Babylon.js clamps radiance to it


class Row:
    """One material: per engine the colour differences to it and to the measurement, and the form's error."""

    def __init__(self, entry, folder, pixels, binary, nets, panorama):
        self.name = entry["name"]
        references = {"material": truth.exact(binary, self.name, pixels.wi, pixels.wo)}
        net = nets.get(self.name.split("@")[0])
        if net:
            references["measurement"] = truth.measured(net, pixels.wi, pixels.wo)
        self.references = {key: pixels.radiance(np.maximum(f, 0)) for key, f in references.items()}
        self.engines = {}
        if net:
            off = delta_e(self.references["material"], self.references["measurement"])
            self.engines[ITSELF] = {"measurement": (off.mean(), off.max())}
        material, label = forms.Material.from_gltf(entry["material"]), entry["label"]
        for engine in ENGINES:
            path = folder / engine / f"{label}.f32"
            if path.is_file():
                self.engines[engine] = self._measure(engine, pixels, pixels.read(path), material)
        for engine, found in under_environment(entry, folder, binary, panorama).items():
            self.engines.setdefault(engine, {}).update(found)

    def _measure(self, engine, pixels, seen, material):
        form = pixels.radiance(forms.FORMS[engine](material, forms.Angles.of(pixels.wi, pixels.wo)))
        counted = (form < BRIGHTEST).all(1)
        off = np.abs(seen - form)[counted] / np.maximum(form[counted], 1e-3)
        found = {key: delta_e(seen, reference) for key, reference in self.references.items()}
        return {"form": off.max(), **{key: (d.mean(), d.max()) for key, d in found.items()}}


class EnvironmentRow:
    """One material under the environment alone: per engine the colour difference to it."""

    def __init__(self, entry, folder, binary, panorama):
        self.name = entry["name"]
        self.engines = under_environment(entry, folder, binary, panorama)


# What the pictures under the environment are held against, and the heading of its figures.
LIT = {"lit material": "To the exact material, under an environment", "lit measurement": "To the measured surface, under an environment"}


def under_environment(entry, folder, binary, panorama):
    """Per engine the mean and largest difference of its picture to those of the exact material and of the measurement."""
    paths = {engine: folder / "environment" / engine / f"{entry['label']}.f32" for engine in ENGINES}
    paths = {engine: path for engine, path in paths.items() if panorama and path.is_file()}
    if not paths:
        return {}
    inside, found = blocks(normals(FINER * LIT_SIZE)[1] < EDGE).all((1, 3)), {}
    references = {key: kept.reshape(LIT_SIZE, LIT_SIZE, 3).astype(float)[inside] for key, kept in lit_references(entry, folder, binary, panorama)}
    for engine, path in paths.items():
        picture = np.fromfile(path, "<f4").reshape(FINER * LIT_SIZE, -1, 3).astype(float)
        seen = blocks(picture).mean((1, 3))[inside]
        differences = {key: delta_e(EXPOSURE * seen, EXPOSURE * reference) for key, reference in references.items()}
        found[engine] = {key: (d.mean(), d.max()) for key, d in differences.items()}
    if "lit measurement" in references:
        off = delta_e(*(EXPOSURE * references[key] for key in LIT))
        found[ITSELF] = {"lit measurement": (off.mean(), off.max())}
    return found


def lit_references(entry, folder, binary, panorama):
    """The pictures of the exact material and, where its file is there, of the measurement; kept for the next run."""
    surface = entry["name"].split("@")[0]
    measurement = folder.parent / f"measurements/{surface}.binary"
    surfaces = {"lit material": (folder / f"environment/exact/{entry['label']}.f32", ["--material", entry["name"]]),
                "lit measurement": (folder.parent / f"measurements/{surface}.f32", ["--measured", str(measurement)])}
    for key, (kept, arguments) in surfaces.items():
        if not kept.is_file() and (key == "lit material" or measurement.is_file()):
            kept.parent.mkdir(parents=True, exist_ok=True)
            truth.under_environment(binary, arguments, panorama, LIT_SIZE).astype("<f4").tofile(kept)
        if kept.is_file():
            yield key, np.fromfile(kept, "<f4")


def blocks(fine):
    """The samples of each pixel: rows, samples down, columns, samples across."""
    return fine.reshape(LIT_SIZE, FINER, LIT_SIZE, FINER, *fine.shape[2:])


def drawn(lists, key):
    """The lists and the engines that have figures of a kind."""
    has = lambda rows, engine: any(key in row.engines.get(engine, {}) for row in rows)
    return ([name for name, rows in lists.items() if any(has(rows, e) for e in ENGINES)],
            [engine for engine in ENGINES if any(has(rows, engine) for rows in lists.values())])


def spread(means):
    """Median, 90th percentile and largest; none of no materials."""
    if not means:
        return [np.nan] * 3
    return np.median(means), np.percentile(means, 90), np.max(means)


def means(rows, engine, key):
    return [row.engines[engine][key][0] for row in rows if key in row.engines.get(engine, {})]


def summary(lists, key):
    """A table: per engine and list the median, 90th percentile and largest of the materials' mean differences."""
    names, used = drawn(lists, key)
    lines = ["| Engine | " + " | ".join(f"{name}: median | 90th percentile | largest" for name in names) + " |", "|---" * (1 + 3 * len(names)) + "|"]
    found = {ENGINES[engine]: [means(lists[name], engine, key) for name in names] for engine in used}
    if any(itself := [means(lists[name], ITSELF, key) for name in names]):
        found["*the material itself*"] = itself
    for name, columns in found.items():
        lines.append(f"| {name} | " + " | ".join("–" if np.isnan(value) else f"{value:.2f}" for column in columns for value in spread(column)) + " |")
    return lines


def goal(lists):
    """Per list: whether every engine is within the goal to the measurement, and which are not."""
    lines, (names, used) = [], drawn(lists, "measurement")
    for name in names:
        found = {ENGINES[engine]: spread(means(lists[name], engine, "measurement"))[:2] for engine in used}
        missed = [engine for engine, figures in found.items() if any(figure > limit for figure, limit in zip(figures, GOAL))]
        lines.append(f"* {name}: " + ("**holds in each engine**." if not missed else f"**missed** in {', '.join(missed)}."))
    return lines


def table(lists, key):
    """A table: per material and engine the mean and largest difference, one list's after the other's."""
    names, used = drawn(lists, key)
    rows = [{row.name.split("@")[0]: row for row in lists[name]} for name in names]
    lines = ["| Material | " + " | ".join(ENGINES[e] for e in used) + " |", "|---" * (1 + len(used)) + "|"]
    for material in dict.fromkeys(name for found in rows for name in found):
        figures = [[found[material].engines.get(e, {}).get(key) if material in found else None for found in rows] for e in used]
        if any(any(cell) for cell in figures):
            cells = (" → ".join("–" if one is None else f"{one[0]:.2f} / {one[1]:.1f}" for one in cell) for cell in figures)
            lines.append(f"| {material} | " + " | ".join(cells) + " |")
    return lines


def forms_error(lists):
    """A table: the largest deviation of each engine's form from a pixel."""
    cells = []
    for engine in ENGINES:
        found = [row.engines[engine]["form"] for rows in lists.values() for row in rows if engine in row.engines]
        cells.append(f"{100 * max(found):.2f} %" if found else "–")
    return ["| " + " | ".join(ENGINES.values()) + " |", "|---" * len(ENGINES) + "|", "| " + " | ".join(cells) + " |"]


def document(lists):
    counts = ", ".join(f"{name} {len(rows)}" for name, rows in lists.items())
    lines = [*HEAD.strip().splitlines(), "", f"Materials drawn: {counts}.", "",
             "## To the measured surface, under suns", "", *MEASURED.strip().splitlines(), "", *goal(lists), "", *summary(lists, "measurement"), "",
             "## To the exact material, under suns", "", *EXACT.strip().splitlines(), "", *summary(lists, "material"), ""]
    if drawn(lists, "lit material")[0]:
        lines += environment_section(lists)
    lines += [FORMS, "", "Largest deviation of [engine-forms.md](engine-forms.md) from a pixel, over all materials above:", "",
              *forms_error(lists), "", *LIMITS.strip().splitlines(), ""]
    for key, to in (("measurement", "the measured surface"), ("material", "the exact material")):
        lines += [f"## Each material, under suns, to {to}", "", f"Mean / largest ΔE2000, {' → '.join(drawn(lists, key)[0])}.", "", *table(lists, key), ""]
    return "\n".join(lines)


def environment_section(lists):
    names, used = drawn(lists, "lit material")
    counts = "; ".join(f"{ENGINES[engine]} " + ", ".join(f"{name} {len(means(lists[name], engine, 'lit material'))}" for name in names) for engine in used)
    lines = []
    for key, heading in LIT.items():
        if drawn(lists, key)[0]:
            lines += [f"## {heading}", "", *ENVIRONMENT[key].strip().splitlines(), "", *summary(lists, key), ""]
    lines += [f"Materials drawn: {counts}.", ""]
    for key, heading in LIT.items():
        if drawn(lists, key)[0]:
            lines += [f"### Each material: {heading[0].lower()}{heading[1:]}", "", f"Mean / largest ΔE2000, {' → '.join(names)}.", "", *table(lists, key), ""]
    return lines


def with_section(page, section):
    """The page with the section under the environment in its place."""
    before, after = page.split(f"\n{FORMS}\n")
    return f"{before.split('## ' + LIT['lit material'])[0].rstrip()}\n\n{section}\n{FORMS}\n{after}"


FORMS = "## The engines' forms"

HEAD = """
# The glTF material in real engines

<!-- Generated by scripts/engines.sh. -->

Every engine that reads an exported file without our extension draws its glTF material. This page measures these pictures: the engines' own packages, run headless, their own glTF loaders, no tone mapping. *published* is the glTF material of the catalogue's `NAME`, fitted to the published SGD parameters; *refit* is that of `NAME@refit`, fitted to the measurement itself, in the mean over the engines' forms.

The picture is a ball of 48 × 48 pixels, orthographic, under a sun of irradiance π at 15, 40, 70, 110 and 140° from the view in turn: white facing the sun is 1. Pixels within 0.97 of the radius count, where the light is above the horizon (cosine above 0.05). ΔE2000 of linear sRGB clipped to 0 … 1, D65. A material's figure is the mean over its pixels; the tables give the median, 90th percentile and largest of these means.
"""

MEASURED = """
What the eye sees against the real thing (its stand-in, see [conditions](#conditions)). The last row is the SGD material itself, which no glTF material knows of. Goal for the refit: median at most 1.3 and 90th percentile at most 2, in each engine:
"""

EXACT = """
To the SGD material of the same edition, by `sgdbake eval`. The refit's glTF materials are fitted to the measurement, not to the refitted SGD, and may be closer to the surface than it is.
"""

ENVIRONMENT = {
    "lit material": """
royal_esplanade_1k.hdr, exposure 0.5, a ball of 24 × 24 pixels, the mean of 3 × 3 samples each, to a picture of the exact material of the same edition by `sgdbake preview` with 16384 directions per pixel. three.js (`PMREMGenerator`), Babylon.js (`HDRCubeTexture` as its own viewer sets it up) and the Khronos viewer filter the panorama first: what they lose there is in these figures, of diffuse materials too. Cycles samples it, with 4608 samples per pixel.
""",
    "lit measurement": """
The same pictures, to that of the surface: `sgdbake preview --measured` of its stand-in as a MERL file. The last row is the exact material of each edition.
""",
}

LIMITS = """
## Conditions

* three.js, Babylon.js, Filament and the Khronos viewer run in headless Chromium (Debian's) with software GL (SwiftShader), into float targets. Each pixel's normal is drawn on a flat patch: screen-space widening of lobes (three.js, Babylon.js, Filament) is therefore absent, as it is on a large smooth surface.
* Blender: the `bpy` module, Cycles on the CPU, materials as its glTF importer makes them.
* Filament is not measured under the environment: npm's package reads only environments that its tool cmgen prefiltered (KTX), and that tool is not in the package.
* The panorama's lamps are small and bright, and how the engines filter them shows: of pure-rubber@refit, nearly diffuse, the mean radiance in red is 1.01 of the exact material's in three.js, 1.19 in Babylon.js, 0.82 in the Khronos viewer.
* The measurement is a stand-in: networks trained on the MERL database (Sztrajman et al. 2021), a mean ΔE2000 of about 1 off the real measurements.
* The figures of [fits.md](fits.md) (median ΔE2000 0.26 of its glTF column) compare with the published SGD under one dim area light and are smaller for these reasons alone.
"""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("binary", type=Path)
    parser.add_argument("pictures", type=Path)
    parser.add_argument("materials", type=Path, nargs="+")
    parser.add_argument("--measured", type=Path, default=truth.ROOT.parent / "shared/measured")
    parser.add_argument("--environment", type=Path)
    parser.add_argument("--only-environment", action="store_true")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    if options.only_environment:
        lists = {path.stem: [EnvironmentRow(entry, options.pictures / path.stem, options.binary, options.environment) for entry in json.loads(path.read_text())]
                 for path in options.materials}
        section = "\n".join(environment_section(lists))
        options.output.write_text(with_section(options.output.read_text(), section))
        return
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
