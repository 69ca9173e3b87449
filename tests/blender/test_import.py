# SPDX-License-Identifier: GPL-3.0-or-later
import json
import shutil

import bpy
import pytest
from conftest import HARD

import stage


def imported(path, **options):
    return bpy.ops.import_scene.sgd_manifest(filepath=str(path), **options)


@pytest.fixture
def copy(manifest, tmp_path):
    """The baked folder, to be broken."""
    return shutil.copytree(manifest.parent, tmp_path / "lut") / "manifest.json"


def edited(path, change):
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))
    return path


def test_all_materials_come_in_and_no_object_changes(scene, manifest):
    ball = stage.ball()
    assert imported(manifest) == {"FINISHED"}
    assert {material.name for material in bpy.data.materials} == set(HARD)
    assert ball.active_material is None


def test_one_material_by_name(scene, manifest):
    assert imported(manifest, material="nickel", mode="FIT") == {"FINISHED"}
    assert [material.name for material in bpy.data.materials] == ["nickel"]


def test_images_are_data_and_shared(scene, manifest):
    imported(manifest)
    assert len(bpy.data.images) == 3
    for image in bpy.data.images:
        assert image.colorspace_settings.name == "Non-Color"
        assert image.name.startswith("SGD ")


def test_undo_takes_the_import_back(scene, manifest):
    bpy.ops.ed.undo_push(message="before")
    imported(manifest, material="nickel")
    bpy.ops.ed.undo_push(message="after")
    assert "nickel" in bpy.data.materials
    bpy.ops.ed.undo()
    assert "nickel" not in bpy.data.materials


@pytest.mark.parametrize("change, expected", [
    (lambda m: m.update(schema="sgdbake/manifest/9"), "this extension reads 'sgdbake/manifest/2'"),
    (lambda m: m.pop("materials"), "materials is None; expected list"),
    (lambda m: m["materials"][0]["lobes"][1].pop("f0"), "lobes[1]: f0 is None; expected list"),
    (lambda m: m["materials"][0]["lobes"][1].update(alpha="x"), "lobes[1]: alpha is 'x'; expected int or float"),
    (lambda m: m["materials"][0]["lobes"][1].update(rho_s=[0.1]), "rho_s has 1 numbers; expected 3"),
    (lambda m: m["materials"][0]["lobes"].extend(m["materials"][0]["lobes"]), "lobes has 6 entries; expected at most 3"),
    (lambda m: m["materials"][0]["mixture"]["weights"].pop(), "mixture: "),
    (lambda m: m["materials"][0].pop("mixture"), "mixture is None; expected dict"),
    (lambda m: m["materials"][0].update(fresnel_rows=[0, 0, 99]), "row is 99; fresnel has"),
    (lambda m: m["materials"][0].update(row=99), "row is 99"),
    (lambda m: m["textures"][0].update(file="gone.exr"), "gone.exr is missing"),
    (lambda m: m["textures"][0].update(size=[3, 1]), "row is"),
    (lambda m: m["textures"][0].update(size=[3, 99]), "its description says 3 x 99"),
])
def test_a_broken_manifest_is_refused_with_its_reason(scene, copy, change, expected):
    with pytest.raises(RuntimeError, match="(?s).*") as refused:
        imported(edited(copy, change))
    assert expected in str(refused.value)
    assert not bpy.data.materials


def version_1(entry):
    """A published material's entry as version 1 wrote it: three channels in place of three lobes."""
    lobes = entry["lobes"]
    channels = {name: {"rho_d": entry["diffuse"][c], "alpha": lobes[c]["alpha"], "p": lobes[c]["p"],
                       **lobes[c]["masking"], **{key: lobes[c][key][c] for key in ("rho_s", "f0", "f1")}}
                for c, name in enumerate("rgb")}
    return {"name": entry["name"], "row": entry["row"], "channels": channels, "ndf_peak": entry["ndf_peak"],
            "gltf": entry["gltf"], "lobes": entry["mixture"]}


def test_a_manifest_of_version_1_is_read_alike(scene, manifest, copy):
    from sgd_materials import lobes, manifest as reader

    def older(document):
        document["schema"] = "sgdbake/manifest/1"
        document["materials"] = [version_1(each) for each in document["materials"] if "@" not in each["name"]]

    published = [each for each in reader.read_manifest(manifest) if "@" not in each.name]
    for new, old in zip(published, reader.read_manifest(edited(copy, older)), strict=True):
        assert lobes.blends(old.description) == lobes.blends(new.description)
        assert lobes.specular(old.description) == lobes.specular(new.description)
        assert old.description["row"] == new.description["row"]


def test_not_json_and_an_unknown_name(scene, copy, manifest):
    copy.write_text("{")
    with pytest.raises(RuntimeError, match="not JSON"):
        imported(copy)
    with pytest.raises(RuntimeError, match="no material 'gold'; it has chrome"):
        imported(manifest, material="gold")


def test_an_unknown_encoding_shows_the_fit_and_says_why(scene, copy):
    def strange(document):
        for texture in document["textures"]:
            texture["encoding"]["kind"] = "runes"

    with pytest.raises(RuntimeError, match="encoding is 'runes'"):
        imported(edited(copy, strange), material="nickel", mode="SUN")
