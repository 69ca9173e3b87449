# SPDX-License-Identifier: GPL-3.0-or-later
"""The closures of the path-traced material, from a material's description alone.

The distribution is a mixture of Beckmann lobes with one width and one RGB weight
each; Fresnel is two Schlick terms per lobe (fresnel.py). Cycles evaluates a
Beckmann closure as F D G / (4 cos_i cos_o), the material has rho_s/pi in place of
1/4: the weight of lobe j is 4 rho_s/pi w_j.

Where two closures a lobe are more than fit, the narrowest lobes take one each, with
Fresnel at the view: over a lobe of width alpha, cos(theta_d) differs from cos(theta_o)
by alpha/2 sin(theta_d).
"""

import math
from dataclasses import dataclass

import bpy

from . import fresnel
from .manifest import CHANNELS

# With the diffuse one, the 16 that Cycles surely keeps.
MAX_CLOSURES = 15
# More leave fewer than five with Fresnel at each microfacet.
MAX_LOBES = 10
# Cycles treats a lobe as a mirror, dark under a sun, where alpha^2 is at or below 2e-10; in 4.2, 5e-7.
MIN_ALPHA = 2e-5 if bpy.app.version >= (4, 5) else 7.1e-4
# Below this no peak is visible: sgd_lobes.osl lifts weights over Cycles' own limit of 1e-5.
MIN_WEIGHT = 1e-9


@dataclass(frozen=True)
class Lobe:
    alpha: float
    # w_j of the mixture, and 4 rho_s/pi w_j.
    share: tuple
    weight: tuple


def specular(description):
    """The visible lobes, widest first."""
    strongest = _by_strength(description)[:MAX_LOBES]
    visible = [lobe for lobe in strongest if sum(lobe.weight) / 3.0 >= MIN_WEIGHT]
    return sorted(visible, key=lambda lobe: -lobe.alpha)


def whole(count):
    """How many of so many lobes take two closures: the widest, the others one each."""
    return min(count, MAX_CLOSURES - count)


def curves(description):
    """(f0, f1) of the three channels."""
    return [(channel["f0"], channel["f1"]) for channel in _channels(description)]


def diffuse(description):
    """rho_d of the three channels, within the [0, 1] of an albedo or beyond it as published."""
    return tuple(channel["rho_d"] for channel in _channels(description))


def losses(description):
    """What the lobes cannot show, as sentences for the panel."""
    given, kept = [sum(lobe.weight) for lobe in _by_strength(description)], len(specular(description))
    sentences = []
    if kept == 0:
        sentences.append("No visible specular reflection: only the diffuse part is shown")
    elif len(given) > kept:
        lost = sum(given[kept:]) / sum(given)
        sentences.append(f"{len(given) - kept} of {len(given)} lobes left out: {lost:.1e} of the reflection")
    narrow = sum(alpha < MIN_ALPHA for alpha in description["lobes"]["alpha"])
    if narrow:
        sentences.append(f"Narrower than Cycles can show: {narrow} of {len(given)} lobes, widened to {MIN_ALPHA:g}")
    outside = [name for name, curve in zip(CHANNELS, curves(description)) if fresnel.leaves_range(*curve)]
    if outside:
        sentences.append(f"Fresnel leaves [0, 1] in {', '.join(outside)}: shown as published, with more noise")
    return sentences


def _channels(description):
    return [description["channels"][name] for name in CHANNELS]


def _by_strength(description):
    scale = [4.0 / math.pi * channel["rho_s"] for channel in _channels(description)]
    lobes = [Lobe(max(alpha, MIN_ALPHA), tuple(share), tuple(s * w for s, w in zip(scale, share)))
             for alpha, share in zip(description["lobes"]["alpha"], description["lobes"]["weights"])]
    return sorted(lobes, key=lambda lobe: -sum(lobe.weight))
