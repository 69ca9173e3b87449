# SPDX-License-Identifier: GPL-3.0-or-later
"""The closures of the path-traced material, from a material's description alone.

A material is up to three lobes. Lobes that colour different channels share closures: they
make a `Blend`, with one lobe per channel. A published fit is one blend of three lobes, a
refitted material one blend for each of its lobes.

The distribution of a blend is a mixture of Beckmann components with one width and one RGB
weight each; Fresnel is two Schlick terms per component (fresnel.py). Cycles evaluates a
Beckmann closure as F D G / (4 cos_i cos_o), the material has rho_s/pi in place of 1/4: the
weight of component j is 4 rho_s/pi w_j.

Where two closures a component are more than fit, those that lose the least take one each, with
Fresnel at the view: over a component of width alpha, cos(theta_d) differs from cos(theta_o) by
alpha/2 sin(theta_d).
"""

import math
from dataclasses import dataclass

import bpy

from . import fresnel
from .manifest import CHANNELS

# With the diffuse one, the 16 that Cycles surely keeps.
MAX_CLOSURES = 15
# Two blends of seven components: one closure each, and one more.
MAX_COMPONENTS = 14
# Cycles treats a component as a mirror, dark under a sun, where alpha^2 is at or below 2e-10; in 4.2, 5e-7.
MIN_ALPHA = 2e-5 if bpy.app.version >= (4, 5) else 7.1e-4
# Cycles takes wider components for this wide.
MAX_ALPHA = 1.0
# Below this no peak is visible: sgd_lobes.osl lifts weights over Cycles' own limit of 1e-5.
MIN_WEIGHT = 1e-9


@dataclass(frozen=True)
class Blend:
    """Lobes that colour different channels; `lobes` has the index of each channel's lobe or None."""

    lobes: tuple
    # 4 rho_s/pi, f0 and f1 of the three channels.
    scale: tuple
    f0: tuple
    f1: tuple

    def of_lobes(self, values, default=0.0):
        """A value per lobe as one per channel."""
        return tuple(default if lobe is None else values[lobe] for lobe in self.lobes)


@dataclass(frozen=True)
class Component:
    """One Beckmann component of a blend."""

    alpha: float
    blend: int
    # w_j of the mixture, and 4 rho_s/pi w_j.
    share: tuple
    weight: tuple

    @property
    def strength(self):
        return sum(self.weight)


def blends(description):
    """The fewest blends: a lobe joins the first in which none colours a channel that it colours."""
    members = []
    for index, lobe in enumerate(description["lobes"]):
        coloured = {c for c in range(3) if lobe["rho_s"][c] > 0.0}
        home = next((each for each in members if not coloured & each.keys()), None)
        if home is None:
            members.append(home := {})
        home.update(dict.fromkeys(coloured, index))
    return [_blend(description["lobes"], tuple(each.get(c) for c in range(3))) for each in members if each]


def _blend(lobes, chosen):
    def of(key):
        return tuple(0.0 if lobe is None else lobes[lobe][key][c] for c, lobe in enumerate(chosen))

    return Blend(chosen, tuple(4.0 / math.pi * rho_s for rho_s in of("rho_s")), of("f0"), of("f1"))


def specular(description):
    """The visible components; those that lose the most by Fresnel at the view come first."""
    strongest = _by_strength(description)[:MAX_COMPONENTS]
    visible = [each for each in strongest if each.strength / 3.0 >= MIN_WEIGHT]
    return sorted(visible, key=lambda each: -each.alpha * each.strength)


def whole(count):
    """How many of so many components, the first, take two closures; the others take one each."""
    return min(count, MAX_CLOSURES - count)


def curves(blend):
    """(f0, f1) of the three channels."""
    return list(zip(blend.f0, blend.f1))


def losses(description):
    """What the closures cannot show, as sentences for the panel."""
    given, kept = _by_strength(description), len(specular(description))
    sentences = []
    if kept == 0:
        sentences.append("No visible specular reflection: only the diffuse part is shown")
    elif len(given) > kept:
        lost = sum(each.strength for each in given[kept:]) / sum(each.strength for each in given)
        sentences.append(f"{len(given) - kept} of {len(given)} lobes left out: {lost:.1e} of the reflection")
    widths = description["mixture"]["alpha"]
    narrow, wide = sum(alpha < MIN_ALPHA for alpha in widths), sum(alpha > MAX_ALPHA for alpha in widths)
    if narrow:
        sentences.append(f"Narrower than Cycles can show: {narrow} of {len(widths)} lobes, widened to {MIN_ALPHA:g}")
    if wide:
        sentences.append(f"Wider than Cycles can show: {wide} of {len(widths)} lobes, narrowed to {MAX_ALPHA:g}")
    noisy = [(CHANNELS[c], fresnel.leaves_range(*curve)) for blend in blends(description)
             for c, curve in enumerate(curves(blend)) if blend.lobes[c] is not None and fresnel.is_noisy(*curve)]
    for leaves, what in ((True, "leaves [0, 1]"), (False, "has a negative part")):
        named = [name for name in CHANNELS if (name, leaves) in noisy]
        if named:
            sentences.append(f"Fresnel {what} in {', '.join(named)}: shown as it is, with more noise")
    return sentences


def _by_strength(description):
    mixture = description["mixture"]
    components = [_component(blend, index, alpha, weights) for index, blend in enumerate(blends(description))
                  for alpha, weights in zip(mixture["alpha"], mixture["weights"])]
    return sorted((each for each in components if any(each.share)), key=lambda each: -each.strength)


def _component(blend, index, alpha, weights):
    share = blend.of_lobes(weights)
    return Component(min(max(alpha, MIN_ALPHA), MAX_ALPHA), index, share,
                     tuple(s * w for s, w in zip(blend.scale, share)))
