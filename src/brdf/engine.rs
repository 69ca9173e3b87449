//! The glTF material as engines evaluate it: five forms of one set of factors.

use std::f64::consts::{FRAC_1_PI, TAU};
use std::sync::LazyLock;

use glam::DVec3;
use serde::Serialize;

use crate::brdf::Reflectance;
use crate::brdf::gltf::{DIELECTRIC_F0, GltfBrdf, coat_fresnel, schlick_weight};
use crate::math::direction::Angles;
use crate::microfacet::{Distribution as _, Ggx, ggx};

/// An engine's form of the glTF material under direct light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Engine {
    /// three.js 0.187.
    ThreeJs,
    /// Babylon.js 9.
    BabylonJs,
    /// Filament 1.53, as on the web and on mobile devices.
    Filament,
    /// The Khronos sample viewer 1.1: appendix B of the specification, colour by colour.
    Khronos,
    /// Cycles 4.5 and 5.0.
    Cycles,
}

impl Engine {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::ThreeJs, Self::BabylonJs, Self::Filament, Self::Khronos, Self::Cycles];
}

/// A glTF material in an engine's form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EngineBrdf {
    /// The form.
    pub engine: Engine,
    /// The factors.
    pub material: GltfBrdf,
}

/// A pair of directions as these models see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairCosines {
    /// cosθi.
    pub i: f64,
    /// cosθo.
    pub o: f64,
    /// tan²θh.
    pub tan2_h: f64,
    /// wi·h.
    pub d: f64,
}

impl Reflectance for EngineBrdf {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let Some(Angles { tan2_h, cos_d, cos: [i, o], .. }) = Angles::of(wi, wo) else {
            return [0.0; 3];
        };
        let pair = PairCosines { i, o, tan2_h, d: cos_d };
        self.engine.eval(&self.material, &pair)
    }
}

impl Engine {
    /// f of a material \[1/sr\].
    #[must_use]
    pub fn eval(self, material: &GltfBrdf, pair: &PairCosines) -> [f64; 3] {
        match self {
            Self::ThreeJs => three_js(material, pair),
            Self::BabylonJs => babylon_js(material, pair),
            Self::Filament => filament(material, pair),
            Self::Khronos => khronos(material, pair),
            Self::Cycles => cycles(material, pair),
        }
    }
}

fn mix(a: f64, b: f64, share: f64) -> f64 {
    a + (b - a) * share
}

/// F0 of the dielectric, its colour clamped, without the specular factor.
fn clamped_f0(m: &GltfBrdf) -> [f64; 3] {
    m.specular_color.map(|tint| (DIELECTRIC_F0 * tint).min(1.0))
}

fn coat(m: &GltfBrdf) -> Option<(f64, f64)> {
    let factor = m.clearcoat.filter(|factor| *factor > 0.0)?;
    Some((factor, m.clearcoat_roughness.unwrap_or(0.0)))
}

/// D·V of width α, height-correlated.
fn lobe(alpha: f64, p: &PairCosines) -> f64 {
    let a2 = alpha * alpha;
    let smith = |a: f64, b: f64| a * (b * b * (1.0 - a2) + a2).sqrt();
    Ggx { alpha }.ndf(p.tan2_h) * 0.5 / (smith(p.i, p.o) + smith(p.o, p.i))
}

/// D times Kelemen's ¼/d².
fn kelemen_lobe(alpha: f64, p: &PairCosines) -> f64 {
    Ggx { alpha }.ndf(p.tan2_h) * 0.25 / (p.d * p.d)
}

/// 1 + f0 (1/E − 1): what light that is reflected more than once adds.
fn compensation(f0: f64, albedo: f64) -> f64 {
    1.0 + f0 * (albedo.recip() - 1.0)
}

