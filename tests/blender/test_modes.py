# SPDX-License-Identifier: GPL-3.0-or-later
import re

import bpy
import pytest

import stage


@pytest.fixture
def nickel(scene, manifest):
    from sgd_materials import importing

    return importing.import_file(manifest, "nickel", "FIT")[0]


def shown_node(material):
    return material.node_tree.get_output_node("ALL").inputs["Surface"].links[0].from_node


def shown_mode(material):
    return shown_node(material).node_tree["sgd_mode"]


def closures(material):
    """Cycles closures of the group: two per whole OSL component, one for any other BSDF of the lobes."""
    nodes = shown_node(material).node_tree.nodes
    return sum(_of_script(node.script.as_string()) if node.type == "SCRIPT"
               else node.type in {"BSDF_GLOSSY", "BSDF_DIFFUSE"} for node in nodes)


def _of_script(source):
    components, whole = (int(re.search(rf"#define {name} (\d+)", source)[1]) for name in ("COMPONENTS", "WHOLE"))
    return components + whole


def test_the_mode_is_switched_without_reimport(nickel):
    for mode in ("LOBES", "PLAIN", "SUN", "FIT"):
        nickel.sgd_material.mode = mode
        assert nickel.sgd_material.problem == ""
        assert shown_mode(nickel) == mode
    groups = [tree.name for tree in bpy.data.node_groups]
    nickel.sgd_material.mode = "LOBES"
    assert [tree.name for tree in bpy.data.node_groups] == groups, "a mode is built once"


def test_no_more_closures_than_cycles_keeps(scene, manifest):
    from sgd_materials import importing

    counts = [closures(material) for material in importing.import_file(manifest, "", "LOBES")]
    assert min(counts) >= 1 and max(counts) == 16


def test_without_osl_the_fit_is_shown_with_the_reason(nickel, monkeypatch):
    from sgd_materials import osl, panel

    monkeypatch.setattr(osl, "supported", lambda: False)
    nickel.sgd_material.mode = "LOBES"
    assert "choose Lobes (Nodes)" in " ".join(panel.notes(bpy.context.scene, nickel))
    assert shown_mode(nickel) == "FIT"


def test_the_sun_drives_direction_and_irradiance(nickel):
    from mathutils import Vector

    stage.ball().data.materials.append(nickel)  # drivers run on what the scene uses
    sun = stage.sun((1.0, 2.0, 2.0), 3.0)
    sun.data.color = (1.0, 0.5, 0.25)
    nickel.sgd_material.sun = sun
    nickel.sgd_material.mode = "SUN"
    assert (Vector(driven(nickel, "Sun Direction")) - Vector((1, 2, 2)) / 3).length < 1e-6
    assert driven(nickel, "Irradiance") == pytest.approx((3.0, 1.5, 0.75))


def driven(material, name):
    """What the drivers give in the evaluated scene."""
    bpy.context.view_layer.update()
    tree = shown_node(material).node_tree.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return tuple(socket.default_value for socket in tree.nodes[name].inputs)


def test_the_panel_says_what_is_lost(scene, manifest):
    from sgd_materials import importing, panel

    notes = {material.name: " ".join(panel.notes(scene, material))
             for material in importing.import_file(manifest, "", "LOBES")}
    assert "No visible specular" in notes["black-fabric"] or "lobes left out" in notes["black-fabric"]
    assert "leaves [0, 1]" in notes["white-fabric2"]
    assert "leaves [0, 1]" in notes["alum-bronze"]
    assert notes["gold-paint"] == ""
    scene.cycles.shading_system = False
    material = bpy.data.materials["gold-paint"]
    assert "Open Shading Language" in " ".join(panel.notes(scene, material))


def test_the_file_keeps_material_and_mode(nickel, tmp_path):
    nickel.sgd_material.mode = "LOBES"
    nickel.use_fake_user = True
    path = str(tmp_path / "kept.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    kept = bpy.data.materials["nickel"]
    assert kept.sgd_material.mode == "LOBES"
    kept.sgd_material.mode = "SUN"
    assert kept.sgd_material.problem == ""
