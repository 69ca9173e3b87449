# SPDX-License-Identifier: GPL-3.0-or-later
"""The closures of the path-traced material, from a material's description alone.

The distribution is a mixture of Beckmann lobes with one width and one RGB weight
each; Fresnel is two Schlick terms per lobe (fresnel.py). Cycles evaluates a
Beckmann closure as F D G / (4 cos_i cos_o), the material has rho_s/pi in place of
1/4: the weight of lobe j is 4 rho_s/pi w_j.
"""

import math
from dataclasses import dataclass

import bpy

from . import fresnel
from .manifest import CHANNELS

# Two closures a lobe and one diffuse: 15 of the 16 that Cycles surely keeps.
MAX_LOBES = 7
# Cycles treats a lobe as a mirror, dark under a sun, where alpha^2 is at or below 2e-10; in 4.2, 5e-7.
MIN_ALPHA = 2e-5 if bpy.app.version >= (4, 5) else 7.1e-4
# Below this no peak is visible: sgd_lobe.osl lifts weights over Cycles' own limit of 1e-5.
MIN_WEIGHT = 1e-9


@dataclass(frozen=True)
class Lobe:
    alpha: float
    weight: tuple
    quintic: fresnel.Schlick
    linear: fresnel.Schlick


def specular(description):
    """The visible lobes, widest first."""
    quintic, linear = fresnel.split([(channel["f0"], channel["f1"]) for channel in _channels(description)])
    return [Lobe(alpha, weight, quintic, linear) for alpha, weight in _kept(description)]


def diffuse(description):
    """rho_d of the three channels, within the [0, 1] of an albedo or beyond it as published."""
    return tuple(channel["rho_d"] for channel in _channels(description))


def losses(description):
    """What the lobes cannot show, as sentences for the panel."""
    given, kept = _weighted(description), _kept(description)
    sentences = []
    if not kept:
        sentences.append("No visible specular reflection: only the diffuse part is shown")
    elif len(given) > len(kept):
        lost = sum(sum(w) for _, w in given[len(kept):]) / sum(sum(w) for _, w in given)
        sentences.append(f"{len(given) - len(kept)} of {len(given)} lobes left out: {lost:.1e} of the reflection")
    narrow = [alpha for alpha in description["lobes"]["alpha"] if alpha < MIN_ALPHA]
    if narrow:
        sentences.append(f"{len(narrow)} lobes widened to Cycles' smallest width {MIN_ALPHA:g}")
    outside = [name for name, channel in zip(CHANNELS, _channels(description))
               if fresnel.leaves_range(channel["f0"], channel["f1"])]
    if outside:
        sentences.append(f"Fresnel leaves [0, 1] in {', '.join(outside)}: shown as published, with more noise")
    return sentences


def _channels(description):
    return [description["channels"][name] for name in CHANNELS]


def _weighted(description):
    """(alpha, 4 rho_s/pi w) of every lobe, strongest first."""
    scale = [4.0 / math.pi * channel["rho_s"] for channel in _channels(description)]
    lobes = description["lobes"]
    pairs = [(max(alpha, MIN_ALPHA), tuple(s * w for s, w in zip(scale, weight)))
             for alpha, weight in zip(lobes["alpha"], lobes["weights"])]
    return sorted(pairs, key=lambda pair: -sum(pair[1]))


def _kept(description):
    visible = [pair for pair in _weighted(description)[:MAX_LOBES] if sum(pair[1]) / 3.0 >= MIN_WEIGHT]
    return sorted(visible, key=lambda pair: -pair[0])
