# SPDX-License-Identifier: GPL-3.0-or-later
"""Validated, built, installed and removed by Blender's own tools."""

import os
import subprocess
import sys
from pathlib import Path

import addon_utils
import bpy
import pytest
from conftest import ROOT

SOURCE = ROOT / "blender/sgd_materials"


@pytest.fixture(scope="module")
def packer():
    scripts = Path(bpy.utils.resource_path("LOCAL")) / "scripts/addons_core/bl_pkg/cli/blender_ext.py"
    return [sys.executable, str(scripts)]


@pytest.fixture(scope="module")
def package(packer, tmp_path_factory):
    path = tmp_path_factory.mktemp("zip") / "sgd_materials.zip"
    subprocess.run([*packer, "build", "--source-dir", SOURCE, "--output-filepath", path], check=True)
    return path


def test_blender_validates_it(packer, package):
    subprocess.run([*packer, "validate", SOURCE], check=True)
    subprocess.run([*packer, "validate", package], check=True)


INSTALL = """
import bpy, sys
import addon_utils
before = {name for name in dir(bpy.types) if "SGD" in name}
assert bpy.ops.extensions.package_install_files(
    filepath=sys.argv[1], repo="user_default", enable_on_install=True) == {"FINISHED"}
assert "bl_ext.user_default.sgd_materials" in bpy.context.preferences.addons
assert hasattr(bpy.types.Material, "sgd_material") and hasattr(bpy.ops.import_scene, "sgd_manifest")
addon_utils.disable("bl_ext.user_default.sgd_materials", default_set=True)
assert not hasattr(bpy.types.Material, "sgd_material")
assert {name for name in dir(bpy.types) if "SGD" in name} == before == set()
assert not [f for f in bpy.types.TOPBAR_MT_file_import._dyn_ui_initialize() if "sgd" in f.__module__]
"""


def test_the_zip_installs_and_leaves_nothing_behind(package, tmp_path):
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path)}
    subprocess.run([sys.executable, "-c", INSTALL, package], check=True, env=environment)


def test_disabling_removes_every_class(scene):
    addon_utils.disable("sgd_materials", default_set=True)
    assert not hasattr(bpy.types.Material, "sgd_material")
    assert not [name for name in dir(bpy.types) if "SGD" in name]
