"""One bake in every format, read by OpenEXR, by the KTX 2 specification and by OpenCV: the same
texels in each.

    python formats.py SGDBAKE
"""

import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

import lut_reader


def texels(sgdbake, folder, name, arguments):
    """Every texture of a bake of fixed size, by its quantity, with the manifest's range."""
    out = pathlib.Path(folder) / name
    command = [sgdbake, "bake", "--material", "chrome", "--material", "teflon", "-o", str(out), "--size", "24", "--quiet"]
    subprocess.run(command + arguments, check=True, stdout=subprocess.DEVNULL)
    entries = json.loads((out / "manifest.json").read_text())["textures"]
    return {(e["quantity"], e.get("row")): (lut_reader.read_texture(out, e), e) for e in entries}


def main():
    sgdbake = sys.argv[1]
    everything = ["--quantity", "ndf,masking,fresnel,albedo,brdf3d"]
    bounded = ["--quantity", "masking,fresnel,albedo"]
    with tempfile.TemporaryDirectory() as folder:
        for depth in ("half", "float"):
            exr = texels(sgdbake, folder, f"exr-{depth}", [*everything, "--depth", depth])
            ktx2 = texels(sgdbake, folder, f"ktx2-{depth}", [*everything, "--depth", depth, "--format", "ktx2"])
            assert exr.keys() == ktx2.keys() and len(exr) == 6
            for key, (expected, _) in exr.items():
                found, entry = ktx2[key]
                assert np.array_equal(expected, found), (key, depth)
                assert expected.shape[1] == entry["size"][0]
            print(f"{depth}: {len(exr)} textures equal in EXR and KTX 2")
        png = texels(sgdbake, folder, "png", [*bounded, "--format", "png"])
        for key, (codes, entry) in png.items():
            low, high = entry["range"]
            off = np.abs(codes - exr[key][0]).max()
            assert off <= 0.51 * (high - low) / 65535, (key, off)
            print(f"png {key[0]}: within half a code, {off:.1e}")


if __name__ == "__main__":
    main()
