# SPDX-License-Identifier: GPL-3.0-or-later
"""SGD's Fresnel term as two generalised Schlick terms that Cycles evaluates unclamped.

With s = 1 - cos(theta_d),

    F = f0 + (1 - f0) s^5 - f1 (1 - s) = (f0 - f1) + f1 s + (1 - f0) s^5

is a fifth and a first power that share the constant. A share b of it goes with the first:

    quintic  f0 - f1 - b  ->  1 - f1 - b        (s = 0  ->  s = 1)
    linear             b  ->  f1 + b

b = max(0, -f1) keeps every end at or above 0 for 0 <= f0 - f1 and f1 <= 1. Of what
remains, Cycles' closure, size * (f0' + (f90' - f0') s^n), takes size >= 0 and f0' in
[0, 1] only, any f90', and picks closures by their mean over the channels, which has to
stay positive:

* f1 > 1 ends below 0 at grazing angles: f90' < 0, with that channel's ends shrunk and
  its size grown until the mean is positive. Exact, at the price of noise.
* f0 < f1, or f1 > 1 in all channels: the end is raised to 0. `raised` is the loss.
"""

from dataclasses import dataclass

# Share of the other channels' grazing reflectance that negative ends may take away.
NEGATIVE_SHARE = 0.5


@dataclass(frozen=True)
class Schlick:
    """size * (f0 + (f90 - f0) (1 - cos theta_d)^n) for each channel."""

    size: tuple
    f0: tuple
    f90: tuple


def split(channels):
    """The (quintic, linear) terms of (f0, f1) pairs, one per channel."""
    quintic, linear = zip(*(_ends(f0, f1) for f0, f1 in channels))
    return _term(quintic), _term(linear)


def raised(f0, f1):
    """How far F at normal incidence lies below what the terms show."""
    return max(0.0, f1 - f0)


def below_zero(f0, f1):
    """Whether one of the terms ends below 0 at grazing angles."""
    return any(grazing < 0.0 for _, grazing in _ends(f0, f1))


def _ends(f0, f1):
    b = max(0.0, -f1)
    return (max(0.0, f0 - f1 - b), 1.0 - f1 - b), (b, f1 + b - raised(f0, f1))


def _term(ends):
    shrink = _shrink([grazing for _, grazing in ends])
    ends = [(normal, grazing if shrink > 0.0 else max(0.0, grazing)) for normal, grazing in ends]
    sizes = [max(abs(normal), abs(grazing)) / (shrink if grazing < 0.0 else 1.0) for normal, grazing in ends]
    f0, f90 = zip(*((normal / size, grazing / size) if size else (0.0, 0.0)
                    for (normal, grazing), size in zip(ends, sizes)))
    return Schlick(tuple(sizes), f0, f90)


def _shrink(grazing):
    """Factor on the ends of negative channels: at most 1, 0 where no channel is positive."""
    positive = sum(1.0 for end in grazing if end > 0.0)
    negative = sum(1.0 for end in grazing if end < 0.0)
    return min(1.0, NEGATIVE_SHARE * positive / negative) if negative else 1.0
