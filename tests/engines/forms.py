"""The glTF material as five engines evaluate it under a directional light. NumPy.

docs/engine-forms.md gives the formulas with the lines of each engine's source; test_forms.py and the pictures of
scripts/engines.sh check them. A form takes a `Material` and the `Angles` of pairs of directions and returns the
reflectance f [1/sr], one row of r, g, b per pair: radiance = irradiance · cosθi · f.

    import forms
    material = forms.Material.from_gltf(gltf["materials"][0])
    f = forms.FORMS["three"](material, forms.Angles.of(wi, wo))
"""
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

PI = np.pi


@dataclass
class Material:
    """glTF metallic-roughness with KHR_materials_ior, _specular, _clearcoat and _sheen; colours linear sRGB."""
    base: np.ndarray = field(default_factory=lambda: np.ones(3))
    metallic: float = 1.0
    roughness: float = 1.0
    specular: float = 1.0
    specular_color: np.ndarray = field(default_factory=lambda: np.ones(3))
    ior: float = 1.5
    coat: float = 0.0
    coat_roughness: float = 0.0
    sheen: np.ndarray = field(default_factory=lambda: np.zeros(3))
    sheen_roughness: float = 0.0

    @property
    def has_specular(self):
        """Whether `KHR_materials_specular` says anything: a file without it and one of its defaults differ in Filament."""
        return self.specular != 1 or (self.specular_color != 1).any()

    @classmethod
    def from_gltf(cls, material):
        pbr, ext = material.get("pbrMetallicRoughness", {}), material.get("extensions", {})
        specular, coat, sheen = (ext.get("KHR_materials_" + name, {}) for name in ("specular", "clearcoat", "sheen"))
        return cls(base=np.array(pbr.get("baseColorFactor", [1, 1, 1, 1])[:3], float),
                   metallic=pbr.get("metallicFactor", 1.0), roughness=pbr.get("roughnessFactor", 1.0),
                   specular=specular.get("specularFactor", 1.0),
                   specular_color=np.array(specular.get("specularColorFactor", [1, 1, 1]), float),
                   ior=ext.get("KHR_materials_ior", {}).get("ior", 1.5),
                   coat=coat.get("clearcoatFactor", 0.0), coat_roughness=coat.get("clearcoatRoughnessFactor", 0.0),
                   sheen=np.array(sheen.get("sheenColorFactor", [0, 0, 0]), float),
                   sheen_roughness=sheen.get("sheenRoughnessFactor", 0.0))

    @property
    def ior_f0(self):
        return ((self.ior - 1) / (self.ior + 1)) ** 2


@dataclass
class Angles:
    """Cosines of pairs of directions: i, o to the normal, h of the half vector to the normal, d of wi to it."""
    i: np.ndarray
    o: np.ndarray
    h: np.ndarray
    d: np.ndarray

    @classmethod
    def of(cls, wi, wo):
        h = wi + wo
        h = h / np.linalg.norm(h, axis=-1, keepdims=True)
        return cls(wi[..., 2], wo[..., 2], h[..., 2], (wi * h).sum(-1))


# ---------------------------------------------------------------- terms that the engines share
def d_ggx(alpha, h):
    return alpha**2 / (PI * (h * h * (alpha**2 - 1) + 1) ** 2)


def v_correlated(alpha, i, o):
    """G2/(4 cosθi cosθo) of height-correlated Smith."""
    a2 = alpha**2
    return 0.5 / (i * np.sqrt(o * o * (1 - a2) + a2) + o * np.sqrt(i * i * (1 - a2) + a2))


def v_fast(alpha, i, o):
    """Hammon's approximation of v_correlated."""
    return 0.5 / ((1 - alpha) * 2 * i * o + alpha * (i + o))


def v_kelemen(d):
    return 0.25 / (d * d)


def d_charlie(alpha, h):
    return (2 + 1 / alpha) * np.maximum(1 - h * h, 0) ** (0.5 / alpha) / (2 * PI)


def v_neubelt(i, o):
    return 1 / (4 * (i + o - i * o))


