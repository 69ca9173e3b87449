# SPDX-License-Identifier: GPL-3.0-or-later
"""What the binary bakes and exports, and the scripts under test on the path."""

import os
import subprocess
import sys
from pathlib import Path

import bpy  # noqa: F401  first: the modules below come with it
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "blender"))

import stage  # noqa: E402
import truth  # noqa: E402

# Hard in their own way each: sharpest and oddest peak (chrome, steel), widths 15 times apart
# (gold-metallic-paint2), Fresnel below 0 (white-paint, white-fabric2) and above 1 (alum-bronze,
# beige-fabric, nickel), p > 1 (pink-fabric), rho_s of almost 0 (black-fabric), wide with strong
# masking (black-oxidized-steel), a plain one (gold-paint), two lobes that
# colour every channel (gold-paint@refit).
HARD = ("chrome", "steel", "gold-metallic-paint2", "white-paint", "white-fabric2", "alum-bronze", "beige-fabric",
        "nickel", "pink-fabric", "black-fabric", "black-oxidized-steel", "gold-paint",
        "gold-paint@refit")


def pytest_sessionfinish(session, exitstatus):
    session.config.add_cleanup(lambda: stage.leave(int(exitstatus)))


@pytest.fixture(scope="session")
def library():
    binary = Path(os.environ.get("SGDBAKE_BIN", ROOT / "target/debug/sgdbake"))
    if not binary.is_file():
        pytest.skip(f"{binary} is not built (cargo build)")
    return truth.Library(binary)


@pytest.fixture(scope="session")
def manifest(library, tmp_path_factory):
    """The hard materials' textures and manifest.json."""
    return library.bake(HARD, tmp_path_factory.mktemp("lut") / "hard")


@pytest.fixture(scope="session")
def glb(library, tmp_path_factory):
    """The preview ball in alum-bronze."""
    path = tmp_path_factory.mktemp("glb") / "ball.glb"
    subprocess.run([library.binary, "--quiet", "export", "--shape", "ball", "--assign", "*=alum-bronze",
                    "-o", path], check=True)
    return path


@pytest.fixture
def scene():
    return stage.clear()
