# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' pictures of hard materials against the library's f64 values."""

import pytest
from conftest import HARD

import truth

# Seven widths do not span steel's peak: its channels are 2e-4 to 2e-2 wide with heavy flanks.
LOBES_LIMIT = {"steel": 0.02}


@pytest.mark.parametrize("name", HARD)
def test_under_a_sun(library, manifest, name):
    error = truth.sun_errors(library, manifest, name, ("LOBES", "SUN"))
    assert error["LOBES"] <= LOBES_LIMIT.get(name, 0.01)
    assert error["SUN"] <= 0.001


@pytest.mark.parametrize("name", HARD)
def test_in_a_white_furnace(library, manifest, name):
    assert truth.furnace_error(library, manifest, name, "LOBES") <= 0.01