def v_sheen_smith(alpha, i, o):
    """Estevez and Kulla's masking of Charlie, clamped as the Khronos viewer does."""
    def lam(cos):
        t = (1 - alpha) ** 2
        p, q, r, s, u = (low + (high - low) * t for low, high in (
            (21.5473, 25.3245), (3.82987, 3.32435), (0.19823, 0.16801), (-1.97760, -1.27393), (-4.32054, -4.85967)))

        def curve(x):
            return p / (1 + q * x**r) + s * x + u
        return np.exp(np.where(cos < 0.5, curve(np.minimum(cos, 0.5)), 2 * curve(0.5) - curve(np.maximum(1 - cos, 0))))
    return np.clip(1 / ((1 + lam(i) + lam(o)) * 4 * i * o), 0, 1)


def schlick(f0, f90, cos):
    """One row per cosine; f0 and f90 are colours or numbers."""
    weight = (1 - cos)[:, None] ** 5
    return f0 + (f90 - f0) * weight


# ---------------------------------------------------------------- directional albedos
def visible_normals(roughness, mu, n=48):
    """cosθd and cosθi of n² stratified GGX normals visible from cosθo = mu (Heitz 2018)."""
    alpha, u = roughness**2, (np.arange(n) + 0.5) / n
    u1, u2 = (x.ravel() for x in np.meshgrid(u, u))
    wo = np.array([np.sqrt(max(1 - mu * mu, 0)), 0, mu])
    stretched = wo * [alpha, alpha, 1]
    stretched /= np.linalg.norm(stretched)
    side = np.hypot(stretched[0], stretched[1])
    t1 = np.array([0, 1.0, 0]) if side > 1e-7 else np.array([1.0, 0, 0])
    t2 = np.cross(stretched, t1)
    r, phi = np.sqrt(u1), 2 * PI * u2
    x, y = r * np.cos(phi), r * np.sin(phi)
    blend = 0.5 * (1 + stretched[2])
    y = (1 - blend) * np.sqrt(1 - x * x) + blend * y
    h = x[:, None] * t1 + y[:, None] * t2 + np.sqrt(np.maximum(1 - x * x - y * y, 0))[:, None] * stretched
    h *= [alpha, alpha, 1]
    h /= np.linalg.norm(h, axis=1)[:, None]
    d = h @ wo
    return d, 2 * d * h[:, 2] - mu


def masked(roughness, mu, i):
    """G2/G1(wo) of height-correlated Smith, 0 below the horizon: the weight of a visible normal."""
    def lam(cos):
        cos = np.maximum(cos, 1e-9)
        return 0.5 * (np.sqrt(1 + roughness**4 * (1 / cos**2 - 1)) - 1)
    return np.where(i > 0, (1 + lam(mu)) / (1 + lam(mu) + lam(i)), 0)


def ggx_albedo(roughness, mu):
    """E: directional albedo of the correlated GGX lobe with F = 1."""
    _, i = visible_normals(roughness, mu)
    return masked(roughness, mu, i).mean()


class Table:
    """A function on a grid of nodes, read linearly between them and clamped outside."""

    def __init__(self, function, *axes):
        self.axes = [np.asarray(a, float) for a in axes]
        grid = np.array([function(*x) for x in zip(*(g.ravel() for g in np.meshgrid(*self.axes, indexing="ij")))])
        self.values = grid.reshape([len(a) for a in self.axes])

    def __call__(self, *x):
        values, x = self.values, np.broadcast_arrays(*(np.asarray(v, float) for v in x))
        total, spans = 0, []
        for axis, at in zip(self.axes, x):
            at = np.clip(at, axis[0], axis[-1])
            k = np.clip(np.searchsorted(axis, at, side="right") - 1, 0, len(axis) - 2)
            spans.append((k, (at - axis[k]) / (axis[k + 1] - axis[k])))
        for corner in np.ndindex(*(2,) * len(spans)):
            weight, index = 1, []
            for bit, (k, t) in zip(corner, spans):
                weight = weight * (t if bit else 1 - t)
                index.append(k + bit)
            total = total + weight * values[tuple(index)]
        return total


def texel_centres(n):
    return (np.arange(n) + 0.5) / n


@lru_cache
def albedo_fine():
    """E on 64 by 64 texels. Filament's and Babylon's textures hold it one row off: read at roughness + 1/rows."""
    return Table(ggx_albedo, np.maximum(texel_centres(64), 0.02), texel_centres(64))