fn three_js(m: &GltfBrdf, p: &PairCosines) -> [f64; 3] {
    let schlick = |c: f64| ((-5.55473 * c - 6.98316) * c).exp2();
    let fresnel = |f0: f64, f90: f64, w: f64| f0 * (1.0 - w) + f90 * w;
    let roughness = m.roughness.max(0.045);
    let (w, dv) = (schlick(p.d), lobe(roughness * roughness, p));
    let albedo = Albedos::of_ggx(roughness, p.o);
    let dielectric = clamped_f0(m).map(|f0| f0 * m.specular_factor);
    let base: [f64; 3] = std::array::from_fn(|c| {
        let f0 = mix(dielectric[c], m.base_color[c], m.metallic);
        let f90 = mix(m.specular_factor, 1.0, m.metallic);
        let specular = fresnel(f0, f90, w) * dv * compensation(f0, albedo);
        let below = 1.0 - fresnel(dielectric[c], m.specular_factor, w);
        specular + m.base_color[c] * (1.0 - m.metallic) * FRAC_1_PI * below
    });
    let Some((factor, rough)) = coat(m) else { return base };
    let on_top = fresnel(0.04, 1.0, w) * lobe(rough.max(0.045).powi(2), p);
    let below = 1.0 - factor * fresnel(0.04, 1.0, schlick(p.o));
    base.map(|f| f * below + factor * on_top)
}

fn babylon_js(m: &GltfBrdf, p: &PairCosines) -> [f64; 3] {
    let w = schlick_weight(p.d);
    let dv = lobe(m.roughness * m.roughness + 0.0005, p);
    let albedo = Albedos::of_ggx(m.roughness + 1.0 / 256.0, p.o);
    let coat = coat(m).map(|(factor, rough)| {
        let fresnel = factor * coat_fresnel(p.d);
        let albedo = Albedos::of_ggx(rough + 1.0 / 256.0, p.o);
        (fresnel, fresnel * kelemen_lobe(rough * rough + 0.0005, p), albedo)
    });
    std::array::from_fn(|c| {
        let dielectric = DIELECTRIC_F0 * m.specular_factor * m.specular_color[c];
        let f0 = mix(dielectric, m.base_color[c], m.metallic);
        let specular = mix(f0, m.specular_factor, w) * dv * compensation(f0, albedo);
        let diffuse = m.base_color[c] * (1.0 - dielectric) * (1.0 - m.metallic) * FRAC_1_PI;
        let base = specular + diffuse;
        coat.map_or(base, |(fresnel, lobe, albedo)| {
            base * (1.0 - fresnel) + lobe * compensation(f0, albedo)
        })
    })
}

fn filament(m: &GltfBrdf, p: &PairCosines) -> [f64; 3] {
    const LEAST: f64 = 0.089;
    let coat = coat(m).map(|(factor, rough)| (factor, rough.max(LEAST)));
    let roughness = m.roughness.max(LEAST);
    let roughness =
        coat.map_or(roughness, |(factor, rough)| mix(roughness, roughness.max(rough), factor));
    let alpha = roughness * roughness;
    let fast = 0.5 / mix(2.0 * p.i * p.o, p.i + p.o, alpha);
    let (w, dv) = (schlick_weight(p.d), Ggx { alpha }.ndf(p.tan2_h) * fast);
    let albedo = Albedos::of_ggx(roughness + 1.0 / 64.0, p.o);
    let dielectric = clamped_f0(m).map(|f0| f0 * m.specular_factor);
    let base: [f64; 3] = std::array::from_fn(|c| {
        let f0 = mix(dielectric[c], m.base_color[c], m.metallic);
        let diffuse = m.base_color[c] * (1.0 - m.metallic) * FRAC_1_PI;
        mix(f0, 1.0, w) * dv * compensation(f0, albedo) + diffuse
    });
    let Some((factor, rough)) = coat else { return base };
    let fresnel = factor * coat_fresnel(p.d);
    base.map(|f| f * (1.0 - fresnel) + fresnel * kelemen_lobe(rough * rough, p))
}

