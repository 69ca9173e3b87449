"""Mitsuba 3's plugin `measured` reads the .bsdf files that `sgdbake tabulate` writes: its values
against `sgdbake eval`, its sampled albedo against `sgdbake sample`, and a picture of a ball against
values of `sgdbake eval` at its pixels."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

SGDBAKE = sys.argv[1]
MATERIALS = ["gold-paint", "alum-bronze", "white-paint", "pink-fabric", "gold-metallic-paint2"]


def sgdbake(*arguments):
    return subprocess.run([SGDBAKE, *map(str, arguments)], check=True, capture_output=True, text=True).stdout


def reference(material, wi, wo, folder):
    """f of pairs of directions, by the library."""
    pairs = folder / "pairs.csv"
    np.savetxt(pairs, np.hstack([wi, wo]), delimiter=",", header="wi_x,wi_y,wi_z,wo_x,wo_y,wo_z", comments="", fmt="%.17g")
    lines = sgdbake("eval", "--material", material, "--pairs", pairs, "--json").splitlines()
    return np.array([[json.loads(line)[c]["brdf"] for c in "rgb"] for line in lines])


def pairs(count, generator):
    """Pairs up to 80 degrees from the normal: half vectors even in the root of their angle."""
    found = []
    while len(found) < count:
        h, d, phi = generator.random(3)
        th, td, phi, turn = np.pi / 2 * h * h, np.pi / 2 * d, 2 * np.pi * phi, 2 * np.pi * generator.random()
        frame = np.array([[np.sin(th), 0, np.cos(th)], [np.cos(th), 0, -np.sin(th)], [0, 1, 0]])
        side = np.sin(td) * (np.cos(phi) * frame[1] + np.sin(phi) * frame[2])
        pair = np.array([np.cos(td) * frame[0] + side, np.cos(td) * frame[0] - side])
        c, s = np.cos(turn), np.sin(turn)
        pair = pair @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        if pair[:, 2].min() > np.cos(np.radians(80)):
            found.append(pair)
    found = np.array(found)
    return found[:, 0], found[:, 1]


def interaction(wi):
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(*map(float, wi))
    si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
    return si


def evaluate(bsdf, wi, wo):
    """f by Mitsuba: its value holds the cosine of the second direction."""
    context = mi.BSDFContext()
    return np.array([np.array(bsdf.eval(context, interaction(i), mi.Vector3f(*map(float, o)), True)) / o[2] for i, o in zip(wi, wo)])


def values_agree(material, bsdf, folder):
    wi, wo = pairs(3000, np.random.default_rng(22))
    exact, found = reference(material, wi, wo, folder), evaluate(bsdf, wi, wo)
    exact = np.maximum(exact, 0)
    errors = np.sort(np.abs(found - exact).sum(1) / exact.sum(1))
    median, most, largest = errors[len(errors) // 2], errors[int(0.95 * len(errors))], errors[-1]
    print(f"{material}: relative error of f at 3000 pairs: median {median:.3%}, 95 % below {most:.2%}, largest {largest:.1%}")
    assert np.isfinite(found).all() and (found >= 0).all()
    assert median < 0.003 and most < 0.03, "the file does not say what the library says"


def samples_agree(material, bsdf):
    """The mean weight of Mitsuba's own samples is the albedo, their density is what `pdf` says."""
    context, generator = mi.BSDFContext(), np.random.default_rng(7)
    for theta in (20, 60):
        wi = np.array([np.sin(np.radians(theta)), 0, np.cos(np.radians(theta))])
        weights = []
        for sample in generator.random((20000, 2)):
            drawn, weight = bsdf.sample(context, interaction(wi), 0.5, mi.Point2f(*map(float, sample)), True)
            weights.append(np.array(weight) if drawn.pdf > 0 else np.zeros(3))
        weights = np.array(weights)
        mean, error = weights.mean(0), weights.std(0) / np.sqrt(len(weights))
        stated = json.loads(sgdbake("sample", "--material", material, "--wo", ",".join(map(str, wi)), "-n", 2, "--json"))
        albedo = np.array([stated[c]["quadrature"] for c in "rgb"])
        print(f"{material}: albedo at {theta} degrees {mean.round(4)} ± {error.round(4)}, quadrature {albedo.round(4)}")
        assert (np.abs(mean - albedo) < 4 * error + 0.01 * albedo).all()


def picture_agrees(material, path, folder, size=48):
    """A ball under a distant light, orthographic: radiance f cos of each pixel's centre."""
    light = np.array([0.5, 0.4, 0.7681])
    light /= np.linalg.norm(light)
    scene = mi.load_dict({
        "type": "scene",
        "integrator": {"type": "direct", "bsdf_samples": 0, "emitter_samples": 1},
        "sensor": {
            "type": "orthographic",
            "to_world": mi.ScalarTransform4f().look_at(origin=[0, 0, 4], target=[0, 0, 0], up=[0, 1, 0]),
            "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}, "pixel_format": "rgb"},
            "sampler": {"type": "multijitter", "sample_count": 64},
        },
        "ball": {"type": "sphere", "bsdf": {"type": "measured", "filename": str(path)}},
        "light": {"type": "directional", "direction": [float(-x) for x in light], "irradiance": {"type": "rgb", "value": 1.0}},
    })
    image = np.array(mi.render(scene, seed=1))
    row, column = np.mgrid[0:size, 0:size]
    y, x = 1 - (row + 0.5) * 2 / size, (column + 0.5) * 2 / size - 1
    normal = np.stack([x, y, np.sqrt(np.clip(1 - x * x - y * y, 0, 1))], -1)
    # Away from the silhouette and the terminator, where a pixel is not like its centre.
    inside = (x * x + y * y < 0.9) & (normal @ light > 0.15)
    n, seen = normal[inside], image[inside]
    t = np.cross(n, [0.3, 0.9, 0.1])
    t /= np.linalg.norm(t, axis=1)[:, None]
    b = np.cross(n, t)
    local = lambda w: np.stack([t @ w, b @ w, n @ w], 1)
    wi, wo = local(light), local(np.array([0, 0, 1.0]))
    exact = np.maximum(reference(material, wi, wo, folder), 0) * wi[:, 2:]
    error = np.abs(seen - exact).mean() / exact.mean()
    print(f"{material}: a ball of {size} pixels, mean difference {error:.2%} of the mean radiance")
    assert error < 0.02 and image.min() >= 0
    return image


def main():
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for material in MATERIALS:
            path = folder / f"{material}.bsdf"
            print(sgdbake("tabulate", "--material", material, "-o", path, "--quiet").splitlines()[-1])
            bsdf = mi.load_dict({"type": "measured", "filename": str(path)})
            values_agree(material, bsdf, folder)
            samples_agree(material, bsdf)
            image = picture_agrees(material, path, folder)
            if len(sys.argv) > 2:
                mi.util.write_bitmap(str(Path(sys.argv[2]) / f"{material}.png"), image)


main()
