//! The best glTF 2.0 material.

use std::f64::consts::FRAC_1_PI;

use nalgebra::DVector;
use serde::Serialize;

use crate::brdf::gltf::{DIELECTRIC_F0, GltfBrdf, coat_fresnel, ggx_lobe, schlick_weight};
use crate::fit::metric::Metric;
use crate::fit::reason::{self, Reason};
use crate::fit::target::Target;
use crate::material::Material;
use crate::math::box_least_squares::{Bounds, Minimum, NormalEquations, Residuals, minimise};
use crate::math::line_search::{Point, refine};

/// The best glTF material, with its residual.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GltfFit {
    /// The material's factors.
    #[serde(flatten)]
    pub material: GltfBrdf,
    /// Relative residual per channel.
    pub residual: [f64; 3],
    /// What is odd about the material or the fit.
    pub reasons: Vec<Reason>,
}

/// Roughness that is searched: below it a lobe is a mirror for any picture.
pub const ROUGHNESS_RANGE: [f64; 2] = [0.03, 1.0];
/// Roughness values looked at before the best is refined.
const SCAN: usize = 12;
/// Width of the final bracket of roughness.
const ROUGHNESS_TOLERANCE: f64 = 1e-4;
/// A property beyond the core is used only where it lowers the residual by this factor.
const WORTHWHILE: f64 = 0.95;

/// The best glTF material in the default metric.
#[must_use]
pub fn fit(material: &Material) -> GltfFit {
    fit_target(&Target::new(material), Metric::default())
}

/// The best glTF material for a target, in `metric`.
///
/// For a given roughness the other factors follow from [`minimise`] inside their ranges; roughness
/// itself from a scan over its whole range and golden sections around the best. First with core
/// properties alone, then with `KHR_materials_specular`: a dielectric whose F0 is any colour, which
/// reaches whatever a metallic factor between 0 and 1 does. The extension is kept where it lowers
/// the residual by more than 5 %.
#[must_use]
pub fn fit_target(target: &Target, metric: Metric) -> GltfFit {
    let search = Search::new(target, metric);
    let core = search.best(&Family::Core);
    let specular = search.best(&Family::Specular);
    let plain =
        if specular.squares < WORTHWHILE.powi(2) * core.squares { &specular } else { &core };
    let material = plain.material();
    let mut reasons = reason::of_material(&target.material);
    if plain.x[METALLIC] > 0.5 {
        reasons.push(Reason::Metal);
    }
    GltfFit { residual: search.residual(&material), material, reasons }
}

/// Where each unknown stands: specular factor, F0 of the three channels, base colour of the three,
/// metallic, clearcoat.
const SPECULAR: usize = 0;
const F0: usize = 1;
const BASE: usize = 4;
const METALLIC: usize = 7;
const CLEARCOAT: usize = 8;
const UNKNOWNS: usize = 9;

/// Which unknowns a fit may move.
enum Family {
    /// Base colour, metallic and roughness.
    Core,
    /// Base colour, specular factor and colour of a dielectric.
    Specular,
}

impl Family {
    fn bounds(&self) -> Bounds {
        let held = |values: [f64; UNKNOWNS]| DVector::from_column_slice(&values);
        const F: f64 = DIELECTRIC_F0;
        match self {
            Self::Core => Bounds {
                lower: held([1.0, F, F, F, 0.0, 0.0, 0.0, 0.0, 0.0]),
                upper: held([1.0, F, F, F, 1.0, 1.0, 1.0, 1.0, 0.0]),
            },
            Self::Specular => Bounds {
                lower: held([0.0; UNKNOWNS]),
                upper: held([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0]),
            },
        }
    }
}

/// The best factors at the best roughness.
struct Solution {
    roughness: f64,
    x: DVector<f64>,
    squares: f64,
}

impl Solution {
    fn material(&self) -> GltfBrdf {
        let x = &self.x;
        GltfBrdf {
            base_color: std::array::from_fn(|c| x[BASE + c]),
            metallic: x[METALLIC],
            roughness: self.roughness,
            specular_factor: x[SPECULAR],
            specular_color: std::array::from_fn(|c| x[F0 + c] / DIELECTRIC_F0),
            clearcoat: None,
            clearcoat_roughness: None,
        }
    }
}

/// A pair of directions with everything that does not depend on the unknowns.
struct Sample {
    weight: f64,
    cos_theta_i: f64,
    schlick_weight: f64,
    coat_fresnel: f64,
    goal: [f64; 3],
}

struct Search<'a> {
    target: &'a Target,
    metric: Metric,
    samples: Vec<Sample>,
}

impl<'a> Search<'a> {
    fn new(target: &'a Target, metric: Metric) -> Self {
        let sample = |i: usize| {
            let pair = &target.pairs[i];
            let goal = |f: &Vec<f64>| metric.transform(f[i], pair.cos_theta[0]).0;
            Sample {
                weight: pair.weight,
                cos_theta_i: pair.cos_theta[0],
                schlick_weight: schlick_weight(pair.cos_theta_d),
                coat_fresnel: coat_fresnel(pair.cos_theta[1]),
                goal: target.channels.each_ref().map(goal),
            }
        };
        Self { target, metric, samples: (0..target.pairs.len()).map(sample).collect() }
    }