@lru_cache
def albedo_three():
    """E on three.js's 16 by 16 texels (roughness, cosθo)."""
    return Table(ggx_albedo, texel_centres(16), texel_centres(16))


@lru_cache
def albedo_cycles():
    """E on Cycles' 32 by 32 nodes, ends included."""
    nodes = np.clip(np.arange(32) / 31, 1e-4, 1)
    return Table(ggx_albedo, nodes, nodes)


@lru_cache
def mean_albedo_cycles():
    """Eavg = ∫ 2µ E dµ on Cycles' 32 nodes of roughness."""
    mu = texel_centres(64)
    return Table(lambda r: np.mean([2 * m * ggx_albedo(r, m) for m in mu]), np.clip(np.arange(32) / 31, 1e-4, 1))


def fresnel_dielectric(cos, ior):
    """Unpolarised Fresnel of a dielectric."""
    t = np.sqrt(np.maximum(1 - (1 - cos * cos) / ior**2, 0))
    parallel, perpendicular = (ior * cos - t) / (ior * cos + t), (cos - ior * t) / (cos + ior * t)
    return (parallel**2 + perpendicular**2) / 2


def fresnel_share(cos, ior):
    """s: dielectric Fresnel between its value at 0° (s = 0) and 1 (s = 1)."""
    f0 = ((ior - 1) / (ior + 1)) ** 2
    return np.clip((fresnel_dielectric(cos, ior) - f0) / (1 - f0), 0, 1)


@lru_cache
def share_cycles():
    """Mean s over the visible normals, on Cycles' 16³ nodes of roughness, cosθo and z = F0^¼ of the index."""
    def share(roughness, mu, z):
        root = z**2                                        # √F0
        d, i = visible_normals(roughness, mu, 24)
        return np.mean(np.where(i > 0, fresnel_share(d, (1 + root) / (1 - root)), 0))
    nodes = np.clip(np.arange(16) / 15, 1e-4, 1)
    return Table(share, nodes, nodes, np.clip(nodes, 1e-4, 0.99))


def charlie_albedo(visibility):
    """Directional albedo of Charlie with a visibility(alpha, i, o), a table of (roughness, cosθo)."""
    i, phi = (x.ravel() for x in np.meshgrid(texel_centres(64), 2 * PI * texel_centres(64)))
    s = np.sqrt(1 - i * i)

    def albedo(roughness, o):
        so = np.sqrt(1 - o * o)
        x, y, z = s * np.cos(phi) + so, s * np.sin(phi), i + o
        h = z / np.sqrt(x * x + y * y + z * z)
        return 2 * PI * np.mean(d_charlie(roughness**2, h) * visibility(roughness**2, i, o) * i)
    return Table(albedo, np.maximum(texel_centres(64), 0.05), texel_centres(64))


@lru_cache
def albedo_neubelt():
    return charlie_albedo(lambda alpha, i, o: v_neubelt(i, o))


# ---------------------------------------------------------------- the engines
# Seen in Filament's pictures of materials that have both specular and clearcoat, not in its sources.
FILAMENT_TINT = np.array([29, 30, 31]) / 32


def three(m, a):
    """three.js r187, WebGLRenderer, MeshPhysicalMaterial."""
    def schlick_spherical(f0, f90, cos):
        weight = np.exp2((-5.55473 * cos - 6.98316) * cos)[:, None]
        return f0 * (1 - weight) + f90 * weight

    def lobe(roughness):
        alpha = np.clip(roughness, 0.045, 1) ** 2
        return (d_ggx(alpha, a.h) * v_correlated(alpha, a.i, a.o))[:, None]

    def sheen_albedo(cos):
        r = m.sheen_roughness
        p = -1.9362 + 1.0678 * r + 0.4573 * r * r - 0.8469 / (r + 0.1)
        q = -0.6014 + 0.5538 * r - 0.4670 * r * r - 0.1255 / (r + 0.1)
        return np.clip(np.exp(p * cos + q), 0, 1)

    dielectric = np.minimum(m.ior_f0 * m.specular_color, 1) * m.specular
    f0, f90 = dielectric + (m.base - dielectric) * m.metallic, m.specular + (1 - m.specular) * m.metallic
    compensation = 1 + f0 * (1 / albedo_three()(np.clip(m.roughness, 0.045, 1), a.o) - 1)[:, None]
    f = schlick_spherical(f0, f90, a.d) * lobe(m.roughness) * compensation
    f = f + m.base * (1 - m.metallic) / PI * (1 - schlick_spherical(dielectric, f90, a.d))
    if m.sheen.any():
        alpha = np.clip(m.sheen_roughness, 1e-4, 1) ** 2
        sheen = d_charlie(alpha, np.sqrt(1 - np.maximum(1 - a.h**2, 0.0078125))) * np.clip(v_neubelt(a.i, a.o), 0, 1)
        dimmed = 1 - m.sheen.max() * np.maximum(sheen_albedo(a.o), sheen_albedo(a.i))
        f = f * dimmed[:, None] + m.sheen * sheen[:, None]
    coat = schlick_spherical(0.04, 1, a.d) * lobe(m.coat_roughness)
    return f * (1 - m.coat * schlick_spherical(0.04, 1, a.o)) + m.coat * coat


