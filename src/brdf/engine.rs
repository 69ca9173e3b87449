//! The glTF material as engines evaluate it: five forms of one set of factors. Their constants and
//! their oddities are those of docs/engine-forms.md, which names the lines of the sources.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use serde::Serialize;

use crate::brdf::Reflectance;
use crate::brdf::engine_albedos::{Albedos, compensation, index_of, mix, share};
use crate::brdf::gltf::{DIELECTRIC_F0, GltfBrdf, coat_fresnel, schlick_weight};
use crate::math::direction::Angles;
use crate::microfacet::{Distribution as _, Ggx};

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
    Ggx { alpha }.ndf(p.tan2_h) * 0.5 / (smith(p.i, p.o, a2) + smith(p.o, p.i, a2))
}

/// a √(b² (1 − α²) + α²), one side of height-correlated masking.
fn smith(a: f64, b: f64, a2: f64) -> f64 {
    a * (b * b * (1.0 - a2) + a2).sqrt()
}

/// D times Kelemen's ¼/d².
fn kelemen_lobe(alpha: f64, p: &PairCosines) -> f64 {
    Ggx { alpha }.ndf(p.tan2_h) * 0.25 / (p.d * p.d)
}

/// (1−c)⁵ as a spherical Gaussian approximates it.
fn spherical_gaussian(c: f64) -> f64 {
    ((-5.55473 * c - 6.98316) * c).exp2()
}

/// F0 (1−w) + F90 w.
fn weighted(f0: f64, f90: f64, w: f64) -> f64 {
    f0 * (1.0 - w) + f90 * w
}

fn three_js(m: &GltfBrdf, p: &PairCosines) -> [f64; 3] {
    // Least roughness of three.js.
    let roughness = m.roughness.max(0.045);
    let (w, dv) = (spherical_gaussian(p.d), lobe(roughness * roughness, p));
    let albedo = Albedos::of_ggx(roughness, p.o);
    let dielectric = clamped_f0(m).map(|f0| f0 * m.specular_factor);
    let base: [f64; 3] = std::array::from_fn(|c| {
        let f0 = mix(dielectric[c], m.base_color[c], m.metallic);
        let f90 = mix(m.specular_factor, 1.0, m.metallic);
        let specular = weighted(f0, f90, w) * dv * compensation(f0, albedo);
        // The diffuse base sees the dielectric's Fresnel, also beside metal.
        let below = 1.0 - weighted(dielectric[c], m.specular_factor, w);
        specular + m.base_color[c] * (1.0 - m.metallic) * FRAC_1_PI * below
    });
    let Some((factor, rough)) = coat(m) else { return base };
    let on_top = weighted(0.04, 1.0, w) * lobe(rough.max(0.045).powi(2), p);
    // At cosθo, where the coat's own lobe has cosθd.
    let below = 1.0 - factor * weighted(0.04, 1.0, spherical_gaussian(p.o));
    base.map(|f| f * below + factor * on_top)
}

fn babylon_js(m: &GltfBrdf, p: &PairCosines) -> [f64; 3] {
    let w = schlick_weight(p.d);
    // Babylon.js adds to α where others limit the roughness. The rows of its albedo texture are one
    // off, 1/256 of roughness.
    let dv = lobe(m.roughness * m.roughness + 0.0005, p);
    let albedo = Albedos::of_ggx(m.roughness + 1.0 / 256.0, p.o);
    let coat = coat(m).map(|(factor, rough)| {
        let fresnel = factor * coat_fresnel(p.d);
        let albedo = Albedos::of_ggx(rough + 1.0 / 256.0, p.o);
        (fresnel, fresnel * kelemen_lobe(rough * rough + 0.0005, p), albedo)
    });
    std::array::from_fn(|c| {
        // Not clamped: a specular colour above 25 exceeds 1.
        let dielectric = DIELECTRIC_F0 * m.specular_factor * m.specular_color[c];
        let f0 = mix(dielectric, m.base_color[c], m.metallic);
        // F90 is the specular factor also of a metal.
        let specular = mix(f0, m.specular_factor, w) * dv * compensation(f0, albedo);
        let diffuse = m.base_color[c] * (1.0 - dielectric) * (1.0 - m.metallic) * FRAC_1_PI;
        let base = specular + diffuse;
        coat.map_or(base, |(fresnel, lobe, albedo)| {
            // With f0 of the base, as the shader has it.
            base * (1.0 - fresnel) + lobe * compensation(f0, albedo)
        })
    })
}

fn filament(m: &GltfBrdf, p: &PairCosines) -> [f64; 3] {
    /// Least roughness of the mobile shaders, which the web uses.
    const MIN_ROUGHNESS: f64 = 0.089;
    let coat = coat(m).map(|(factor, rough)| (factor, rough.max(MIN_ROUGHNESS)));
    let roughness = m.roughness.max(MIN_ROUGHNESS);
    let roughness =
        coat.map_or(roughness, |(factor, rough)| mix(roughness, roughness.max(rough), factor));
    let alpha = roughness * roughness;
    // Hammon's approximation of V (mobile). The rows of the albedo texture are one off, 1/64.
    let fast = 0.5 / mix(2.0 * p.i * p.o, p.i + p.o, alpha);
    let (w, dv) = (schlick_weight(p.d), Ggx { alpha }.ndf(p.tan2_h) * fast);
    let albedo = Albedos::of_ggx(roughness + 1.0 / 64.0, p.o);
    let dielectric = clamped_f0(m).map(|f0| f0 * m.specular_factor);
    let base: [f64; 3] = std::array::from_fn(|c| {
        let f0 = mix(dielectric[c], m.base_color[c], m.metallic);
        // No Fresnel dims the diffuse base.
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
    // Of the normal, not of the half vector, for the coat's lobe too.
    let fresnel = factor * coat_fresnel(p.o);
    base.map(|f| f * (1.0 - fresnel) + fresnel * lobe(rough * rough, p))
}

fn cycles(m: &GltfBrdf, p: &PairCosines) -> [f64; 3] {
    let (mut f, mut below) = ([0.0; 3], 1.0);
    // From the top down: each layer dims what lies below by its albedo seen from o.
    if let Some((factor, rough)) = coat(m) {
        let layer = Dielectric::new(0.04, rough);
        let [value, albedo] = layer.lobe(0.04, p);
        f = [factor * value; 3];
        below -= factor * albedo;
    }
    let metal = cycles_metal(m, p);
    // The index comes from the factor alone, f0 from the tint too; an index of 1 has no lobe.
    let q = (DIELECTRIC_F0 * m.specular_factor).min(0.99);
    let layer = (q > 0.0).then(|| Dielectric::new(q, m.roughness));
    let lobes = m.specular_color.map(|tint| {
        let f0 = (DIELECTRIC_F0 * m.specular_factor * tint).min(1.0);
        layer.map_or([0.0; 2], |layer| layer.lobe(f0, p))
    });
    // By the brightest channel, so that dimming adds no colour.
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
        // The cosine-weighted mean of F: ∫ 2µ (1−µ)⁵ dµ = 1/21, ∫ 2µ² (1−µ)⁶ dµ = 1/126.
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
        // A fit to the mean Fresnel factor of the index, then rescaled as the factor itself is.
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
