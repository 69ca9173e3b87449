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
    let [thin, whole] = [target.thinned(THINNING), target.clone()].map(Forms::of);
    let best = nearest(&thin, &whole, starts(target));
    // The best of one form alone leads to other local minima of the mean: one more start.
    let alone = nearest_appendix_b(&thin, &thin, starts(target));
    let kicked = KICKS.iter().map(|kick| kick.of(&best.x)).chain([alone.x]).collect();
    // A kick may lead to a worse minimum than the one it left.
    let again = nearest(&thin, &whole, kicked);
    let best = if again.squares < best.squares { again } else { best };
    let chosen = whole.without_idle_coat(best);
    let material = material(&chosen.x);
    GltfMeasuredFit { material, difference: whole.difference(&material) }
}

/// The best material as appendix B of the specification alone evaluates it: nearer there, and far
/// in engines that share the light between base and lobe in another way.
#[must_use]
pub fn fit_appendix_b(target: &MeasuredTarget) -> GltfBrdf {
    let [thin, whole] = [target.thinned(THINNING), target.clone()].map(Forms::of);
    material(&nearest_appendix_b(&thin, &whole, starts(target)).x)
}

/// The nearest in the mean of the forms that the starts lead to.
fn nearest(rough: &Forms, fine: &Forms, starts: Vec<DVector<f64>>) -> Minimum {
    let bounds = bounds(1.0);
    lowest(|x| rough.equations(x, &bounds), |x| fine.equations(x, &bounds), starts, &bounds)
}

/// The nearest in appendix B alone that the starts lead to.
fn nearest_appendix_b(rough: &Forms, fine: &Forms, starts: Vec<DVector<f64>>) -> Minimum {
    let bounds = bounds(1.0);
    lowest(|x| rough.of_appendix_b(x, &bounds), |x| fine.of_appendix_b(x, &bounds), starts, &bounds)
}

/// The bounds, a clear coat up to `coat`.
fn bounds(coat: f64) -> Bounds {
    let mut lower = [0.0; UNKNOWNS];
    let mut upper = [1.0; UNKNOWNS];
    (lower[ROUGHNESS], lower[COAT_ROUGHNESS]) = (SMOOTHEST, SMOOTHEST);
    upper[COAT] = coat;
    Bounds { lower: DVector::from_column_slice(&lower), upper: DVector::from_column_slice(&upper) }
}

/// The factors of a solution.
fn material(x: &DVector<f64>) -> GltfBrdf {
    let coated = x[COAT] > 0.0;
    // A specular term below what 16 bits show is none, and its colour of no consequence.
    let visible = x[SPECULAR] > 1.0 / 65535.0;
    GltfBrdf {
        base_color: std::array::from_fn(|c| x[BASE + c]),
        metallic: x[METALLIC],
        roughness: x[ROUGHNESS],
        specular_factor: if visible { x[SPECULAR] } else { 0.0 },
        specular_color: [0, 1, 2].map(|c| if visible { x[F0 + c] / DIELECTRIC_F0 } else { 1.0 }),
        clearcoat: coated.then_some(x[COAT]),
        clearcoat_roughness: coated.then_some(x[COAT_ROUGHNESS]),
    }
}

/// Metallic, roughness, F0 and coat roughness of the starts: dielectrics, bright ones, metals and
/// mixtures, with a coat sharper or wider than the base.
const STARTS: [[f64; 4]; 13] = [
    [0.02, 0.15, 0.1, 0.8],
    [0.02, 0.2, 0.04, 0.5],
    [0.02, 0.35, 0.04, 0.1],
    [0.02, 0.6, 0.04, 0.2],
    [0.02, 0.6, 0.2, 0.1],
    [0.02, 0.8, 0.3, 0.3],
    [0.9, 0.2, 0.04, 0.5],
    [0.9, 0.35, 0.04, 0.1],
    [0.9, 0.6, 0.04, 0.2],
    [0.1, 0.09, 0.03, 0.5],
    [0.5, 0.2, 0.04, 0.5],
    [0.5, 0.5, 0.04, 0.15],
    [0.5, 0.8, 0.2, 0.1],
];

/// A solution with another specular term or coat: where one of them vanished, nothing shows a
/// descent the way back.
struct Kick {
    specular: Option<[f64; 2]>,
    coat: Option<[f64; 2]>,
}

