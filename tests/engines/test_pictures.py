"""Pictures of three.js and the Khronos viewer against their forms. pytest; needs Chromium and `npm ci` in this folder."""
import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import forms
from picture import SunPixels

HERE = Path(__file__).resolve().parent
CHROMIUM = os.environ.get("CHROMIUM", "/usr/bin/chromium")
SIZE = 24


@pytest.mark.skipif(not (shutil.which("node") and Path(CHROMIUM).exists() and (HERE / "node_modules").is_dir()),
                    reason="needs node, chromium and tests/engines/node_modules")
@pytest.mark.parametrize("engine", ["three", "khronos"])
def test_every_pixel_is_the_form(engine, tmp_path):
    subprocess.run(["node", HERE / "draw.mjs", engine, HERE / "probe.json", tmp_path, "--size", str(SIZE)], check=True)
    pixels = SunPixels(size=SIZE)
    angles = forms.Angles.of(pixels.wi, pixels.wo)
    for entry in json.loads((HERE / "probe.json").read_text()):
        expected = pixels.radiance(forms.FORMS[engine](forms.Material.from_gltf(entry["material"]), angles))
        seen = pixels.read(tmp_path / f"{entry['label']}.f32", SIZE)
        np.testing.assert_allclose(seen, expected, rtol=0.01, atol=1e-5, err_msg=entry["label"])
