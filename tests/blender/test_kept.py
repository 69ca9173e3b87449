# SPDX-License-Identifier: GPL-3.0-or-later
"""Nothing of the artist's is lost: their graphs, their materials, their files."""

import json
import shutil

import bpy
import pytest
from test_gltf import NAME, sgd_material

import stage

MODES = ("FIT", "LOBES", "PLAIN", "SUN")


def imported(path, **options):
    return bpy.ops.import_scene.sgd_manifest(filepath=str(path), **options)


def export(tmp_path, name="out.glb"):
    path = tmp_path / name
    assert bpy.ops.export_scene.gltf(filepath=str(path), export_extras=True) == {"FINISHED"}
    return path


def links(material):
    """Every link of the material's own graph, as names."""
    return {(link.from_node.name, link.from_socket.name, link.to_node.name, link.to_socket.name)
            for link in material.node_tree.links}


def named(material):
    return {(node.name, node.mute) for node in material.node_tree.nodes}


def group(material):
    from sgd_materials import material as shown

    return shown.nodes(material)[0]


@pytest.fixture
def worn(scene, manifest):
    """Nickel on a ball."""
    ball = stage.ball()
    imported(manifest, material="nickel")
    return ball.active_material


@pytest.fixture
def mixed(worn):
    """Nickel with the artist's own dirt on top, and noise on an input."""
    tree = worn.node_tree
    output = tree.get_output_node("ALL")
    dirt, mix, noise = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("BsdfDiffuse", "MixShader", "TexNoise"))
    tree.links.new(group(worn).outputs["Shader"], mix.inputs[1])
    tree.links.new(dirt.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    tree.links.new(noise.outputs[0], group(worn).inputs["Specular"])
    group(worn).inputs["Tint"].default_value = (1.0, 0.5, 0.25, 1.0)
    return worn


def test_a_change_of_mode_keeps_the_artists_graph(mixed):
    before = links(mixed)
    for mode in (*MODES, "LOBES"):
        mixed.sgd_material.mode = mode
        assert mixed.sgd_material.problem == ""
        assert links(mixed) == before
        assert tuple(group(mixed).inputs["Tint"].default_value) == (1.0, 0.5, 0.25, 1.0)


@pytest.mark.parametrize("mode", MODES)
def test_an_export_keeps_the_artists_graph(mixed, tmp_path, mode):
    mixed.sgd_material.mode = mode
    before, nodes = links(mixed), named(mixed)
    extension, exported, _ = sgd_material(export(tmp_path))
    assert extension["name"] == "nickel"
    fit = json.loads(mixed.sgd_material.fit)
    assert exported["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx(fit["base_color"])
    assert links(mixed) == before and named(mixed) == nodes


def test_an_export_that_fails_keeps_the_artists_graph(mixed, tmp_path):
    from sgd_materials import fallback

    before, nodes = links(mixed), named(mixed)
    fallback.show_all()  # and the exporter stops here
    assert links(mixed) != before
    fallback.restore_all()
    assert links(mixed) == before and named(mixed) == nodes


def test_the_group_inside_the_artists_own_group(worn):
    from sgd_materials import material

    own = bpy.data.node_groups.new("Own", "ShaderNodeTree")
    own.nodes.new("ShaderNodeGroup").node_tree = group(worn).node_tree
    worn.node_tree.nodes.remove(group(worn))
    worn.node_tree.nodes.new("ShaderNodeGroup").node_tree = own
    count = len(worn.node_tree.nodes)
    worn.sgd_material.mode = "PLAIN"
    assert len(worn.node_tree.nodes) == count
    assert [node.node_tree["sgd_mode"] for node in material.nodes(worn)] == ["PLAIN"]


def remove(material, *kinds):
    for node in [node for node in material.node_tree.nodes if not kinds or node.type in kinds]:
        material.node_tree.nodes.remove(node)


@pytest.mark.parametrize("kinds", [("GROUP",), ("OUTPUT_MATERIAL",), ("BSDF_PRINCIPLED",), ()], ids=str)
@pytest.mark.parametrize("used", [True, False])
def test_deleted_nodes_do_not_stop_an_export(scene, glb, tmp_path, kinds, used):
    ball = stage.load_objects(glb)[0]
    material = ball.active_material
    remove(material, *kinds)
    before, nodes = links(material), named(material)
    if not used:
        material.use_fake_user = True
        ball.data.materials.clear()
    path = export(tmp_path)
    if used:
        extension, exported, _ = sgd_material(path)
        assert extension["name"] == "alum-bronze"
        assert exported["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx([0.119, 0.0957, 0.0725], 0.02)
    assert links(material) == before and named(material) == nodes


def test_restore_puts_a_deleted_node_back(worn):
    remove(worn, "GROUP")
    from sgd_materials import panel

    assert "Restore" in " ".join(panel.notes(bpy.context.scene, worn))
    assert bpy.ops.material.sgd_restore() == {"FINISHED"}
    assert group(worn).outputs["Shader"].is_linked and group(worn).outputs["Eevee"].is_linked
    assert "Restore" not in " ".join(panel.notes(bpy.context.scene, worn))


def test_restore_makes_the_outputs_anew(worn):
    remove(worn)
    bpy.ops.material.sgd_restore()
    for target in ("CYCLES", "EEVEE"):
        assert worn.node_tree.get_output_node(target).inputs["Surface"].is_linked


def test_all_selected_objects_wear_it_and_what_they_wore_is_kept(scene, manifest, tmp_path):
    balls = [stage.ball() for _ in range(3)]
    oak = bpy.data.materials.new("Oak")
    balls[0].data.materials.append(oak)
    for ball in balls:
        ball.select_set(ball != balls[2])
    imported(manifest, material="nickel")
    assert [ball.active_material and ball.active_material.name for ball in balls] == ["nickel", "nickel", None]
    reopen(tmp_path)
    assert "Oak" in bpy.data.materials


def reopen(tmp_path):
    path = str(tmp_path / "kept.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    return path


def test_materials_that_nothing_wears_are_saved(scene, manifest, tmp_path):
    imported(manifest)
    names = {material.name for material in bpy.data.materials}
    reopen(tmp_path)
    assert {material.name for material in bpy.data.materials} == names


def test_a_second_import_makes_no_copies(mixed, manifest):
    before = links(mixed)
    imported(manifest, material="nickel")
    assert [material.name for material in bpy.data.materials] == ["nickel"]
    assert links(mixed) == before


def test_another_material_of_the_name_is_kept(scene, manifest):
    bpy.data.materials.new("nickel").use_fake_user = True
    imported(manifest, material="nickel")
    assert {material.name for material in bpy.data.materials} == {"nickel", "nickel.001"}


def test_textures_move_with_the_file(scene, manifest, tmp_path):
    moved = shutil.copytree(manifest.parent, tmp_path / "lut")
    stage.ball()
    imported(moved / "manifest.json", material="nickel")
    shutil.rmtree(moved)
    reopen(tmp_path)
    material = bpy.data.materials["nickel"]
    material.sgd_material.mode = "SUN"
    assert material.sgd_material.problem == ""
    extension, _, _ = sgd_material(export(tmp_path))
    assert len(extension["textures"]) == 3 and all(texture["bytes"] for texture in extension["textures"])


def test_a_missing_texture_is_said_and_the_parameters_are_exported(worn, tmp_path, capfd):
    from sgd_materials import panel

    for item in worn.sgd_material.textures:
        item.image.filepath = str(tmp_path / "gone.exr")
        item.image.unpack(method="REMOVE")
    assert "texture's file is missing" in " ".join(panel.notes(bpy.context.scene, worn))
    extension, _, _ = sgd_material(export(tmp_path))
    assert extension["lobes"] and "textures" not in extension
    assert "exported without lookup textures" in "".join(capfd.readouterr())
    worn.sgd_material.mode = "SUN"
    assert "texture is missing" in worn.sgd_material.problem
    assert group(worn).node_tree["sgd_mode"] == "FIT"


def source_file(manifest, tmp_path):
    imported(manifest, material="nickel")
    path = str(tmp_path / "source.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    stage.clear()
    return path


@pytest.mark.parametrize("link", [False, True], ids=["appended", "linked"])
def test_from_another_file(scene, manifest, tmp_path, link):
    path = source_file(manifest, tmp_path)
    with bpy.data.libraries.load(path, link=link) as (source, target):
        target.materials = ["nickel"]
    material, ball = bpy.data.materials["nickel"], stage.ball()
    ball.data.materials.append(material)
    from sgd_materials import panel

    assert ("make it local" in " ".join(panel.notes(bpy.context.scene, material))) == link
    extension, exported, _ = sgd_material(export(tmp_path))
    assert extension["name"] == "nickel" and len(extension["textures"]) == 3
    fit = json.loads(material.sgd_material.fit)
    assert exported["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx(fit["base_color"])
    if not link:
        for mode in MODES:
            material.sgd_material.mode = mode
            assert material.sgd_material.problem == ""


@pytest.fixture
def textured(scene, glb, tmp_path):
    """The bronze ball with a normal map, emission and opacity, out of a .glb and in again."""
    ball = stage.load_objects(glb)[0]
    material = ball.active_material
    tree = material.node_tree
    image = bpy.data.images.new("bumps", 8, 8)
    texture, normal = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
    texture.image = image
    tree.links.new(texture.outputs["Color"], normal.inputs["Color"])
    principled = tree.nodes["SGD glTF Fit"]
    tree.links.new(normal.outputs[0], principled.inputs["Normal"])
    principled.inputs["Emission Color"].default_value = (1.0, 0.5, 0.0, 1.0)
    principled.inputs["Emission Strength"].default_value = 2.0
    principled.inputs["Alpha"].default_value = 0.5
    path = export(tmp_path, "textured.glb")
    stage.clear()
    return stage.load_objects(path)[0].active_material


@pytest.mark.parametrize("mode", MODES)
def test_normal_map_emission_and_alpha_stay_in_every_mode(textured, tmp_path, mode):
    textured.sgd_material.mode = mode
    inputs = group(textured).inputs
    assert inputs["Normal"].links[0].from_node.type == "NORMAL_MAP"
    emission = [c * inputs["Emission Strength"].default_value for c in inputs["Emission Color"].default_value[:3]]
    assert emission == pytest.approx([2.0, 1.0, 0.0])
    assert inputs["Alpha"].default_value == 0.5
    _, exported, _ = sgd_material(export(tmp_path))
    assert "normalTexture" in exported and exported["emissiveFactor"] == pytest.approx([1.0, 0.5, 0.0])
    assert exported["pbrMetallicRoughness"]["baseColorFactor"][3] == 0.5
    assert NAME in exported["extensions"]


def test_a_glb_in_place_of_a_manifest_is_explained(scene, glb):
    with pytest.raises(RuntimeError, match=r"File > Import > glTF 2\.0"):
        imported(glb)


def test_undo_takes_the_assignment_back(scene, manifest):
    ball = stage.ball()
    ball.data.materials.append(bpy.data.materials.new("Oak"))
    bpy.ops.ed.undo_push(message="before")
    imported(manifest, material="nickel")
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert bpy.context.object.active_material.name == "Oak"
    assert "nickel" not in bpy.data.materials