def babylon(m, a):
    """Babylon.js 9, PBRMaterial as its glTF loader sets it (legacy energy conservation)."""
    def alpha_of(roughness):
        return roughness**2 + 0.0005

    def compensation(roughness):
        return 1 + f0 * (1 / albedo_fine()(roughness + 1 / 256, a.o) - 1)[:, None]

    dielectric = m.ior_f0 * m.specular * m.specular_color
    f0 = dielectric + (m.base - dielectric) * m.metallic
    alpha, alpha_coat = alpha_of(m.roughness), alpha_of(m.coat_roughness)
    f = schlick(f0, m.specular, a.d) * (d_ggx(alpha, a.h) * v_correlated(alpha, a.i, a.o))[:, None] * compensation(m.roughness)
    f = f + m.base * (1 - dielectric) * (1 - m.metallic) / PI
    coat_fresnel = m.coat * schlick(0.04, 1, a.d)
    if m.sheen.any():
        sheen = d_charlie(alpha_of(m.sheen_roughness), a.h) * v_neubelt(a.i, a.o)
        f = f * (1 - m.sheen.max() * albedo_neubelt()(m.sheen_roughness, a.o))[:, None] + m.sheen * sheen[:, None]
    coat = coat_fresnel * (d_ggx(alpha_coat, a.h) * v_kelemen(a.d))[:, None] * compensation(m.coat_roughness)
    return f * (1 - coat_fresnel) + (coat if m.coat > 0 else 0)


def filament(m, a, mobile=True):
    """Filament 1.53 in WebAssembly: mobile shaders of low quality. `mobile=False`: its desktop shaders."""
    least = 0.089 if mobile else 0.045
    visibility = v_fast if mobile else v_correlated
    r, r_coat = np.clip(m.roughness, least, 1), np.clip(m.coat_roughness, least, 1)
    r = r + m.coat * (max(r, r_coat) - r)
    tint = m.specular_color * (FILAMENT_TINT if m.coat > 0 and m.has_specular else 1)
    dielectric = np.minimum(m.ior_f0 * tint, 1) * m.specular
    f0 = dielectric + (m.base - dielectric) * m.metallic
    compensation = 1 + f0 * (1 / albedo_fine()(r + 1 / 64, a.o) - 1)[:, None]
    f = schlick(f0, 1, a.d) * (d_ggx(r**2, a.h) * visibility(r**2, a.i, a.o))[:, None] * compensation
    f = f + m.base * (1 - m.metallic) / PI
    if m.sheen.any() and m.coat == 0:
        r_sheen = np.clip(m.sheen_roughness, least, 1)
        sheen = d_charlie(r_sheen**2, np.sqrt(1 - np.maximum(1 - a.h**2, 0.0078125))) * v_neubelt(a.i, a.o)
        f = f * (1 - m.sheen.max() * albedo_neubelt()(r_sheen + 1 / 64, a.o))[:, None] + m.sheen * sheen[:, None]
    coat_fresnel = m.coat * schlick(0.04, 1, a.d)
    return f * (1 - coat_fresnel) + coat_fresnel * (d_ggx(r_coat**2, a.h) * v_kelemen(a.d))[:, None]


