//! The best glTF material for a measurement, in the mean of the forms that engines use.

use nalgebra::DVector;
use serde::Serialize;

use crate::brdf::Reflectance;
use crate::brdf::engine::{Engine, PairCosines};
use crate::brdf::gltf::{DIELECTRIC_F0, GltfBrdf};
use crate::fit::descent::{by_steps, further, lowest};
use crate::fit::measured_target::{MeasuredPair, MeasuredTarget};
use crate::math::least_squares::{Bounds, Minimum, NormalEquations};

/// A glTF material and how near it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GltfMeasuredFit {
    /// The factors.
    pub material: GltfBrdf,
    /// Mean ΔE over the ball that was fitted to, in the mean of the forms.
    pub difference: f64,
}

/// A clear coat is used where it lowers the objective to this share.
const WORTHWHILE: f64 = 0.93;
/// Share of the pairs that starts are compared on.
const THINNING: usize = 4;

/// Where each unknown stands: base colour, metallic, roughness, specular factor, F0 of the specular
/// colour, clearcoat, its roughness.
const BASE: usize = 0;
const METALLIC: usize = 3;
const ROUGHNESS: usize = 4;
const SPECULAR: usize = 5;
const F0: usize = 6;
const COAT: usize = 9;
const COAT_ROUGHNESS: usize = 10;
const UNKNOWNS: usize = 11;

/// Least roughness: below it a lobe is a mirror for any picture.
const SMOOTHEST: f64 = 0.03;

/// The best material for a target: least in the mean over appendix B of the specification and the
/// forms of five engines, so that none of them shows a surface far from the measured one.
#[must_use]
pub fn fit(target: &MeasuredTarget) -> GltfMeasuredFit {
    let thin = Forms::of(target.thinned(THINNING));
    let whole = Forms::of(target.clone());
    let coated = bounds(1.0);
    let rough = |x: &DVector<f64>| thin.equations(x, &coated);
    let fine = |x: &DVector<f64>| whole.equations(x, &coated);
    let best = lowest(rough, fine, starts(target), &coated);
    let chosen = whole.without_idle_coat(best);
    let material = material(&chosen.x);
    GltfMeasuredFit { material, difference: whole.difference(&material) }
}

/// The bounds, a clear coat up to `coat`.
fn bounds(coat: f64) -> Bounds {
    let mut lower = [0.0; UNKNOWNS];
    let mut upper = [1.0; UNKNOWNS];
    (lower[ROUGHNESS], lower[COAT_ROUGHNESS]) = (SMOOTHEST, SMOOTHEST);
    upper[COAT] = coat;
    Bounds { lower: DVector::from_column_slice(&lower), upper: DVector::from_column_slice(&upper) }
}

fn material(x: &DVector<f64>) -> GltfBrdf {
    let coated = x[COAT] > 0.0;
    let visible = x[SPECULAR] > 1.0 / 65535.0;
    let tint = |c: usize| if visible { x[F0 + c] / DIELECTRIC_F0 } else { 1.0 };
    GltfBrdf {
        base_color: std::array::from_fn(|c| x[BASE + c]),
        metallic: x[METALLIC],
        roughness: x[ROUGHNESS],
        specular_factor: if visible { x[SPECULAR] } else { 0.0 },
        specular_color: std::array::from_fn(tint),
        clearcoat: coated.then_some(x[COAT]),
        clearcoat_roughness: coated.then_some(x[COAT_ROUGHNESS]),
    }
}

/// Dielectrics and metals, smooth and rough, with a coat sharper or wider than the base.
fn starts(target: &MeasuredTarget) -> Vec<DVector<f64>> {
    let base = target.typical().map(|f| (std::f64::consts::PI * f).clamp(0.01, 0.9));
    let start = |metallic: f64, roughness: f64, coat_roughness: f64| {
        let x = [
            base[0],
            base[1],
            base[2],
            metallic,
            roughness,
            0.9,
            0.04,
            0.04,
            0.04,
            0.1,
            coat_roughness,
        ];
        DVector::from_column_slice(&x)
    };
    let kinds = [0.02, 0.9];
    let roughness = [(0.2, 0.5), (0.35, 0.1), (0.6, 0.2), (0.6, 0.4)];
    kinds
        .into_iter()
        .flat_map(|metallic| roughness.map(|(base, coat)| start(metallic, base, coat)))
        .collect()
}

/// A target and its pairs as the forms see them.
struct Forms {
    target: MeasuredTarget,
    cosines: Vec<PairCosines>,
}

impl Forms {
    fn of(target: MeasuredTarget) -> Self {
        let cosines = |pair: &MeasuredPair| PairCosines {
            i: pair.cos_theta[0],
            o: pair.cos_theta[1],
            tan2_h: pair.tan2_theta_h,
            d: pair.cos_theta_d,
        };
        Self { cosines: target.pairs.iter().map(cosines).collect(), target }
    }

    /// The mean of the forms' equations.
    fn equations(&self, x: &DVector<f64>, bounds: &Bounds) -> NormalEquations {
        let mut mean = by_steps(&self.target, x, bounds, material, |m, i| self.appendix_b(m, i));
        for engine in Engine::ALL {
            let of = |m: &GltfBrdf, i: usize| engine.eval(m, &self.cosines[i]);
            let form = by_steps(&self.target, x, bounds, material, of);
            mean.squares += form.squares;
            mean.gradient += form.gradient;
            mean.hessian += form.hessian;
        }
        let share = 1.0 / (1 + Engine::ALL.len()) as f64;
        mean.squares *= share;
        mean.gradient *= share;
        mean.hessian *= share;
        mean
    }

    fn appendix_b(&self, material: &GltfBrdf, i: usize) -> [f64; 3] {
        let pair = &self.target.pairs[i];
        material.eval(pair.wi, pair.wo)
    }

    fn difference(&self, material: &GltfBrdf) -> f64 {
        let appendix_b = self.target.picture_difference(|i| self.appendix_b(material, i));
        let of = |engine: Engine| {
            self.target.picture_difference(|i| engine.eval(material, &self.cosines[i]))
        };
        let engines: f64 = Engine::ALL.into_iter().map(of).sum();
        (appendix_b + engines) / (1 + Engine::ALL.len()) as f64
    }

    /// The best without a coat where that is nearly as near.
    fn without_idle_coat(&self, coated: Minimum) -> Minimum {
        let bounds = bounds(0.0);
        let plain = further(|x| self.equations(x, &bounds), &coated.x, &bounds, 1e-5);
        if coated.squares < WORTHWHILE * plain.squares { coated } else { plain }
    }
}