/// Specular factor and F0; clearcoat and its roughness over the base's.
const KICKS: [Kick; 5] = [
    Kick { specular: Some([0.6, 0.1]), coat: None },
    Kick { specular: Some([1.0, 0.5]), coat: None },
    Kick { specular: None, coat: Some([0.3, 0.4]) },
    Kick { specular: None, coat: Some([0.3, 2.0]) },
    Kick { specular: Some([0.8, 0.2]), coat: Some([0.5, 0.4]) },
];

impl Kick {
    fn of(&self, x: &DVector<f64>) -> DVector<f64> {
        let mut x = x.clone();
        if let Some([specular, f0]) = self.specular {
            x[SPECULAR] = specular;
            (F0..F0 + 3).for_each(|i| x[i] = f0);
        }
        if let Some([coat, ratio]) = self.coat {
            (x[COAT], x[COAT_ROUGHNESS]) = (coat, ratio * x[ROUGHNESS]);
        }
        x
    }
}

/// The starts of the descents: [`STARTS`] with the surface's base colour outside its highlight.
fn starts(target: &MeasuredTarget) -> Vec<DVector<f64>> {
    let base = target.typical().map(|f| (std::f64::consts::PI * f).clamp(0.01, 0.9));
    STARTS.map(|row| start(base, row)).to_vec()
}

/// The unknowns of a base colour and a row of [`STARTS`].
fn start(base: [f64; 3], [metallic, roughness, f0, coat_roughness]: [f64; 4]) -> DVector<f64> {
    let mut x = DVector::repeat(UNKNOWNS, f0);
    (0..3).for_each(|c| x[BASE + c] = base[c]);
    // A little coat from the start: the roughness of none has no slope.
    (x[METALLIC], x[ROUGHNESS], x[SPECULAR]) = (metallic, roughness, 0.9);
    (x[COAT], x[COAT_ROUGHNESS]) = (0.1, coat_roughness);
    x
}

/// A pair as the engines' forms see it.
fn pair_cosines(pair: &MeasuredPair) -> PairCosines {
    PairCosines {
        i: pair.cos_theta[0],
        o: pair.cos_theta[1],
        tan2_h: pair.tan2_theta_h,
        d: pair.cos_theta_d,
    }
}

/// A target and its pairs as the forms see them.
struct Forms {
    target: MeasuredTarget,
    cosines: Vec<PairCosines>,
}

impl Forms {
    fn of(target: MeasuredTarget) -> Self {
        Self { cosines: target.pairs.iter().map(pair_cosines).collect(), target }
    }

    /// The mean of the forms' equations.
    fn equations(&self, x: &DVector<f64>, bounds: &Bounds) -> NormalEquations {
        let mut mean = self.of_appendix_b(x, bounds);
        for engine in Engine::ALL {
            // Each form's own errors count: reflectances averaged first would cancel them.
            let form = by_steps(&self.target, x, bounds, material, |material, i| {
                engine.eval(material, &self.cosines[i])
            });
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

    /// The equations of appendix B alone.
    fn of_appendix_b(&self, x: &DVector<f64>, bounds: &Bounds) -> NormalEquations {
        by_steps(&self.target, x, bounds, material, |m, i| self.appendix_b(m, i))
    }

    /// f at the pair of an index, as appendix B evaluates it.
    fn appendix_b(&self, material: &GltfBrdf, i: usize) -> [f64; 3] {
        let pair = &self.target.pairs[i];
        material.eval(pair.wi, pair.wo)
    }

    /// The mean ΔE over the ball, in the mean of the forms.
    fn difference(&self, material: &GltfBrdf) -> f64 {
        let appendix_b = self.target.picture_difference(|i| self.appendix_b(material, i));
        let engines = Engine::ALL.into_iter().map(|engine| {
            self.target.picture_difference(|i| engine.eval(material, &self.cosines[i]))
        });
        let engines: f64 = engines.sum();
        (appendix_b + engines) / (1 + Engine::ALL.len()) as f64
    }

    /// The best without a coat where that is nearly as near.
    fn without_idle_coat(&self, coated: Minimum) -> Minimum {
        let bounds = bounds(0.0);
        // The upper bound 0 takes the coat away and lets the other factors make up for it.
        let plain = further(|x| self.equations(x, &bounds), &coated.x, &bounds, 1e-5);
        if coated.squares < WORTHWHILE * plain.squares { coated } else { plain }
    }
}
