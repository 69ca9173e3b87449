# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' pictures of hard materials against the library's f64 values."""

import bpy
import pytest
from conftest import HARD

import truth

# Cycles 4.2 takes narrow lobes for mirrors: they are widened there.
LOBES_LIMIT = {"chrome": 0.1, "steel": 0.25, "gold-metallic-paint2": 0.015} if bpy.app.version < (4, 5) else {}


@pytest.mark.parametrize("name", HARD)
def test_under_a_sun(library, manifest, name):
    error = truth.sun_errors(library, manifest, name, ("LOBES", "SUN"))
    assert error["LOBES"] <= LOBES_LIMIT.get(name, 0.01)
    assert error["SUN"] <= 0.001


@pytest.mark.parametrize("name", HARD)
def test_in_a_white_furnace(library, manifest, name):
    assert truth.furnace_error(library, manifest, name, "LOBES") <= 0.01
