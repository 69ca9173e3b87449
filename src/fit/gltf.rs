//! The best glTF 2.0 material.

use std::f64::consts::FRAC_1_PI;

use nalgebra::DVector;
use serde::Serialize;

use crate::brdf::Distribution;
use crate::brdf::gltf::{DIELECTRIC_F0, GltfBrdf, coat_fresnel, ggx_lobe, schlick_weight};
use crate::fit::metric::Metric;
use crate::fit::reason::{self, Reason};
use crate::fit::target::{Pair, Residuals as FitResiduals, Target};
use crate::fit::valleys::{Valley, valleys};
use crate::material::Material;
use crate::math::box_least_squares::{Bounds, Minimum, NormalEquations, Residuals, Term, minimise};

/// The best glTF material, with its residuals.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GltfFit {
    /// The material's factors.
    #[serde(flatten)]
    pub material: GltfBrdf,
    /// How far it is from the SGD material.
    pub residuals: FitResiduals,
    /// What is odd about the material or the fit.
    pub reasons: Vec<Reason>,
}

/// Roughness that is searched: below it a lobe is a mirror for any picture.
pub const ROUGHNESS_RANGE: [f64; 2] = [0.03, 1.0];
/// Roughness values looked at before the best are refined.
const SCAN: usize = 8;
/// Relative decrease of Σ r² at which the scan and the refinement end.
const SCAN_TOLERANCE: f64 = 3e-2;
const TOLERANCE: f64 = 1e-5;
/// The same at which a coat has shown whether it pays.
const COAT_TOLERANCE: f64 = 1e-3;

/// An extension is used only where it lowers the residual to this share of what it is without.
const WORTHWHILE: f64 = 0.95;

/// The best glTF material in the default metric.
#[must_use]
pub fn fit(material: &Material) -> GltfFit {
    fit_target(&Target::new(material), Metric::default())
}

/// The best glTF material for a target, in `metric`.
///
/// Three families, each containing materials that the one before cannot reach: core properties
/// alone; a dielectric with `KHR_materials_specular`, whose F0 may be any colour; that with
/// `KHR_materials_clearcoat`. A family is chosen where it lowers the residual by more than 5 %. Its
/// best material is found by a scan over roughness and a descent from every valley that shows.
#[must_use]
pub fn fit_target(target: &Target, metric: Metric) -> GltfFit {
    let search = Search::new(target, metric);
    let core = search.best(Family::Core);
    let specular = search.best(Family::Specular);
    let coated = search.coated(&specular);
    let mut chosen = Choice { solution: &core, reasons: reason::of_material(&target.material) };
    chosen.prefer(&specular, |core| Reason::SpecularExtension { core });
    chosen.prefer(&coated, |without| Reason::Clearcoat { without });
    chosen.finish(target)
}

/// Whether `other` has a residual so much lower that its extension pays.
fn worthwhile(other: &Minimum, without: &Minimum) -> bool {
    other.squares < WORTHWHILE.powi(2) * without.squares
}

/// The best so far, and why.
struct Choice<'a> {
    solution: &'a Minimum,
    reasons: Vec<Reason>,
}

impl<'a> Choice<'a> {
    /// Takes `other` where it is worth its extension; the reason is given the residual without.
    fn prefer(&mut self, other: &'a Minimum, reason: impl Fn(f64) -> Reason) {
        if worthwhile(other, self.solution) {
            self.reasons.push(reason(self.solution.squares.sqrt()));
            self.solution = other;
        }
    }

    fn finish(mut self, target: &Target) -> GltfFit {
        let material = gltf_material(&self.solution.x);
        if material.metallic > 0.5 {
            self.reasons.push(Reason::Metal);
        }
        self.reasons.extend(at_range_end(&self.solution.x));
        GltfFit { residuals: target.residuals(&material), material, reasons: self.reasons }
    }
}

/// The factors that the range of glTF stops, by name.
fn at_range_end(x: &DVector<f64>) -> Vec<Reason> {
    let [low, high] = ROUGHNESS_RANGE;
    let ends = [
        ("specular colour (F0 = 1)", (F0..F0 + 3).any(|f0| x[f0] >= 1.0)),
        ("base colour (1)", (BASE..BASE + 3).any(|base| x[base] >= 1.0)),
        ("roughness (as a mirror)", x[ROUGHNESS] <= low),
        ("roughness (1)", x[ROUGHNESS] >= high),
    ];
    ends.into_iter()
        .filter(|(_, at_end)| *at_end)
        .map(|(name, _)| Reason::AtRangeEnd(name))
        .collect()
}

