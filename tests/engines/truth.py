"""What the pictures are held against: the material itself, exactly, and the measurement it was fitted to."""
import csv
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR

ROOT = Path(__file__).resolve().parents[2]
LAYERS = ("w1", "b1", "w2", "b2", "w3", "b3")


def exact(binary, name, wi, wo):
    """f [1/sr] of a material by `sgdbake eval`, in double precision with exact masking."""
    with tempfile.NamedTemporaryFile("w", suffix=".csv", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z"])
        writer.writerows(np.hstack([wi, wo]).tolist())
        file.flush()
        lines = subprocess.run([str(binary), "--quiet", "eval", "--material", name, "--pairs", file.name, "--json"],
                               check=True, text=True, stdout=subprocess.PIPE).stdout.splitlines()
    pairs = [json.loads(line) for line in lines]
    return np.array([[pair[c]["brdf"] for c in "rgb"] for pair in pairs])  # of one lobe or several alike


def under_environment(binary, surface, panorama, size, samples=16384):
    """Radiance of the ball by `sgdbake preview`, size x size x 3, rows upwards: the mean over each pixel.

    surface: ["--material", NAME] or ["--measured", FILE].
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "ball.exr"
        subprocess.run([str(binary), "--quiet", "preview", *surface, "--environment", str(panorama),
                        "--size", str(size), "--samples", str(samples), "-o", str(path)], check=True, stdout=subprocess.DEVNULL)
        (channels,) = OpenEXR.File(str(path)).channels().values()
    return channels.pixels[::-1, :, :3].astype(float)


def networks(folder):
    """The networks that stand in for the measurements, by material; {} where the folder is absent."""
    found = {}
    for name in ("networks.json", "merl.json"):
        if (Path(folder) / name).is_file():
            for key, net in json.loads((Path(folder) / name).read_text()).items():
                found[key.split("/")[1]] = [np.array(net[layer], float) for layer in LAYERS]
    return found


def measured(net, wi, wo):
    """f [1/sr] of a network (Sztrajman et al. 2021), averaged over φd, −φd, φd + π and π − φd."""
    h = wi + wo
    h /= np.linalg.norm(h, axis=1)[:, None]
    theta_h, phi = np.arctan2(np.hypot(h[:, 0], h[:, 1]), h[:, 2]), np.arctan2(h[:, 1], h[:, 0])
    x, y = np.cos(phi) * wi[:, 0] + np.sin(phi) * wi[:, 1], -np.sin(phi) * wi[:, 0] + np.cos(phi) * wi[:, 1]
    x, z = np.cos(theta_h) * x - np.sin(theta_h) * wi[:, 2], np.sin(theta_h) * x + np.cos(theta_h) * wi[:, 2]
    theta_d, phi_d = np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)
    total = 0
    for angle in (phi_d, -phi_d, phi_d + np.pi, np.pi - phi_d):
        a = np.stack([np.sin(theta_h), 0 * theta_h, np.cos(theta_h),
                      np.sin(theta_d) * np.cos(angle), np.sin(theta_d) * np.sin(angle), np.cos(theta_d)], 1)
        a = np.maximum(a @ net[0] + net[1], 0)
        a = np.maximum(a @ net[2] + net[3], 0)
        total = total + np.maximum(np.exp(a @ net[4] + net[5]) - 1, 0)
    return total / 4