def khronos(m, a):
    """Khronos glTF Sample Viewer 1.1: glTF's appendix B, channel by channel."""
    def lobe(roughness):
        alpha = roughness**2
        return (d_ggx(alpha, a.h) * v_correlated(alpha, a.i, a.o))[:, None]

    dielectric = np.minimum(m.ior_f0 * m.specular_color, 1)
    fresnel = schlick(dielectric * m.specular, m.specular, a.d)
    f = (1 - fresnel) * m.base / PI + fresnel * lobe(m.roughness)
    f = (1 - m.metallic) * f + m.metallic * schlick(m.base, 1, a.d) * lobe(m.roughness)
    if m.sheen.any():
        alpha = max(m.sheen_roughness, 1e-6) ** 2
        f = f + m.sheen * (d_charlie(alpha, a.h) * v_sheen_smith(alpha, a.i, a.o))[:, None]
    coat_share = m.coat * schlick(m.ior_f0, 1, a.o)
    return f * (1 - coat_share) + (coat_share * lobe(m.coat_roughness) if m.coat > 0 else 0)


def blender(m, a):
    """Blender 4.5 and 5.0, Cycles: the Principled BSDF as the glTF importer sets it (multiscatter GGX)."""
    def lobe(roughness):
        return (d_ggx(roughness**2, a.h) * v_correlated(roughness**2, a.i, a.o))[:, None]

    def compensated(roughness, mean_fresnel):
        """(gain of the lobe, the same times E): 1 + Fms (1 − E)/E and what stays of the closure's weight."""
        e, mean = albedo_cycles()(roughness, a.o)[:, None], mean_albedo_cycles()(roughness)
        fms = mean_fresnel * mean / (1 - mean_fresnel * (1 - mean))
        return 1 + fms * (1 - e) / e, e + fms * (1 - e)

    def layer(f0, ior, roughness):
        """A dielectric layer: its lobe, and its albedo as what lies below is dimmed by."""
        share = np.clip((mean_dielectric(ior) - f0_of(ior)) / (1 - f0_of(ior)), 0, 1)
        gain, darkening = compensated(roughness, f0 + (1 - f0) * share)
        z = np.sqrt(abs(ior - 1) / (ior + 1))
        below = share_cycles()(roughness, a.o, z)[:, None]
        fresnel = f0 + (1 - f0) * fresnel_share(a.d, ior)[:, None]
        return fresnel * lobe(roughness) * gain, darkening * (f0 + (1 - f0) * below)

    def f0_of(ior):
        return ((ior - 1) / (ior + 1)) ** 2

    def mean_dielectric(ior):
        return (ior - 1) / (4.08567 + 1.00071 * ior)

    f, weight = 0, np.ones((len(a.i), 1))
    if m.coat > 1e-5:
        lobe_coat, albedo = layer(np.full(1, 0.04), 1.5, m.coat_roughness)
        f, weight = m.coat * lobe_coat, 1 - m.coat * albedo.max(1, keepdims=True)
    if m.metallic > 1e-5:
        f0 = np.minimum(m.base, 1)
        tinted = (f0 + (1 - f0) * (6 / 7) ** 5) * (7 / (6 / 7) ** 6) * (1 - np.minimum(m.specular_color, 1))
        s5 = (1 - a.d)[:, None] ** 5
        fresnel = np.clip(f0 + (1 - f0) * s5 - tinted * a.d[:, None] * s5 * (1 - a.d)[:, None], 0, 1)
        gain, _ = compensated(m.roughness, f0 + (1 - f0) / 21 - tinted / 126)
        f = f + weight * m.metallic * fresnel * lobe(m.roughness) * gain
        weight = weight * (1 - m.metallic)
    f0 = m.ior_f0 * m.specular
    if f0 > 0:
        root = np.sqrt(min(f0, 0.99))
        lobe_specular, albedo = layer(np.clip(f0 * m.specular_color, 0, 1), (1 + root) / (1 - root), m.roughness)
        f = f + weight * lobe_specular
        weight = weight * np.clip(1 - albedo.max(1, keepdims=True), 0, 1)
    return f + weight * m.base / PI


FORMS = {"three": three, "babylon": babylon, "filament": filament, "khronos": khronos, "blender": blender}