/// Where each unknown stands: specular factor, F0 of the three channels, base colour of the three,
/// metallic, roughness, clearcoat, its roughness.
const SPECULAR: usize = 0;
const F0: usize = 1;
const BASE: usize = 4;
const METALLIC: usize = 7;
const ROUGHNESS: usize = 8;
const CLEARCOAT: usize = 9;
const COAT_ROUGHNESS: usize = 10;
const UNKNOWNS: usize = 11;

/// Which unknowns a fit may move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Family {
    /// Base colour, metallic and roughness.
    Core,
    /// Base colour, roughness, specular factor and colour of a dielectric.
    Specular,
    /// The same under a clear coat.
    Coated,
}

impl Family {
    fn bounds(self) -> Bounds {
        const F: f64 = DIELECTRIC_F0;
        let [low, high] = ROUGHNESS_RANGE;
        let (lower, upper) = match self {
            Self::Core => (
                [1.0, F, F, F, 0.0, 0.0, 0.0, 0.0, low, 0.0, high],
                [1.0, F, F, F, 1.0, 1.0, 1.0, 1.0, high, 0.0, high],
            ),
            Self::Specular => (
                [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, low, 0.0, high],
                [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, high, 0.0, high],
            ),
            Self::Coated => (
                [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, low, 0.0, low],
                [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, high, 1.0, high],
            ),
        };
        let vector = |values: [f64; UNKNOWNS]| DVector::from_column_slice(&values);
        Bounds { lower: vector(lower), upper: vector(upper) }
    }

    /// The family with its roughness held.
    fn bounds_at(self, roughness: f64) -> Bounds {
        let mut bounds = self.bounds();
        (bounds.lower[ROUGHNESS], bounds.upper[ROUGHNESS]) = (roughness, roughness);
        bounds
    }
}

/// The factors of a solution.
fn gltf_material(x: &DVector<f64>) -> GltfBrdf {
    // A specular term below what 16 bits show is none, and its colour of no consequence.
    let visible = x[SPECULAR] > 1.0 / 65535.0;
    let coated = x[CLEARCOAT] > 0.0;
    GltfBrdf {
        base_color: std::array::from_fn(|c| x[BASE + c]),
        metallic: x[METALLIC],
        roughness: x[ROUGHNESS],
        specular_factor: if visible { x[SPECULAR] } else { 0.0 },
        specular_color: std::array::from_fn(
            |c| {
                if visible { x[F0 + c] / DIELECTRIC_F0 } else { 1.0 }
            },
        ),
        clearcoat: coated.then_some(x[CLEARCOAT]),
        clearcoat_roughness: coated.then_some(x[COAT_ROUGHNESS]),
    }
}

/// What does not depend on the unknowns at a pair of directions.
struct Fixed {
    schlick_weight: f64,
    /// For light along either direction: the coat's Fresnel term is the viewer's.
    coat_fresnel: [f64; 2],
}

/// A lobe V·D at a pair, and its derivative by roughness.
#[derive(Clone, Copy, Default)]
struct LobeSample {
    value: f64,
    slope: f64,
}

struct Search<'a> {
    target: &'a Target,
    metric: Metric,
    goals: [Vec<[f64; 2]>; 3],
    fixed: Vec<Fixed>,
}

impl<'a> Search<'a> {
    fn new(target: &'a Target, metric: Metric) -> Self {
        let fixed = |pair: &Pair| Fixed {
            schlick_weight: schlick_weight(pair.cos_theta_d),
            coat_fresnel: [1, 0].map(|viewer| coat_fresnel(pair.cos_theta[viewer])),
        };
        let goals = std::array::from_fn(|c| target.goal(metric, c));
        Self { target, metric, goals, fixed: target.pairs.iter().map(fixed).collect() }
    }

    /// The best of a family without a coat.
    fn best(&self, family: Family) -> Minimum {
        let scan = self.scan(family);
        let starts = valleys(&scan.iter().map(|m| m.squares).collect::<Vec<_>>());
        let equations = |x: &DVector<f64>| self.equations(x, &self.lobe(x[ROUGHNESS]));
        let descend =
            |Valley(i): Valley| minimise(equations, &scan[i].x, &family.bounds(), TOLERANCE);
        lowest(starts.into_iter().map(descend))
    }

