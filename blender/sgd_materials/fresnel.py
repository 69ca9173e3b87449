# SPDX-License-Identifier: GPL-3.0-or-later
"""SGD's Fresnel term as two generalised Schlick terms that Cycles evaluates unclamped.

With s = 1 - cos(theta_d),

    F = f0 + (1 - f0) s^5 - f1 (1 - s) = (f0 - f1) + f1 s + (1 - f0) s^5

is a fifth and a first power that share the constant. A share b of it goes with the first:

    quintic  f0 - f1 - b  ->  1 - f1 - b        (s = 0  ->  s = 1)
    linear             b  ->  f1 + b            b = max(0, -f1)

A published F may leave [0, 1], and then ends of the quintic lie below 0. Cycles' closure
is size * tint * (f0' + (f90' - f0') s^n) with size >= 0 and f0' in [0, 1], any tint and
f90': every F can be written. But Cycles picks closures by the mean of tint * (...) over
the channels, which has to stay positive. So a channel that goes below 0 has its ends
shrunk and its size grown, which changes the mean and not the value. Only where no
channel is above 0 at an end, all are raised to 0 there, and `raised` is the loss.
"""

from dataclasses import dataclass

# Share of the other channels' mean that channels below 0 may take away.
NEGATIVE_SHARE = 0.5


@dataclass(frozen=True)
class Schlick:
    """size * tint * (f0 + (f90 - f0) (1 - cos theta_d)^n), a value per channel."""

    size: tuple
    tint: tuple
    f0: tuple
    f90: tuple
    raised: tuple


def split(channels):
    """The (quintic, linear) terms of (f0, f1) pairs, one per channel."""
    quintic, linear = zip(*(_ends(f0, f1) for f0, f1 in channels))
    return _term(quintic), _term(linear)


def below_zero(f0, f1):
    """Whether the quintic of a channel goes below 0."""
    return min(_ends(f0, f1)[0]) < 0.0


def _ends(f0, f1):
    """(normal, grazing) of the quintic and of the linear term."""
    b = max(0.0, -f1)
    return (f0 - f1 - b, 1.0 - f1 - b), (b, f1 + b)


def _term(published):
    floor = [0.0 if all(end <= 0.0 for end in side) else min(side) for side in zip(*published)]
    ends = [tuple(map(max, pair, floor)) for pair in published]
    shrink = _shrink([_scaled(pair, _size(pair)) for pair in ends])
    sizes = [_size(pair) / (shrink if min(pair) < 0.0 else 1.0) for pair in ends]
    tint = [-1.0 if normal < 0.0 else 1.0 for normal, _ in ends]
    f0, f90 = zip(*(_scaled(pair, sign * size) for pair, sign, size in zip(ends, tint, sizes)))
    raised = [max(a - b for a, b in zip(pair, before)) for pair, before in zip(ends, published)]
    return Schlick(tuple(sizes), tuple(tint), f0, f90, tuple(raised))


def _size(pair):
    return max(abs(end) for end in pair) or 1.0


def _scaled(pair, size):
    return tuple(end / size for end in pair)


def _shrink(ends):
    """The factor on channels below 0 that keeps the mean above 0 at both ends; at most 1."""
    room = [sum(end for end in side if end > 0.0) / -below
            for side in zip(*ends) if (below := sum(end for end in side if end < 0.0))]
    return min([1.0, *(NEGATIVE_SHARE * each for each in room)])
