# SPDX-License-Identifier: GPL-3.0-or-later
"""The catalogue that the zip carries: from its list onto objects, and as an asset library."""

import json
import os
import subprocess
import sys

import bpy
import pytest

import assets as assets_script
import package
import stage

NAMES = ("gold-paint", "chrome", "pink-felt", "black-fabric")


@pytest.fixture(scope="session")
def staged(library, tmp_path_factory):
    """The extension's folder with a small catalogue."""
    folder = tmp_path_factory.mktemp("staged") / "sgd_materials"
    package.stage(folder, package.Sgdbake(library.binary), NAMES, size=32)
    return folder


@pytest.fixture
def catalogue(scene, staged, monkeypatch):
    """The enabled extension with that catalogue."""
    from sgd_materials import catalogue

    monkeypatch.setattr(catalogue, "FOLDER", staged / "catalogue")
    monkeypatch.setattr(catalogue, "MANIFEST", staged / "catalogue/manifest.json")
    catalogue.sources.cache_clear()
    yield catalogue
    catalogue.sources.cache_clear()


def test_a_material_of_the_list_onto_all_selected_objects(catalogue):
    balls = [stage.ball() for _ in range(3)]
    for ball in balls[:2]:
        ball.select_set(True)
    bpy.context.scene.cycles.shading_system = False
    assert bpy.ops.material.sgd_add(material="gold-paint") == {"FINISHED"}
    assert [ball.active_material.name for ball in balls] == ["gold-paint"] * 3
    assert balls[0].active_material.sgd_material.mode == "LOBES"
    assert bpy.context.scene.cycles.shading_system, "Lobes (OSL) turns OSL on"


def test_adding_is_undone(catalogue):
    stage.ball()
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.material.sgd_add(material="chrome")
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert bpy.context.object.active_material is None and "chrome" not in bpy.data.materials


def test_every_material_has_a_title_a_kind_and_a_picture(catalogue, library):
    from sgd_materials import browser

    assert catalogue.title("gold-paint@refit") == "Gold Paint (refit)"
    assert catalogue.kind("blue-metallic-paint2") == "Paint" and catalogue.kind("chrome-steel") == "Metal"
    assert {catalogue.kind(name) for name in library.names()} == set(catalogue.KINDS)
    assert [item[0] for item in browser.items()] == list(NAMES)
    # An icon has no number without a window.
    assert all(tuple(browser._pictures[name].image_size) == (32, 32) for name in NAMES)


def test_the_list_is_searched_by_words_and_kind(catalogue):
    from sgd_materials import browser

    chooser = bpy.context.window_manager.sgd_browser
    chooser.fill()
    assert [entry.name for entry in chooser.entries] == list(NAMES)

    def found(kind, words):
        return [name for name in NAMES if browser._matches(name, kind, words)]

    assert found("ALL", ["felt", "pink"]) == ["pink-felt"]
    assert found("ALL", ["fabric"]) == ["pink-felt", "black-fabric"], "the kind is searched too"
    assert found("Metal", []) == ["chrome"]


@pytest.fixture(scope="module")
def asset_library(library, tmp_path_factory):
    folder = tmp_path_factory.mktemp("library")
    assets_script.main(["-o", str(folder), "--sgdbake", str(library.binary), "--material", *NAMES])
    return folder


def test_the_asset_library_has_marked_materials(asset_library, scene):
    with bpy.data.libraries.load(str(asset_library / "sgd_materials.blend"), assets_only=True) as (source, target):
        assert sorted(source.materials) == sorted(NAMES)
        target.materials = list(source.materials)
    catalogs = (asset_library / "blender_assets.cats.txt").read_text()
    for made in map(bpy.data.materials.get, NAMES):
        data = made.asset_data
        assert data.catalog_id in catalogs and data.author and data.license and data.description
        assert "measured" in [tag.name for tag in data.tags]
        assert made.preview.image_size[0] == package.PICTURE_SIZE
        for mode in ("FIT", "PLAIN", "SUN", "LOBES"):
            made.sgd_material.mode = mode
            assert made.sgd_material.problem == ""


def test_a_library_is_not_overwritten_unasked(asset_library, library, capsys):
    with pytest.raises(SystemExit):
        assets_script.main(["-o", str(asset_library), "--sgdbake", str(library.binary)])
    assert "--force" in capsys.readouterr().err


def test_the_button_writes_and_registers_it(catalogue, tmp_path):
    libraries = bpy.context.preferences.filepaths.asset_libraries
    before = {library.name for library in libraries}
    kept = bpy.data.materials.new("Oak")
    for _ in range(2):  # again: refreshed, registered once
        assert bpy.ops.preferences.sgd_asset_library(directory=str(tmp_path / "lib")) == {"FINISHED"}
    added = [library for library in libraries if library.name not in before]
    assert [library.path for library in added] == [str(tmp_path / "lib")]
    assert list(bpy.data.materials) == [kept], "the open file is as it was"
    libraries.remove(added[0])


# The zip alone in a fresh Blender: a material from the list onto Suzanne, the artist's shader mixed
# in, rendered, exported, saved, reopened.
ALONE = """
import bpy, os, sys
assert bpy.ops.extensions.package_install_files(
    filepath=sys.argv[1], repo="user_default", enable_on_install=True) == {"FINISHED"}
folder = sys.argv[2]
bpy.ops.mesh.primitive_monkey_add()
assert bpy.ops.material.sgd_add(material="gold-paint") == {"FINISHED"}
shown = bpy.context.object.active_material
tree = shown.node_tree
group = next(node for node in tree.nodes if node.type == "GROUP")
output = tree.get_output_node("ALL")
mix, dirt = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfDiffuse")
tree.links.new(group.outputs["Shader"], mix.inputs[1])
tree.links.new(dirt.outputs[0], mix.inputs[2])
tree.links.new(mix.outputs[0], output.inputs["Surface"])
scene = bpy.context.scene
scene.render.engine, scene.cycles.samples = "CYCLES", 4
scene.render.resolution_x = scene.render.resolution_y = 32
scene.render.filepath = folder + "/suzanne.png"
bpy.ops.render.render(write_still=True)
assert bpy.ops.export_scene.gltf(filepath=folder + "/suzanne.glb", export_extras=True) == {"FINISHED"}
bpy.ops.wm.save_as_mainfile(filepath=folder + "/suzanne.blend")
bpy.ops.wm.open_mainfile(filepath=folder + "/suzanne.blend")
shown = bpy.data.materials["gold-paint"]
output = shown.node_tree.get_output_node("ALL")
assert output.inputs["Surface"].links[0].from_node.type == "MIX_SHADER"
shown.sgd_material.mode = "SUN"
assert shown.sgd_material.problem == ""
os._exit(0)  # Blender 4.2 crashes when it is unloaded
"""


def test_the_zip_alone(staged, tmp_path):
    archive = tmp_path / "sgd_materials.zip"
    package.packer("build", "--source-dir", staged, "--output-filepath", archive)
    package.packer("validate", archive)
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "user")}
    environment.pop("SGDBAKE_BIN", None)
    subprocess.run([sys.executable, "-c", ALONE, str(archive), str(tmp_path)], check=True, env=environment,
                   cwd=tmp_path)
    pixels = stage.read(tmp_path / "suzanne.png")
    assert pixels[12:20, 12:20, :3].mean() > 0.02
    document = (tmp_path / "suzanne.glb").read_bytes()
    length = int.from_bytes(document[12:16], "little")
    materials = {each["name"]: each for each in json.loads(document[20:20 + length])["materials"]}
    assert "SGD_materials_shifted_gamma" in materials["gold-paint"]["extensions"]


