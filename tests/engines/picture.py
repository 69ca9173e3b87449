"""The pictures that the engines are compared in: the pixels of a ball under suns, and colour differences."""
import numpy as np
from skimage import color

SUNS = (15, 40, 70, 110, 140)  # degrees from the view, towards +x
SIZE = 48
EDGE = 0.94  # squared radius within which pixels count
HORIZON = 0.05  # least cosine of the light to the normal
XYZ = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]])


def normals(size=SIZE):
    """Normals of the ball at the pixels' centres, rows upwards, and the squared radius."""
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size * 2 - 1
    r2 = x * x + y * y
    return np.stack([x, y, np.sqrt(np.clip(1 - r2, 0, 1))], -1), r2


class SunPixels:
    """The lit pixels of the ball under each sun, one after another: which they are, and wi, wo in their local frames."""

    def __init__(self, suns=SUNS, size=SIZE):
        normal, r2 = normals(size)
        self.masks, wi, wo = [], [], []
        for angle in np.radians(suns):
            light = np.array([np.sin(angle), 0, np.cos(angle)])
            mask = (r2 < EDGE) & (normal @ light > HORIZON)
            n = normal[mask]
            t = np.cross(n, [0.3, 0.9, 0.1])
            t /= np.linalg.norm(t, axis=1)[:, None]
            b = np.cross(n, t)
            self.masks.append(mask)
            for out, w in ((wi, light), (wo, np.array([0, 0, 1.0]))):
                out.append(np.stack([t @ w, b @ w, n @ w], 1))
        self.wi, self.wo = np.vstack(wi), np.vstack(wo)

    def read(self, path, size=SIZE):
        """The lit pixels' radiance in a file of draw.mjs or blender.py."""
        pictures = np.fromfile(path, "<f4").reshape(-1, size, size, 3)
        return np.vstack([picture[mask] for picture, mask in zip(pictures, self.masks)]).astype(float)

    def radiance(self, f):
        """Under suns of irradiance pi."""
        return np.pi * self.wi[:, 2:] * f


def delta_e(a, b):
    """CIEDE2000 of linear sRGB radiances, clipped at white (D65)."""
    lab = [color.xyz2lab(np.clip(x, 0, 1) @ XYZ.T) for x in (a, b)]
    return color.deltaE_ciede2000(*lab)