    /// The best factors of a family at roughness values from rough to smooth.
    fn scan(&self, family: Family) -> Vec<Minimum> {
        let [low, high] = ROUGHNESS_RANGE;
        let mut x =
            DVector::from_column_slice(&[0.5, 0.2, 0.2, 0.2, 0.3, 0.3, 0.3, 0.5, high, 0.0, high]);
        let at = |i: usize| {
            let roughness = high + (low - high) * i as f64 / (SCAN - 1) as f64;
            let lobe = self.lobe(roughness);
            let bounds = family.bounds_at(roughness);
            let best = minimise(|x| self.equations(x, &lobe), &x, &bounds, SCAN_TOLERANCE);
            x.clone_from(&best.x);
            best
        };
        (0..SCAN).map(at).collect()
    }

    /// The best with a clear coat over a dielectric, from coats sharper and softer than its lobe.
    fn coated(&self, plain: &Minimum) -> Minimum {
        let equations = |x: &DVector<f64>| {
            self.coated_equations(x, &self.lobe(x[ROUGHNESS]), &self.lobe(x[COAT_ROUGHNESS]))
        };
        let bounds = Family::Coated.bounds();
        let descend = |factor: f64| {
            let mut x = plain.x.clone();
            x[CLEARCOAT] = 0.5;
            x[COAT_ROUGHNESS] = factor * x[ROUGHNESS];
            minimise(equations, &x, &bounds, COAT_TOLERANCE)
        };
        let rough = lowest([0.4, 2.5].into_iter().map(descend));
        if worthwhile(&rough, plain) {
            minimise(equations, &rough.x, &bounds, TOLERANCE)
        } else {
            rough
        }
    }

    /// V·D at every pair.
    fn lobe(&self, roughness: f64) -> Vec<LobeSample> {
        self.target.pairs.iter().map(|pair| lobe_sample(roughness, pair)).collect()
    }

    fn equations(&self, x: &DVector<f64>, lobe: &[LobeSample]) -> NormalEquations {
        let brightest = brightest(x);
        let mut equations = NormalEquations::zero(UNKNOWNS);
        for c in 0..3 {
            let mut sums = Residuals::none();
            for (i, lobe) in lobe.iter().enumerate() {
                let (f, row) = material(x, c, brightest, &self.fixed[i], *lobe);
                sums.add(self.metric.term(f, &self.target.pairs[i], self.goals[c][i]), &row);
            }
            let places = [SPECULAR, F0 + c, brightest, BASE + c, METALLIC, ROUGHNESS];
            equations.add(&sums, places);
        }
        equations
    }

    fn coated_equations(
        &self,
        x: &DVector<f64>,
        lobe: &[LobeSample],
        coat_lobe: &[LobeSample],
    ) -> NormalEquations {
        let brightest = brightest(x);
        let mut equations = NormalEquations::zero(UNKNOWNS);
        for c in 0..3 {
            let mut sums = Residuals::none();
            for (i, (lobe, coat)) in lobe.iter().zip(coat_lobe).enumerate() {
                let (material, row) = material(x, c, brightest, &self.fixed[i], *lobe);
                for side in 0..2 {
                    let coat_fresnel = self.fixed[i].coat_fresnel[side];
                    let share = coat_fresnel * x[CLEARCOAT];
                    let f = (1.0 - share) * material + share * coat.value;
                    let [s, f0, most, base, metallic, roughness] = row.map(|d| d * (1.0 - share));
                    let by_coat = coat_fresnel * (coat.value - material);
                    let by_coat_roughness = share * coat.slope;
                    let row = [s, f0, most, base, metallic, roughness, by_coat, by_coat_roughness];
                    sums.add(self.term(c, i, side, f), &row);
                }
            }
            let places = [
                SPECULAR,
                F0 + c,
                brightest,
                BASE + c,
                METALLIC,
                ROUGHNESS,
                CLEARCOAT,
                COAT_ROUGHNESS,
            ];
            equations.add(&sums, places);
        }
        equations
    }

    /// The residual g(f) − goal at a pair for light from one side.
    #[inline]
    fn term(&self, c: usize, i: usize, side: usize, f: f64) -> Term {
        let pair = &self.target.pairs[i];
        let (value, slope) = self.metric.transform(f, pair.cos_theta[side]);
        Term::new(pair.weights[side], value - self.goals[c][i][side], slope)
    }
}

/// The channel whose F0 is the largest, as the place of its unknown.
fn brightest(x: &DVector<f64>) -> usize {
    (F0..F0 + 3).max_by(|a, b| x[*a].total_cmp(&x[*b])).unwrap_or(F0)
}

