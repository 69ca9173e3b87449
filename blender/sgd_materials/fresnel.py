# SPDX-License-Identifier: GPL-3.0-or-later
"""SGD's Fresnel term as two generalised Schlick terms that Cycles evaluates unclamped.

With s = 1 - cos(theta_d),

    F = f0 + (1 - f0) s^5 - f1 (1 - s) = (f0 - f1) + f1 s + (1 - f0) s^5

is a fifth and a first power that share the constant. A share b of it goes with the first:

    quintic  f0 - f1 - b  ->  1 - f1 - b        (s = 0  ->  s = 1)
    linear             b  ->  f1 + b

A published F may leave [0, 1], and then ends lie below 0. Cycles' closure is
size * tint * (f0' + (f90' - f0') s^n) with size >= 0 and f0' in [0, 1], any tint and
f90': every F can be written. But Cycles picks closures by the mean of tint * (...) over
the channels, which has to stay positive:

* b = max(0, -f1) leaves only the quintic below 0. A channel that goes there has its ends
  shrunk and its size grown, which changes the mean and not the value.
* Where no channel of the quintic is above 0 at normal incidence, b = f0 - f1: the linear
  term rises from below 0 at once, and its mean over a wide lobe is positive.
"""

from dataclasses import dataclass

# Share of the other channels' mean that channels below 0 may take away.
NEGATIVE_SHARE = 0.5
# Fits keep F within [0, 1] up to the digits that their parameters are printed with.
ROUNDING = 1e-5


@dataclass(frozen=True)
class Schlick:
    """size * tint * (f0 + (f90 - f0) (1 - cos theta_d)^n), a value per channel."""

    size: tuple
    tint: tuple
    f0: tuple
    f90: tuple


def split(channels):
    """The (quintic, linear) terms of (f0, f1) pairs, one per channel."""
    shares = [max(0.0, -f1) for _, f1 in channels]
    if all(f0 - f1 <= b for (f0, f1), b in zip(channels, shares)):
        shares = [f0 - f1 for f0, f1 in channels]
    return (_term([(f0 - f1 - b, 1.0 - f1 - b) for (f0, f1), b in zip(channels, shares)]),
            _term([(b, f1 + b) for (_, f1), b in zip(channels, shares)]))


def is_noisy(f0, f1):
    """Whether an end of F, or of its quintic part, is below 0 or above 1: Cycles picks closures less well."""
    return f0 - f1 < -ROUNDING or f1 > 1.0 + ROUNDING or f0 - f1 > 1.0 + ROUNDING


def leaves_range(f0, f1):
    """Whether F leaves [0, 1] between s = 0 and 1. F is 1 at s = 1 and turns where f1 + 5 (1 - f0) s^4 = 0."""
    turn = -0.2 * f1 / (1.0 - f0) if f0 != 1.0 else 0.0
    turns = [turn ** 0.25] if 0.0 < turn < 1.0 else []
    values = [f0 - f1 + f1 * s + (1.0 - f0) * s ** 5 for s in (0.0, *turns)]
    return min(values) < -ROUNDING or max(values) > 1.0 + ROUNDING


def _term(ends):
    shrink = _shrink([_scaled(pair, _size(pair)) for pair in ends])
    sizes = [_size(pair) / (shrink if min(pair) < 0.0 else 1.0) for pair in ends]
    tint = [-1.0 if normal < 0.0 else 1.0 for normal, _ in ends]
    f0, f90 = zip(*(_scaled(pair, sign * size) for pair, sign, size in zip(ends, tint, sizes)))
    return Schlick(tuple(sizes), tuple(tint), f0, f90)


def _size(pair):
    return max(abs(end) for end in pair) or 1.0


def _scaled(pair, size):
    return tuple(end / size for end in pair)


def _shrink(ends):
    """The factor on channels below 0 that keeps the mean above 0 at each end that has one above."""
    room = [above / -below for side in zip(*ends)
            if (below := sum(end for end in side if end < 0.0)) and (above := sum(end for end in side if end > 0.0))]
    return min([1.0, *(NEGATIVE_SHARE * each for each in room)])
