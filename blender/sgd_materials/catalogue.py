# SPDX-License-Identifier: GPL-3.0-or-later
"""The measured materials that come with the extension: a manifest, its textures and a picture of each.

Needs no Blender. scripts/build-extension.sh bakes the folder; without it the catalogue is empty.
"""

import functools
from pathlib import Path

from .manifest import read_manifest

FOLDER = Path(__file__).with_name("catalogue")
MANIFEST = FOLDER / "manifest.json"
# An edition of a catalogue material is named NAME@EDITION.
EDITION = "@"
LICENCE = "MIT OR Apache-2.0"
AUTHOR = "sgdbake"

# The first kind with a word of the name; the order puts metallic paint before metal.
KINDS = {
    "Fabric": ("fabric", "felt"),
    "Rubber and Foam": ("rubber", "latex", "foam", "neoprene"),
    "Paint": ("paint", "two-layer"),
    "Wood Finish": ("cherry", "fruitwood", "maple", "pine", "oak", "walnut", "natural"),
    "Stone and Ceramic": ("alumina", "aventurnine", "obsidian", "hematite", "jasper", "marble", "silicon", "tungsten"),
    "Plastic": ("acrylic", "phenolic", "plastic", "delrin", "nylon", "polyethylene", "pvc", "teflon", "bball"),
    "Metal": ("bronze", "aluminium", "brass", "chrome", "steel", "nickel", "ss440"),
}
OTHER = "Other"


@functools.cache
def sources():
    """The catalogue's materials by name, in its order."""
    if not MANIFEST.is_file():
        return {}
    return {source.name: source for source in read_manifest(MANIFEST)}


def kind(name):
    """The kind of a material, by the words of its name."""
    return next((each for each, words in KINDS.items() if any(word in name for word in words)), OTHER)


def title(name):
    """A name for people: "gold-paint@refit" is "Gold Paint (refit)"."""
    base, _, edition = name.partition(EDITION)
    words = base.replace("-", " ").title()
    return f"{words} ({edition})" if edition else words


def picture(name):
    """The picture of a material's ball."""
    return FOLDER / f"{name}.png"