    /// The best roughness and factors of a family.
    fn best(&self, family: &Family) -> Solution {
        let [low, high] = ROUGHNESS_RANGE;
        let step = (high - low) / (SCAN - 1) as f64;
        let scan = (0..SCAN).map(|i| low + step * i as f64);
        let scan: Vec<Point> =
            scan.map(|x| Point { x, value: self.factors(family, x).squares }).collect();
        let best = refine(&scan, ROUGHNESS_TOLERANCE, |x| self.factors(family, x).squares);
        let Minimum { x, squares } = self.factors(family, best.x);
        Solution { roughness: best.x, x, squares }
    }

    /// The best factors of a family at a given roughness.
    fn factors(&self, family: &Family, roughness: f64) -> Minimum {
        let lobe = self.lobe(roughness);
        let start = DVector::from_column_slice(&[0.5, 0.2, 0.2, 0.2, 0.3, 0.3, 0.3, 0.5, 0.0]);
        minimise(|x| self.equations(x, &lobe, &lobe), &start, &family.bounds())
    }

    /// V·D at every pair.
    fn lobe(&self, roughness: f64) -> Vec<f64> {
        let pairs = self.target.pairs.iter();
        let alpha = roughness * roughness;
        pairs.map(|p| ggx_lobe(alpha, p.tan2_theta_h, p.cot_theta, p.cos_theta)).collect()
    }

    fn equations(&self, x: &DVector<f64>, lobe: &[f64], coat_lobe: &[f64]) -> NormalEquations {
        let mut sums = Residuals::none();
        let brightest = (F0..F0 + 3).max_by(|a, b| x[*a].total_cmp(&x[*b])).unwrap_or(F0);
        for (i, sample) in self.samples.iter().enumerate() {
            for (c, goal) in sample.goal.iter().enumerate() {
                let (f, row) = value(x, c, brightest, sample, lobe[i], coat_lobe[i]);
                let (value, slope) = self.metric.transform(f, sample.cos_theta_i);
                sums.add(sample.weight, value - goal, &row.map(|d: f64| d * slope));
            }
        }
        sums.into()
    }

    fn residual(&self, material: &GltfBrdf) -> [f64; 3] {
        let fit = self.values(material);
        std::array::from_fn(|c| self.target.residual(self.metric, c, &fit[c]))
    }

    /// f of each channel at every pair.
    fn values(&self, material: &GltfBrdf) -> [Vec<f64>; 3] {
        let lobe = self.lobe(material.roughness);
        let coat_lobe = self.lobe(material.clearcoat_roughness.unwrap_or(1.0));
        let f0 = material.specular_color.map(|c| c * DIELECTRIC_F0);
        let x = DVector::from_iterator(
            UNKNOWNS,
            [material.specular_factor]
                .into_iter()
                .chain(f0)
                .chain(material.base_color)
                .chain([material.metallic, material.clearcoat.unwrap_or(0.0)]),
        );
        let brightest = (F0..F0 + 3).max_by(|a, b| x[*a].total_cmp(&x[*b])).unwrap_or(F0);
        std::array::from_fn(|c| {
            let samples = self.samples.iter().enumerate();
            samples.map(|(i, s)| value(&x, c, brightest, s, lobe[i], coat_lobe[i]).0).collect()
        })
    }
}

/// f of channel `c` (see [`GltfBrdf`] for the formula) and its derivatives.
#[inline]
fn value(
    x: &DVector<f64>,
    c: usize,
    brightest: usize,
    sample: &Sample,
    lobe: f64,
    coat_lobe: f64,
) -> (f64, [f64; UNKNOWNS]) {
    let u = sample.schlick_weight;
    let (s, f0, base, metallic) = (x[SPECULAR], x[F0 + c], x[BASE + c], x[METALLIC]);
    let fr = f0 + (1.0 - f0) * u;
    let most = x[brightest] + (1.0 - x[brightest]) * u;
    let dielectric = (1.0 - s * most) * base * FRAC_1_PI + s * fr * lobe;
    let metal = (base + (1.0 - base) * u) * lobe;
    let material = (1.0 - metallic) * dielectric + metallic * metal;
    let under = 1.0 - x[CLEARCOAT] * sample.coat_fresnel;

    let mut row = [0.0; UNKNOWNS];
    let by_dielectric = under * (1.0 - metallic);
    row[SPECULAR] = by_dielectric * (fr * lobe - most * base * FRAC_1_PI);
    row[F0 + c] = by_dielectric * s * (1.0 - u) * lobe;
    row[brightest] -= by_dielectric * s * (1.0 - u) * base * FRAC_1_PI;
    row[BASE + c] =
        by_dielectric * (1.0 - s * most) * FRAC_1_PI + under * metallic * (1.0 - u) * lobe;
    row[METALLIC] = under * (metal - dielectric);
    row[CLEARCOAT] = sample.coat_fresnel * (coat_lobe - material);
    (under * material + x[CLEARCOAT] * sample.coat_fresnel * coat_lobe, row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::catalog;

    #[test]
    fn factors_are_in_their_ranges() {
        for entry in catalog().iter().step_by(25) {
            let GltfFit { material, residual, .. } = fit(&entry.material);
            let unit = material.base_color.into_iter().chain([
                material.metallic,
                material.roughness,
                material.specular_factor,
            ]);
            assert!(unit.into_iter().all(|x| (0.0..=1.0).contains(&x)), "{material:?}");
            assert!(material.specular_color.iter().all(|x| (0.0..=25.0).contains(x)));
            assert!(residual.iter().all(|r| *r < 0.3), "{residual:?}");
        }
    }
}