fn khronos(m: &GltfBrdf, p: &PairCosines) -> [f64; 3] {
    let (w, dv) = (schlick_weight(p.d), lobe(m.roughness * m.roughness, p));
    let f0 = clamped_f0(m);
    let base: [f64; 3] = std::array::from_fn(|c| {
        let fresnel = m.specular_factor * mix(f0[c], 1.0, w);
        let dielectric = (1.0 - fresnel) * m.base_color[c] * FRAC_1_PI + fresnel * dv;
        mix(dielectric, mix(m.base_color[c], 1.0, w) * dv, m.metallic)
    });
    let Some((factor, rough)) = coat(m) else { return base };
    let fresnel = factor * coat_fresnel(p.o);
    base.map(|f| f * (1.0 - fresnel) + fresnel * lobe(rough * rough, p))
}

fn cycles(m: &GltfBrdf, p: &PairCosines) -> [f64; 3] {
    let (mut f, mut below) = ([0.0; 3], 1.0);
    if let Some((factor, rough)) = coat(m) {
        let layer = Dielectric::new(0.04, rough);
        let [value, albedo] = layer.lobe(0.04, p);
        f = [factor * value; 3];
        below -= factor * albedo;
    }
    let metal = cycles_metal(m, p);
    let q = (DIELECTRIC_F0 * m.specular_factor).min(0.99);
    let layer = (q > 0.0).then(|| Dielectric::new(q, m.roughness));
    let lobes = m.specular_color.map(|tint| {
        let f0 = (DIELECTRIC_F0 * m.specular_factor * tint).min(1.0);
        layer.map_or([0.0; 2], |layer| layer.lobe(f0, p))
    });
    let under = 1.0 - lobes.iter().map(|lobe| lobe[1]).fold(0.0, f64::max);
    for c in 0..3 {
        let dielectric = lobes[c][0] + under * m.base_color[c] * FRAC_1_PI;
        f[c] += below * mix(dielectric, metal[c], m.metallic);
    }
    f
}

/// Schlick with a dent at 82° that the specular colour sets, and multiple scattering.
fn cycles_metal(m: &GltfBrdf, p: &PairCosines) -> [f64; 3] {
    let dv = lobe(m.roughness * m.roughness, p);
    std::array::from_fn(|c| {
        let f0 = m.base_color[c].min(1.0);
        let at_82 = mix(f0, 1.0, (6.0_f64 / 7.0).powi(5));
        let dent = at_82 * 7.0 / (6.0_f64 / 7.0).powi(6) * (1.0 - m.specular_color[c].min(1.0));
        let fresnel = mix(f0, 1.0, schlick_weight(p.d)) - dent * p.d * (1.0 - p.d).powi(6);
        let mean = f0 + (1.0 - f0) / 21.0 - dent / 126.0;
        fresnel.clamp(0.0, 1.0) * dv * Albedos::scattered(m.roughness, p.o, mean)
    })
}

/// A dielectric layer of Cycles.
#[derive(Clone, Copy)]
struct Dielectric {
    /// F0 of its index of refraction.
    f0: f64,
    roughness: f64,
}

impl Dielectric {
    fn new(f0: f64, roughness: f64) -> Self {
        Self { f0, roughness }
    }

    /// The lobe of colour `f0` and its albedo seen from o.
    fn lobe(self, f0: f64, p: &PairCosines) -> [f64; 2] {
        let index = index_of(self.f0);
        let mean = (index - 1.0) / (4.08567 + 1.00071 * index);
        let whole = f0 + (1.0 - f0) * ((mean - self.f0) / (1.0 - self.f0));
        let scattered = Albedos::scattered(self.roughness, p.o, whole);
        let fresnel = mix(f0, 1.0, share(p.d, self.f0));
        let alpha = self.roughness * self.roughness;
        let seen = mix(f0, 1.0, Albedos::share(self.roughness, p.o, self.f0));
        let albedo = seen * Albedos::of_ggx(self.roughness, p.o) * scattered;
        [fresnel * lobe(alpha, p) * scattered, albedo]
    }
}

