# SPDX-License-Identifier: GPL-3.0-or-later
import csv

import numpy as np
import pytest
from conftest import ROOT

import stage

stage.clear()
from sgd_materials import fresnel  # noqa: E402


def catalogue():
    with open(ROOT / "src/material/merl100.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    names = dict.fromkeys(row["material"] for row in rows)
    return {name: [(float(row["F0"]), float(row["F1"])) for row in rows if row["material"] == name] for name in names}


CATALOGUE = catalogue()
# Below 0 at normal incidence in all three channels: the linear term is, for rays along the normal.
BELOW = {"blue-fabric", "white-fabric2"}


def published(f0, f1, cos):
    return f0 + (1 - f0) * (1 - cos) ** 5 - f1 * cos


def shown(term, channel, exponent, cos):
    s = (1 - cos) ** exponent
    return term.size[channel] * term.tint[channel] * (term.f0[channel] + (term.f90[channel] - term.f0[channel]) * s)


@pytest.mark.parametrize("name", CATALOGUE)
def test_terms_sum_to_the_published_curve(name):
    quintic, linear = fresnel.split(CATALOGUE[name])
    cos = np.linspace(0, 1, 101)
    for channel, (f0, f1) in enumerate(CATALOGUE[name]):
        error = shown(quintic, channel, 5, cos) + shown(linear, channel, 1, cos) - published(f0, f1, cos)
        assert np.abs(error).max() <= 1e-12 * max(1.0, abs(f0))


@pytest.mark.parametrize("name", CATALOGUE)
def test_terms_stay_within_what_cycles_takes(name):
    quintic, linear = fresnel.split(CATALOGUE[name])
    for term in (quintic, linear):
        assert all(0.0 <= f0 <= 1.0 for f0 in term.f0)
        assert all(size >= 0.0 for size in term.size)
        assert sum(np.multiply(term.tint, term.f90)) >= 0.0
    assert sum(np.multiply(quintic.tint, quintic.f0)) >= 0.0
    assert (sum(np.multiply(linear.tint, linear.f0)) < 0.0) == (name in BELOW)


def refitted():
    with open(ROOT / "src/material/merl100-refit.csv", newline="") as file:
        return [(float(row[f"f0_{c}"]), float(row[f"f1_{c}"])) for row in csv.DictReader(file) for c in "rgb"]


@pytest.mark.parametrize("edition", ["published", "refit"])
def test_a_curve_leaves_its_range_where_a_fine_scan_does(edition):
    curves = refitted() if edition == "refit" else [curve for curves in CATALOGUE.values() for curve in curves]
    cos = np.linspace(0, 1, 20001)
    values = {curve: published(*curve, cos) for curve in curves}
    scanned = {curve for curve, f in values.items() if f.min() < -fresnel.ROUNDING or f.max() > 1 + fresnel.ROUNDING}
    assert {curve for curve in curves if fresnel.leaves_range(*curve)} == scanned
    assert len(scanned) == 0 if edition == "refit" else 5 < len(scanned) < len(curves) / 4
