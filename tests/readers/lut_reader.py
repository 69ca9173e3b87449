"""Decodes a bake with nothing but docs/lut-format.md, OpenEXR, OpenCV and numpy, and checks it
against `sgdbake eval`.

    python lut_reader.py SGDBAKE BAKE_DIR [--viewers N] [--lights N] [--seed S]

For random pairs and pairs mirrored about random half vectors of every material in the manifest,
|f_lut - f| cos(theta_i) must stay below tolerance * (max over wi of |f| cos(theta_i) for that wo
+ |f| cos(theta_i)). The maximum is taken over the lights drawn, so it is never overestimated.
Exit code 1 names the worst pair that breaks the promise.
"""

import argparse
import csv
import json
import pathlib
import struct
import subprocess
import sys
import tempfile

import cv2
import numpy as np
import OpenEXR


def read_exr(path, entry):
    with OpenEXR.File(str(path)) as file:
        assert json.loads(file.header()["sgdbake"]) == entry, "attribute and manifest differ"
        return file.channels()["RGB"].pixels


def read_ktx2(path, entry):
    """The one level of a KTX 2 file, as its specification lays it out; alpha is dropped."""
    data = path.read_bytes()
    assert data[:12] == b"\xabKTX 20\xbb\r\n\x1a\n"
    vk_format, _, *size = struct.unpack_from("<5I", data, 12)
    assert [n for n in size if n] == entry["size"], size
    offset, length = struct.unpack_from("<2Q", data, 80)
    dtype = {97: np.float16, 109: np.float32}[vk_format]
    texels = np.frombuffer(data, dtype, length // np.dtype(dtype).itemsize, offset)
    return texels.reshape(-1, size[0], 4)[..., :3]


def read_png(path, entry):
    """16-bit codes; Pillow and most viewers reduce them to 8, OpenCV keeps them (as BGR)."""
    codes = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)[..., ::-1]
    assert codes.dtype == np.uint16, codes.dtype
    low, high = entry["range"]
    return low + (high - low) * (codes / 65535.0)


def read_texture(folder, entry):
    """Rows x width x 3 texels, row 0 first; the slices of a 3D texture follow one another."""
    read = {"exr": read_exr, "ktx2": read_ktx2, "png": read_png}[entry["format"]]
    pixels = read(folder / entry["file"], entry)
    expected = {"half": np.float16, "float": np.float32, "unorm16": np.float64}[entry["depth"]]
    assert pixels.dtype == expected, pixels.dtype
    return pixels.astype(np.float64)


def coordinate(warp, row, x):
    """u of the format's table of warps."""
    if warp["kind"] == "identity":
        return x
    scale = warp["scale"][row]
    if warp["kind"] == "log1p":
        most = warp["max"][row]
        return np.log1p(np.minimum(x, most) / scale) / np.log1p(most / scale)
    if warp["kind"] == "rational":
        with np.errstate(divide="ignore"):
            return 1.0 / (1.0 + scale / x)
    raise SystemExit(f"unknown warp {warp['kind']}")


def lookup(texels, row, u, eight_bit):
    """Linear filtering between texel centres, with exact or with 8-bit weights."""
    width = texels.shape[1]
    position = u * (width - 1)
    if eight_bit:
        position = np.round(position * 256) / 256
    left = np.minimum(position.astype(int), width - 2)
    weight = (position - left)[:, None]
    return texels[row, left] * (1 - weight) + texels[row, left + 1] * weight


def lookup_3d(texels, size, u, eight_bit):
    """Trilinear filtering of slices that follow one another."""
    volume = texels.reshape(size[2], size[1], size[0], 3)
    low, weight = [], []
    for n, coordinate in zip(size, u):
        position = coordinate * (n - 1)
        if eight_bit:
            position = np.round(position * 256) / 256
        low.append(np.minimum(position.astype(int), n - 2))
        weight.append(position - low[-1])
    result = 0
    for corner in np.ndindex(2, 2, 2):
        share = np.prod([w if c else 1 - w for c, w in zip(corner, weight)], axis=0)
        i, j, k = (start + c for c, start in zip(corner, low))
        result = result + share[:, None] * volume[k, j, i]
    return result


