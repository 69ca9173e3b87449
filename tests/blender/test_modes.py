# SPDX-License-Identifier: GPL-3.0-or-later
import json
import re
import shutil

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
    assert notes["gold-paint"].startswith("Differs from the measurement by 1.4 ΔE (MERL gold-paint")
    assert "leaves" not in notes["gold-paint"]
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


@pytest.fixture
def sunlit(nickel):
    """Nickel under a sun on a ball."""
    stage.ball().data.materials.append(nickel)
    nickel.sgd_material.mode = "SUN"
    return nickel


def test_a_sun_that_is_added_later_is_found(sunlit):
    assert driven(sunlit, "Irradiance") == (1.0, 1.0, 1.0)
    sun = stage.sun((0.0, 1.0, 0.0), 5.0)
    bpy.context.view_layer.update()
    assert driven(sunlit, "Irradiance") == pytest.approx((5.0,) * 3)
    bpy.data.objects.remove(sun)
    bpy.context.view_layer.update()
    assert driven(sunlit, "Irradiance") == (1.0, 1.0, 1.0)


def test_the_sun_s_exposure_temperature_and_hiding(sunlit):
    sun = stage.sun((0.0, 1.0, 0.0), 2.0)
    bpy.context.view_layer.update()
    if hasattr(sun.data, "exposure"):  # since Blender 4.5
        sun.data.exposure = 1.0
        assert driven(sunlit, "Irradiance") == pytest.approx((4.0,) * 3)
        sun.data.use_temperature, sun.data.temperature = True, 3000.0
        assert driven(sunlit, "Irradiance") == pytest.approx([4.0 * c for c in sun.data.temperature_color], rel=1e-4)
    sun.hide_render = True
    assert driven(sunlit, "Irradiance") == (0.0, 0.0, 0.0)


def test_what_does_not_light_it_is_said(sunlit):
    from sgd_materials import panel

    assert "No sun in the scene" in " ".join(panel.notes(bpy.context.scene, sunlit))
    stage.sun((0.0, 1.0, 0.0), 2.0)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    bpy.context.scene.collection.objects.link(lamp)
    notes = " ".join(panel.notes(bpy.context.scene, sunlit))
    assert "Lit by Sun alone" in notes and "Ignored: Lamp" in notes


def test_it_does_not_light_the_floor(sunlit, tmp_path):
    """The emission is for the camera: a floor in the shadow of everything stays dark."""
    stage.sun((0.0, 0.0, 1.0), 50.0).hide_set(True)
    bpy.context.view_layer.update()
    for thing in list(bpy.context.scene.objects):  # the sun drives the material, and lights nothing itself
        if thing.type == "LIGHT":
            bpy.context.scene.collection.objects.unlink(thing)
            sunlit.sgd_material.sun = thing
    bpy.ops.mesh.primitive_plane_add(size=8.0, location=(0.0, 0.0, -1.0))
    stage.plan_camera(2.0)
    pixels = stage.render(tmp_path / "floor.exr", 24, 24, 16)
    assert pixels[12, 12, :3].min() > 0.1
    assert pixels[:4, :, :3].max() == 0.0


def test_two_materials_may_follow_two_suns(scene, manifest):
    from sgd_materials import importing

    suns = [stage.sun((0.0, 0.0, 1.0), 2.0), stage.sun((0.0, 0.0, 1.0), 3.0)]
    first = importing.import_file(manifest, "nickel", "FIT")[0]
    second = first.copy()
    for material, sun in zip((first, second), suns):
        stage.ball().data.materials.append(material)
        material.sgd_material.sun = sun
        material.sgd_material.mode = "SUN"
    bpy.context.view_layer.update()
    assert [driven(material, "Irradiance")[0] for material in (first, second)] == [2.0, 3.0]


def test_lobes_that_colour_every_channel(scene, manifest, tmp_path):
    """Two lobes of one distribution each: closures and textures show the same picture."""
    from sgd_materials import importing, lobes

    document = version_2_document(manifest)
    material = next(each for each in document["materials"] if each["name"] == "gold-paint")
    # The one Fresnel row of a published fit: each lobe colours one channel of it.
    fresnel = {key: [sum(channel) for channel in zip(*(lobe[key] for lobe in material["lobes"]))] for key in ("f0", "f1")}
    for lobe, rho_s in zip(material["lobes"], ([0.2, 0.3, 0.1], [0.05, 0.1, 0.3], [0.0, 0.0, 0.0])):
        lobe.update(fresnel, rho_s=rho_s)
    own = shutil.copytree(manifest.parent, tmp_path / "lut") / "manifest.json"
    own.write_text(json.dumps(document))
    made = importing.import_file(own, "gold-paint", "LOBES")[0]
    about = json.loads(made.sgd_material.description)
    assert [blend.lobes for blend in lobes.blends(about)] == [(0, 0, 0), (1, 1, 1)]
    assert closures(made) <= 16
    stage.ball().data.materials.append(made)
    stage.sun((0.5, 0.3, 0.8)).data.use_shadow = False
    stage.plan_camera(1.0)
    stage.pixel_centres()
    pictures = {}
    for mode in ("LOBES", "SUN"):
        made.sgd_material.mode = mode
        assert made.sgd_material.problem == ""
        pictures[mode] = stage.render(tmp_path / "ball.exr", 32, 32, 1)[..., :3]
    assert pictures["SUN"].mean() > 0.02
    # 14 components share 15 closures: all but one have Fresnel at the view.
    assert abs(pictures["LOBES"] - pictures["SUN"]).mean() < 0.015 * pictures["SUN"].mean()


def version_2_document(path):
    """A manifest as version 2 writes it, whichever version it is of."""
    document = json.loads(path.read_text())
    if document["schema"] != "sgdbake/manifest/2":
        from sgd_materials import manifest

        document["schema"] = "sgdbake/manifest/2"
        document["materials"] = [{**manifest.description(each, each["name"]), "gltf": each["gltf"]}
                                 for each in document["materials"]]
    return document