/// The index of refraction of a reflectance at normal incidence.
fn index_of(f0: f64) -> f64 {
    (1.0 + f0.sqrt()) / (1.0 - f0.sqrt())
}

/// How far Fresnel's reflectance of a dielectric has risen from f0 to 1.
fn share(cos: f64, f0: f64) -> f64 {
    let index = index_of(f0);
    let g = (index * index - 1.0 + cos * cos).sqrt();
    let (a, b) = ((g - cos) / (g + cos), cos * (g + cos) - 1.0);
    let fresnel = 0.5 * a * a * (1.0 + (b / (cos * (g - cos) + 1.0)).powi(2));
    ((fresnel - f0) / (1.0 - f0)).max(0.0)
}

/// Directional albedos of a GGX lobe with F = 1, against roughness and cosθ.
struct Albedos {
    /// E.
    ggx: Vec<f64>,
    /// Ē = ∫ 2µ E dµ, against roughness.
    mean: Vec<f64>,
    /// The mean of [`share`] over the normals seen, for each F0^¼ = [`FOURTH_ROOTS`].
    share: Vec<Vec<f64>>,
}

/// Nodes in roughness and cosθ.
const NODES: usize = 24;
/// F0^¼ of the tables of [`share`].
const FOURTH_ROOTS: [f64; 4] = [0.1, 0.2162, 0.3324, 0.4486];

static ALBEDOS: LazyLock<Albedos> = LazyLock::new(Albedos::new);

impl Albedos {
    fn new() -> Self {
        let node = |k: usize| k as f64 / (NODES - 1) as f64;
        let mut table =
            Self { ggx: Vec::new(), mean: Vec::new(), share: vec![Vec::new(); FOURTH_ROOTS.len()] };
        for r in 0..NODES {
            for o in 0..NODES {
                let (albedo, shares) = seen_from(node(r), node(o));
                table.ggx.push(albedo);
                table.share.iter_mut().zip(shares).for_each(|(table, share)| table.push(share));
            }
            let row = &table.ggx[r * NODES..];
            let strip = |k: usize| {
                let (a, b) = (node(k), node(k + 1));
                (b - a) * (a * row[k] + b * row[k + 1])
            };
            let mean = (0..NODES - 1).map(strip).sum();
            table.mean.push(mean);
        }
        table
    }

    /// E of a roughness, seen from cosθo.
    fn of_ggx(roughness: f64, cos_o: f64) -> f64 {
        bilinear(&ALBEDOS.ggx, roughness, cos_o)
    }

    /// The mean of [`share`] over the normals seen.
    fn share(roughness: f64, cos_o: f64, f0: f64) -> f64 {
        let [first, .., last] = FOURTH_ROOTS;
        let steps = (FOURTH_ROOTS.len() - 1) as f64;
        let at = ((f0.powf(0.25) - first) / (last - first) * steps).clamp(0.0, steps - 1e-9);
        let of = |k: usize| bilinear(&ALBEDOS.share[k], roughness, cos_o);
        let k = at as usize;
        mix(of(k), of(k + 1), at - k as f64)
    }

    /// 1 + Fms (1 − E)/E of a mean Fresnel factor.
    fn scattered(roughness: f64, cos_o: f64, fresnel: f64) -> f64 {
        let at = roughness.clamp(0.0, 1.0) * (NODES - 1) as f64;
        let k = (at as usize).min(NODES - 2);
        let mean = mix(ALBEDOS.mean[k], ALBEDOS.mean[k + 1], at - k as f64);
        let often = fresnel * mean / (1.0 - fresnel * (1.0 - mean));
        compensation(often, Self::of_ggx(roughness, cos_o))
    }
}

