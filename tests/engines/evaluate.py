"""Judges glTF materials in all engines by their forms, in seconds and without the engines.

    python evaluate.py MATERIALS.json [--measured FOLDER] [--binary SGDBAKE] [--json]

MATERIALS.json is a list of {"label", "material", "name"}: the material as in a glTF file, and the catalogue's name of
what it should look like. Prints the mean ΔE2000 of the ball under suns (as docs/engines.md) per engine: to the
measurement's stand-in, or with --binary to the exact material. Blender's figure leaves sheen out.
"""
import argparse
import json
from pathlib import Path

import numpy as np

import forms
import truth
from picture import SunPixels, delta_e


def judged(material, seen, pixels, angles):
    """Mean ΔE2000 per engine."""
    return {engine: delta_e(pixels.radiance(form(material, angles)), seen).mean() for engine, form in forms.FORMS.items()}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("materials", type=Path)
    parser.add_argument("--measured", type=Path, default=truth.ROOT.parent / "shared/measured")
    parser.add_argument("--binary", type=Path, help="compare with the exact material by `sgdbake eval`")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    pixels = SunPixels()
    angles, nets, all_found = forms.Angles.of(pixels.wi, pixels.wo), truth.networks(options.measured), []
    for entry in json.loads(options.materials.read_text()):
        name = entry["name"]
        if options.binary:
            f = truth.exact(options.binary, name, pixels.wi, pixels.wo)
        elif net := nets.get(name.split("@")[0]):
            f = truth.measured(net, pixels.wi, pixels.wo)
        else:
            raise SystemExit(f"evaluate: no measurement of {name} in {options.measured}")
        found = judged(forms.Material.from_gltf(entry["material"]), pixels.radiance(np.maximum(f, 0)), pixels, angles)
        all_found.append(list(found.values()))
        if options.json:
            print(json.dumps({"label": entry["label"], "delta_e": found}))
        else:
            print(f"{entry['label']:28}" + "".join(f" {engine} {value:5.2f}" for engine, value in found.items()))
    for word, values in (("median", np.median(all_found, 0)), ("90th percentile", np.percentile(all_found, 90, axis=0))):
        if not options.json:
            print(f"{word:28}" + "".join(f" {engine} {value:5.2f}" for engine, value in zip(forms.FORMS, values)))


if __name__ == "__main__":
    main()