def three(of_lobes):
    """One number per lobe, 0 for those that the material does not have."""
    return np.pad(np.array(of_lobes, dtype=float), (0, 3 - len(of_lobes)))


class Decoder:
    def __init__(self, folder):
        self.manifest = json.loads((folder / "manifest.json").read_text())
        assert self.manifest["schema"] == "sgdbake/manifest/2"
        textures = self.manifest["textures"]
        self.texels = {t["file"]: read_texture(folder, t) for t in textures}
        self.entries = {t["quantity"]: t for t in textures if "row" not in t}
        self.volumes = {t["row"]: t for t in textures if "row" in t}

    def value(self, quantity, material, x, eight_bit, row=None):
        """Three numbers each: one per lobe, of fresnel one per colour of the lobe whose row it is."""
        entry, row = self.entries[quantity], material["row"] if row is None else row
        u = coordinate(entry["axes"][0]["warp"], row, x)
        texel = lookup(self.texels[entry["file"]], row, u, eight_bit)
        encoding = entry["encoding"]
        if encoding["kind"] == "identity":
            return texel
        if encoding["factor"] == "u":
            return u[:, None] * np.exp(texel)
        return three(material[encoding["factor"]]) * np.exp(texel)

    def brdf(self, material, wi, wo, eight_bit):
        diffuse = np.broadcast_to(np.array(material["diffuse"]) / np.pi, wi.shape)
        if material["row"] is None:
            return diffuse
        h = wi + wo
        tan2_h = (h[:, 0] / h[:, 2]) ** 2 + (h[:, 1] / h[:, 2]) ** 2
        cos_d = np.minimum(np.linalg.norm(h, axis=1) / 2, 1)
        if not self.entries:
            rho_s = sum(np.array(lobe["rho_s"]) for lobe in material["lobes"])
            return diffuse + rho_s / np.pi * self.volume(material, wi, wo, tan2_h, cos_d, eight_bit)
        with np.errstate(divide="ignore"):
            cot_i, cot_o = (w[:, 2] / np.hypot(w[:, 0], w[:, 1]) for w in (wi, wo))
        value = lambda quantity, x: self.value(quantity, material, x, eight_bit)
        ndf = value("ndf", tan2_h) * (1 + tan2_h[:, None]) ** 2
        g1 = value("masking", cot_i) * value("masking", cot_o)
        cosines = (wi[:, 2] * wo[:, 2])[:, None]
        lobes = ndf * g1 / cosines
        for j, (lobe, row) in enumerate(zip(material["lobes"], material["fresnel_rows"], strict=True)):
            fresnel = self.value("fresnel", material, cos_d, eight_bit, row)
            diffuse = diffuse + np.array(lobe["rho_s"]) / np.pi * fresnel * lobes[:, j : j + 1]
        return diffuse

    def volume(self, material, wi, wo, tan2_h, cos_d, eight_bit):
        """B, the lobes' F D G1 G1/(cos cos) weighted by their shares of rho_s, from the 3D texture of the material's row."""
        entry = self.volumes[material["row"]]
        sin_h = np.sqrt(tan2_h / (1 + tan2_h))
        with np.errstate(invalid="ignore", divide="ignore"):
            cos_phi = np.abs(wi[:, 2] - wo[:, 2]) / (sin_h * np.linalg.norm(wi - wo, axis=1))
        variables = {"tan2_theta_h": tan2_h, "cos_theta_d": cos_d,
                     "abs_cos_phi_d": np.minimum(np.nan_to_num(cos_phi), 1)}
        u = [coordinate(a["warp"], 0, variables[a["variable"]]) for a in entry["axes"]]
        texel = lookup_3d(self.texels[entry["file"]], entry["size"], u, eight_bit)
        assert entry["encoding"]["kind"] == "times"
        return np.array(entry["encoding"]["factor"]) * texel


