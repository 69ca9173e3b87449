"""The forms against laws and against each other where the engines agree. pytest, NumPy."""
import numpy as np
import pytest

import forms
from forms import Angles, Material
from picture import SunPixels

PIXELS = SunPixels(size=24)
ANGLES = Angles.of(PIXELS.wi, PIXELS.wo)


@pytest.mark.parametrize("engine", forms.FORMS)
def test_a_black_dielectric_of_specular_0_is_black_or_a_grazing_gleam(engine):
    f = forms.FORMS[engine](Material(base=np.zeros(3), metallic=0.0, roughness=0.4, specular=0.0), ANGLES)
    facing = ANGLES.d > 0.9
    assert np.abs(f[facing]).max() < 1e-4


@pytest.mark.parametrize("engine", forms.FORMS)
def test_a_diffuse_material_without_specular_is_lambert(engine):
    f = forms.FORMS[engine](Material(base=np.array([0.2, 0.4, 0.6]), metallic=0.0, roughness=1.0, specular=0.0), ANGLES)
    facing = ANGLES.d > 0.9
    np.testing.assert_allclose(f[facing] * np.pi, np.broadcast_to([0.2, 0.4, 0.6], f[facing].shape), rtol=2e-4)


def test_albedo_of_a_mirror_is_1_and_of_the_roughest_as_published():
    assert forms.ggx_albedo(0.02, 0.5) == pytest.approx(1, abs=1e-3)
    # E of GGX with correlated Smith by quadrature over the sphere of directions, not over visible normals.
    i, phi = (x.ravel() for x in np.meshgrid((np.arange(400) + 0.5) / 400, np.pi * (np.arange(400) + 0.5) / 400))
    o, s = 0.6, np.sqrt(1 - i * i)
    x, y, z = s * np.cos(phi) + 0.8, s * np.sin(phi), i + o
    h = z / np.sqrt(x * x + y * y + z * z)
    slow = 2 * np.pi * np.mean(forms.d_ggx(0.49, h) * forms.v_correlated(0.49, i, o) * i)
    assert forms.ggx_albedo(0.7, o) == pytest.approx(slow, rel=2e-3)


def test_single_scattering_forms_agree_on_a_dark_dielectric():
    material = Material(base=np.full(3, 0.1), metallic=0.0, roughness=0.4)
    three, khronos = (forms.FORMS[engine](material, ANGLES) for engine in ("three", "khronos"))
    steep = ANGLES.d > 0.95  # beyond, three.js's fit of Schlick's weight parts from it
    np.testing.assert_allclose(three[steep], khronos[steep], rtol=0.012)


def test_specular_colour_below_1_darkens_a_metals_edge_in_blender_alone():
    plain = Material(base=np.full(3, 0.9), metallic=1.0, roughness=0.3)
    tinted = Material(base=np.full(3, 0.9), metallic=1.0, roughness=0.3, specular_color=np.full(3, 0.5))
    grazing = ANGLES.d < 0.45
    ratios = {e: (form(tinted, ANGLES) / form(plain, ANGLES))[grazing].mean() for e, form in forms.FORMS.items()}
    assert ratios["blender"] < 0.9
    assert all(ratio == pytest.approx(1) for engine, ratio in ratios.items() if engine != "blender")
