# SPDX-License-Identifier: GPL-3.0-or-later
"""The group's inputs in every mode, on a ball under a sun in Cycles; and Eevee's pictures beside Cycles'."""

import bpy
import numpy as np
import pytest

import stage

MODES = ("FIT", "LOBES", "PLAIN", "SUN")
SIZE = 24


@pytest.fixture
def worn(scene, manifest):
    """Alum-bronze, diffuse and specular, on a ball under a sun without shadows."""
    from sgd_materials import importing

    ball, sun = stage.ball(), stage.sun((-0.3, -0.4, 0.85))
    sun.data.use_shadow = False
    stage.plan_camera(1.0)
    stage.pixel_centres()
    material = importing.import_file(manifest, "alum-bronze", "FIT")[0]
    ball.data.materials.append(material)
    return material


def group(material):
    from sgd_materials import material as shown

    return shown.nodes(material)[0]


def picture(material, mode, folder, samples=1):
    material.sgd_material.mode = mode
    assert material.sgd_material.problem == ""
    return stage.render(folder / "ball.exr", SIZE, SIZE, samples)


def changed(material, mode, folder, samples=1, **values):
    """The picture with other values of the inputs, which then go back."""
    inputs, before = group(material).inputs, {}
    for name, value in values.items():
        name = name.replace("_", " ").title()
        before[name] = inputs[name].default_value if isinstance(value, float) else tuple(inputs[name].default_value)
        inputs[name].default_value = value
    after = picture(material, mode, folder, samples)
    for name, value in before.items():
        inputs[name].default_value = value
    return after


def close(first, second, tolerance):
    return np.abs(first - second).mean() <= tolerance * np.abs(second).mean()


@pytest.mark.parametrize("mode", MODES)
def test_tint_and_scales(worn, tmp_path, mode):
    plain = picture(worn, mode, tmp_path)[..., :3]
    tinted = changed(worn, mode, tmp_path, tint=(0.5, 1.0, 1.0, 1.0))[..., :3]
    assert close(tinted[..., 1:], plain[..., 1:], 0.003)
    if mode != "FIT":  # its dielectric part counts twice: in the base colour and in the tint of the metal
        assert close(tinted[..., 0], 0.5 * plain[..., 0], 0.003)
    diffuse, specular = (changed(worn, mode, tmp_path, **{name: 0.0})[..., :3] for name in ("specular", "diffuse"))
    assert diffuse.mean() > 0.0 and specular.mean() > 0.0
    assert close(diffuse + specular, plain, 0.02 if mode == "FIT" else 0.003)
    assert changed(worn, mode, tmp_path, specular=0.0, diffuse=0.0)[..., :3].max() <= 1e-6


@pytest.mark.parametrize("mode", ("LOBES", "PLAIN"))
@pytest.mark.parametrize("scale", (0.6, 1.8))
def test_roughness_scales_the_slopes_alike(worn, tmp_path, mode, scale):
    exact = changed(worn, "SUN", tmp_path, roughness_scale=scale)[..., :3]
    lobes = changed(worn, mode, tmp_path, roughness_scale=scale)[..., :3]
    assert close(lobes, exact, 0.02 if mode == "LOBES" else 0.1)
    assert not close(picture(worn, mode, tmp_path)[..., :3], exact, 0.1)


@pytest.mark.parametrize("mode", MODES)
def test_emission_and_alpha(worn, tmp_path, mode):
    plain = picture(worn, mode, tmp_path)
    inside = plain[..., 3] == 1.0
    # Cycles chooses between the sun and the ball that glows now: many samples.
    lit = changed(worn, mode, tmp_path, 256, emission_strength=2.0)
    assert np.median((lit - plain)[inside][:, :3], axis=0) == pytest.approx(2.0, abs=0.01)
    clear = changed(worn, mode, tmp_path, alpha=0.0)
    assert clear[..., 3].max() == 0.0


@pytest.mark.parametrize("mode", MODES)
def test_a_linked_normal_is_the_shading_normal(worn, tmp_path, mode):
    """A normal along the view: around the ball's middle, everything looks as the middle does."""
    tree = worn.node_tree
    normal = tree.nodes.new("ShaderNodeCombineXYZ")
    for socket, value in zip(normal.inputs, (0.0, 0.0, 1.0)):
        socket.default_value = value
    middle = np.s_[SIZE // 3:2 * SIZE // 3, SIZE // 3:2 * SIZE // 3]
    plain = picture(worn, mode, tmp_path)[SIZE // 2, SIZE // 2, :3]
    tree.links.new(normal.outputs[0], group(worn).inputs["Normal"])
    flat = picture(worn, mode, tmp_path)[middle][..., :3].reshape(-1, 3)
    assert flat == pytest.approx(np.broadcast_to(flat.mean(axis=0), flat.shape), rel=0.02)
    assert flat.mean(axis=0) == pytest.approx(plain, rel=0.1)


def test_an_input_that_is_not_as_measured_is_said(worn):
    from sgd_materials import panel

    assert "not as measured" not in " ".join(panel.notes(bpy.context.scene, worn))
    group(worn).inputs["Roughness Scale"].default_value = 2.0
    assert "Roughness Scale is not as measured" in " ".join(panel.notes(bpy.context.scene, worn))


def eevee(scene):
    scene.render.engine = "BLENDER_EEVEE" if bpy.app.version >= (5, 0) else "BLENDER_EEVEE_NEXT"
    scene.eevee.taa_render_samples = 1
    scene.render.filter_size = 0.0
    return scene


def test_eevee_shows_its_own_output(scene, worn, tmp_path):
    """Exact Under a Sun is the same in Eevee, the lobes' fit and nodes near it: no speckles, no patches."""
    exact = picture(worn, "SUN", tmp_path)
    inside = exact[..., 3] == 1.0
    eevee(scene)
    sun, fit, plain = (picture(worn, mode, tmp_path) for mode in ("SUN", "LOBES", "PLAIN"))
    away = np.abs(sun - exact)[inside][:, :3]
    assert (away <= 0.002 + 0.02 * exact[inside][:, :3]).mean() > 0.99
    assert (away <= 0.002 + 0.05 * exact[inside][:, :3]).all()
    for each in (fit, plain):
        assert 0.7 < each[inside][:, :3].mean() / exact[inside][:, :3].mean() < 1.3