def directions(rng, count):
    """Half of them even over the hemisphere, half near the horizon on a logarithmic scale."""
    cos = rng.uniform(0, 1, count)
    cos[count // 2 :] = 10 ** rng.uniform(-5, 0, count - count // 2)
    phi = rng.uniform(0, 2 * np.pi, count)
    sin = np.sqrt(1 - cos**2)
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=1)


def pairs(rng, material, viewers, lights):
    """For each viewer: lights anywhere, and lights mirrored about half vectors of all widths."""
    alphas = [lobe["alpha"] for lobe in material["lobes"]] or [0.1]
    wo = np.repeat(directions(rng, viewers), lights, axis=0)
    count = len(wo)
    tan = np.exp(rng.uniform(np.log(0.3 * min(alphas)), 0.5 * np.log(40 * max(alphas)), count))
    phi = rng.uniform(0, 2 * np.pi, count)
    in_plane = rng.random(count) < 0.3
    phi[in_plane] = np.arctan2(wo[in_plane, 1], wo[in_plane, 0]) + np.pi * (rng.random(in_plane.sum()) < 0.5)
    h = np.stack([tan * np.cos(phi), tan * np.sin(phi), np.ones(count)], axis=1)
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    wi = 2 * np.sum(wo * h, axis=1, keepdims=True) * h - wo
    anywhere = (rng.random(count) < 0.25) | (wi[:, 2] <= 1e-9)
    wi[anywhere] = directions(rng, anywhere.sum())
    return wi / np.linalg.norm(wi, axis=1, keepdims=True), wo


def exact(sgdbake, name, masking, wi, wo):
    """f per channel from `sgdbake eval`, in double precision."""
    with tempfile.NamedTemporaryFile("w", suffix=".csv") as file:
        file.write("wi_x,wi_y,wi_z,wo_x,wo_y,wo_z\n")
        csv.writer(file).writerows(np.hstack([wi, wo]).tolist())
        file.flush()
        command = [sgdbake, "eval", "--material", name, "--masking", masking, "--pairs", file.name, "--json"]
        lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    records = map(json.loads, lines)
    return np.array([[record[c]["brdf"] for c in "rgb"] for record in records])


def worst(decoder, sgdbake, masking, material, rng, viewers, lights):
    wi, wo = pairs(rng, material, viewers, lights)
    f = exact(sgdbake, material["name"], masking, wi, wo)
    cos_i = wi[:, 2:]
    reflected = np.abs(f) * cos_i
    most = np.repeat(reflected.reshape(viewers, lights, 3).max(axis=1), lights, axis=0)
    result = 0.0, None
    for eight_bit in (False, True):
        decoded = decoder.brdf(material, wi, wo, eight_bit)
        assert np.isfinite(decoded).all(), material["name"]
        with np.errstate(invalid="ignore"):
            error = np.nan_to_num(np.abs(decoded - f) * cos_i / (most + reflected))
        at = np.unravel_index(error.argmax(), error.shape)
        if error[at] > result[0]:
            result = error[at], (wi[at[0]].tolist(), wo[at[0]].tolist(), "rgb"[at[1]])
    return result


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("sgdbake")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--viewers", type=int, default=100)
    parser.add_argument("--lights", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--masking", default="exact")
    arguments = parser.parse_args()
    decoder = Decoder(arguments.folder)
    tolerance = min(t["error"]["tolerance"] for t in decoder.manifest["textures"])
    rng = np.random.default_rng(arguments.seed)
    broken = False
    for material in decoder.manifest["materials"]:
        error, pair = worst(decoder, arguments.sgdbake, arguments.masking, material, rng,
                            arguments.viewers, arguments.lights)
        print(f"{material['name']}: {arguments.viewers * arguments.lights} pairs, "
              f"largest error {error:.3e}, promised {tolerance:.0e}")
        if error > tolerance:
            broken = True
            print(f"  broken at wi, wo, channel {pair}")
    sys.exit(broken)


if __name__ == "__main__":
    main()
