# SPDX-License-Identifier: GPL-3.0-or-later
import json
import os
import re
import shutil
import struct
import subprocess
from pathlib import Path

import bpy
import pytest
from conftest import ROOT

import stage

VALIDATOR = ROOT / "tests/js/validate.mjs"
NAME = "SGD_materials_shifted_gamma"
MODELS = Path(os.environ.get("SGDBAKE_SHARED", ROOT.parent / "shared")) / "models"
SCENES = sorted(path for path in MODELS.rglob("*") if path.suffix in {".obj", ".gltf", ".glb"})


def read(path):
    """The JSON and the binary chunk of a .glb."""
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20:20 + length]), data[28 + length:]


def sgd_material(path):
    """The material with the extension: (extension with its textures' bytes, material, document)."""
    document, binary = read(path)
    material = next(each for each in document["materials"] if NAME in each.get("extensions", {}))
    extension = material["extensions"][NAME]
    for texture in extension.get("textures", []):
        view = document["bufferViews"][texture.pop("bufferView")]
        start = view.get("byteOffset", 0)
        texture["bytes"] = binary[start:start + view["byteLength"]]
    extension.pop("document", None)  # the hash of the document that sgdbake wrote: this one is Blender's
    return without_null(version_2(extension)), material, document


def version_2(extension):
    """The extension as version 2 writes it, whichever version it is of."""
    if extension["version"] == 2:
        return extension
    from sgd_materials import manifest

    return {**manifest.description(extension, NAME), "textures": extension["textures"]}


def without_null(value):
    """Blender's exporter leaves out members that are null, and objects that are empty then."""
    if isinstance(value, dict):
        kept = {key: without_null(each) for key, each in value.items() if each is not None}
        return {key: each for key, each in kept.items() if each != {}}
    return [without_null(each) for each in value] if isinstance(value, list) else value


@pytest.fixture
def imported(scene, glb):
    return stage.load_objects(glb)[0].active_material


def test_import_builds_every_mode(imported):
    for mode in ("LOBES", "PLAIN", "SUN", "FIT"):
        imported.sgd_material.mode = mode
        assert imported.sgd_material.problem == ""


@pytest.mark.parametrize("mode", ["FIT", "LOBES", "PLAIN", "SUN"])
def test_export_writes_the_extension_back_equal(imported, glb, tmp_path, mode):
    imported.sgd_material.mode = mode
    path = tmp_path / "again.glb"
    bpy.ops.export_scene.gltf(filepath=str(path), export_extras=True)
    before, first, _ = sgd_material(glb)
    after, second, document = sgd_material(path)
    assert after == before
    assert second["extras"]["sgd"] == {key: before[key] for key in ("version", "name", "diffuse", "lobes")}
    assert NAME in document["extensionsUsed"] and NAME not in document.get("extensionsRequired", [])
    for key, value in first["pbrMetallicRoughness"].items():
        assert second["pbrMetallicRoughness"].get(key, 1.0) == pytest.approx(value, abs=1e-6)
    assert imported.sgd_material.mode == mode
    assert "sgd_material" not in second["extras"]


def test_a_wrong_version_leaves_the_fit_and_says_so(scene, glb, tmp_path, capfd):
    path = tmp_path / "newer.glb"
    path.write_bytes(re.sub(rb'"version":[12],"name"', b'"version":7,"name"', glb.read_bytes()))
    material = stage.load_objects(path)[0].active_material
    assert not material.sgd_material.description
    assert material.node_tree.nodes["Principled BSDF"]
    assert "this extension reads versions 1 and 2" in "".join(capfd.readouterr())


def test_the_export_is_valid(imported, tmp_path):
    if shutil.which("node") is None or not VALIDATOR.with_name("node_modules").is_dir():
        pytest.skip("the glTF validator is not installed (npm ci in tests/js)")
    path = tmp_path / "again.glb"
    bpy.ops.export_scene.gltf(filepath=str(path), export_extras=True)
    report = subprocess.run(["node", VALIDATOR, path], check=True, text=True, stdout=subprocess.PIPE).stdout
    assert json.loads(report)["errors"] == []


def triangles(objects):
    for thing in objects:
        thing.data.calc_loop_triangles()
    return sum(len(thing.data.loop_triangles) for thing in objects)


def readable(path):
    """Whether this Blender reads a scene; without its Draco library (pip's 4.2) not every one."""
    try:
        stage.load_objects(path)
    except RuntimeError as error:
        assert "draco" in str(error).lower()
        return False
    finally:
        stage.clear()
    return True


@pytest.mark.skipif(not SCENES, reason=f"no scenes in {MODELS}")
@pytest.mark.parametrize("ending", ["glb", "gltf"])
@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.name)
def test_every_exported_scene_loads_with_its_material(scene, library, path, ending, tmp_path):
    if path.suffix != ".obj" and not readable(path):
        pytest.skip("this Blender has no Draco library")
    exported = tmp_path / f"scene.{ending}"
    subprocess.run([library.binary, "--quiet", "export", path, "--assign", "*=gold-paint", "-o", exported], check=True)
    inspected = subprocess.run([library.binary, "inspect", exported, "--json"], check=True, stdout=subprocess.PIPE)
    objects = stage.load_objects(exported)
    assert triangles(objects) == json.loads(inspected.stdout)["scene"]["triangles"] > 0
    for thing in objects:
        assert thing.material_slots
        for slot in thing.material_slots:
            assert json.loads(slot.material.sgd_material.description)["name"] == "gold-paint"
            slot.material.sgd_material.mode = "LOBES"
            assert slot.material.sgd_material.problem == ""