/// The lowest of at least one minimum.
fn lowest(minima: impl Iterator<Item = Minimum>) -> Minimum {
    minima
        .min_by(|a, b| a.squares.total_cmp(&b.squares))
        .expect("a scan has at least one valley, its lowest point")
}

/// V·D and its derivative by roughness.
fn lobe_sample(roughness: f64, pair: &Pair) -> LobeSample {
    let alpha = roughness * roughness;
    let value = ggx_lobe(alpha, pair.tan2_theta_h, pair.cot_theta, pair.cos_theta);
    let lambda = pair.cot_theta.map(|cot| Distribution::Ggx.lambda(alpha, cot));
    let slope = pair.cot_theta.map(|cot| Distribution::Ggx.lambda_slope(alpha, cot));
    let by_log_alpha = Distribution::Ggx.ndf_slope(alpha, pair.tan2_theta_h)
        - (slope[0] + slope[1]) / (1.0 + lambda[0] + lambda[1]);
    LobeSample { value, slope: value * by_log_alpha * 2.0 / roughness }
}

/// f of channel `c` without a coat (see [`GltfBrdf`] for the formula) and its derivatives by
/// specular factor, own F0, largest F0, base colour, metallic and roughness.
#[inline]
fn material(
    x: &DVector<f64>,
    c: usize,
    brightest: usize,
    fixed: &Fixed,
    lobe: LobeSample,
) -> (f64, [f64; 6]) {
    let u = fixed.schlick_weight;
    let (s, f0, base, metallic) = (x[SPECULAR], x[F0 + c], x[BASE + c], x[METALLIC]);
    let fr = f0 + (1.0 - f0) * u;
    let most = x[brightest] + (1.0 - x[brightest]) * u;
    let metal_fr = base + (1.0 - base) * u;
    let through = 1.0 - s * most;
    let dielectric = through * base * FRAC_1_PI + s * fr * lobe.value;
    let metal = metal_fr * lobe.value;
    let nonmetallic = 1.0 - metallic;
    let row = [
        nonmetallic * (fr * lobe.value - most * base * FRAC_1_PI),
        nonmetallic * s * (1.0 - u) * lobe.value,
        -nonmetallic * s * (1.0 - u) * base * FRAC_1_PI,
        nonmetallic * through * FRAC_1_PI + metallic * (1.0 - u) * lobe.value,
        metal - dielectric,
        (nonmetallic * s * fr + metallic * metal_fr) * lobe.slope,
    ];
    (nonmetallic * dielectric + metallic * metal, row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Reflectance as _;
    use crate::material::{catalog, find};

    #[test]
    fn factors_are_in_their_ranges() {
        for entry in catalog().iter().step_by(25) {
            let GltfFit { material, residuals, .. } = fit(&entry.material);
            let unit = material.base_color.into_iter().chain([
                material.metallic,
                material.roughness,
                material.specular_factor,
            ]);
            assert!(unit.into_iter().all(|x| (0.0..=1.0).contains(&x)), "{material:?}");
            assert!(material.specular_color.iter().all(|x| (0.0..=25.0).contains(x)));
            assert!(residuals.cube_root.iter().all(|r| *r < 0.3), "{residuals:?}");
        }
    }
    /// What the search takes for a coated material is the material: each pair lit from both sides.
    #[test]
    fn the_search_sums_what_the_material_is() {
        let target = Target::new(&find("chrome").expect("in the catalogue").material);
        let (metric, search) = (Metric::default(), Search::new(&target, Metric::default()));
        let x = [0.8, 0.1, 0.2, 0.3, 0.4, 0.3, 0.2, 0.0, 0.5, 0.7, 0.2];
        let x = DVector::from_column_slice(&x);
        let [lobe, coat] = [ROUGHNESS, COAT_ROUGHNESS].map(|at| search.lobe(x[at]));
        let searched = search.coated_equations(&x, &lobe, &coat).squares;
        let brdf = gltf_material(&x);
        let square = |i: usize, side: usize| {
            let pair = &target.pairs[i];
            let directions = [(pair.wi, pair.wo), (pair.wo, pair.wi)];
            let f = brdf.eval(directions[side].0, directions[side].1);
            let residual = |c: usize| {
                metric.transform(f[c], pair.cos_theta[side]).0 - search.goals[c][i][side]
            };
            (0..3).map(|c| pair.weights[side] * residual(c).powi(2)).sum::<f64>()
        };
        let summed: f64 =
            (0..target.pairs.len()).flat_map(|i| [0, 1].map(|side| square(i, side))).sum();
        assert!((searched / summed - 1.0).abs() < 1e-9, "{searched} {summed}");
    }
}