fn bilinear(table: &[f64], roughness: f64, cos_o: f64) -> f64 {
    let place = |x: f64| {
        let at = x.clamp(0.0, 1.0) * (NODES - 1) as f64;
        let k = (at as usize).min(NODES - 2);
        (k, at - k as f64)
    };
    let ((r, t), (o, s)) = (place(roughness), place(cos_o));
    let row = |r: usize| mix(table[r * NODES + o], table[r * NODES + o + 1], s);
    mix(row(r), row(r + 1), t)
}

/// E and the mean of [`share`] seen from cosθo, by visible normals spread evenly.
fn seen_from(roughness: f64, cos_o: f64) -> (f64, [f64; 4]) {
    const SIDE: usize = 16;
    let alpha = (roughness * roughness).max(1e-4);
    let cos_o = cos_o.max(1e-3);
    let wo = DVec3::new((1.0 - cos_o * cos_o).sqrt(), 0.0, cos_o);
    let lambda = |w: DVec3| ggx::lambda(w.z / w.x.hypot(w.y).max(1e-12) / alpha);
    let (mut albedo, mut shares) = (0.0, [0.0; 4]);
    for k in 0..SIDE * SIDE {
        let u = [k / SIDE, k % SIDE].map(|i| (i as f64 + 0.5) / SIDE as f64);
        let h = visible_normal(wo, alpha, u);
        let d = wo.dot(h);
        let wi = 2.0 * d * h - wo;
        if wi.z > 0.0 {
            albedo += (1.0 + lambda(wo)) / (1.0 + lambda(wo) + lambda(wi));
        }
        for (sum, root) in shares.iter_mut().zip(FOURTH_ROOTS) {
            *sum += share(d.clamp(0.0, 1.0), root.powi(4));
        }
    }
    let count = (SIDE * SIDE) as f64;
    (albedo / count, shares.map(|sum| sum / count))
}

/// A normal seen from wo (Heitz 2018).
fn visible_normal(wo: DVec3, alpha: f64, [u, v]: [f64; 2]) -> DVec3 {
    let stretched = DVec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize();
    let across = DVec3::Z.cross(stretched);
    let t1 = if across.length_squared() > 1e-20 { across.normalize() } else { DVec3::X };
    let t2 = stretched.cross(t1);
    let (radius, (sin, cos)) = (u.sqrt(), (TAU * v).sin_cos());
    let (p1, p2) = (radius * cos, radius * sin);
    let s = 0.5 * (1.0 + stretched.z);
    let p2 = mix((1.0 - p1 * p1).sqrt(), p2, s);
    let up = (1.0 - p1 * p1 - p2 * p2).max(0.0).sqrt();
    let n = p1 * t1 + p2 * t2 + up * stretched;
    DVec3::new(alpha * n.x, alpha * n.y, n.z.max(1e-9)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::direction::spherical;

    fn plastic() -> GltfBrdf {
        GltfBrdf {
            base_color: [0.5, 0.3, 0.1],
            metallic: 0.0,
            roughness: 0.4,
            specular_factor: 1.0,
            specular_color: [1.0; 3],
            clearcoat: Some(0.5),
            clearcoat_roughness: Some(0.1),
        }
    }

    #[test]
    fn engines_agree_on_a_plain_material_facing_the_light() {
        let (wi, wo) = (spherical(0.2, 0.0), spherical(0.5, 2.0));
        let values =
            Engine::ALL.map(|engine| EngineBrdf { engine, material: plastic() }.eval(wi, wo)[0]);
        let appendix_b = plastic().eval(wi, wo)[0];
        for value in values {
            assert!((value / appendix_b - 1.0).abs() < 0.06, "{values:?} {appendix_b}");
        }
    }

    #[test]
    fn a_smooth_lobe_loses_nothing_and_a_rough_one_what_is_known() {
        assert!((Albedos::of_ggx(0.0, 0.5) - 1.0).abs() < 1e-3);
        // The directional albedo of GGX with α = 1 at normal incidence.
        assert!((Albedos::of_ggx(1.0, 1.0) - 0.31).abs() < 0.02, "{}", Albedos::of_ggx(1.0, 1.0));
    }
}
