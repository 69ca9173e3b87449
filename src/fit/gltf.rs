//! The best glTF 2.0 material.

use std::f64::consts::FRAC_1_PI;
use std::slice::from_ref;

use nalgebra::DVector;
use serde::Serialize;

use crate::brdf::gltf::{DIELECTRIC_F0, GltfBrdf, coat_fresnel, ggx_lobe, schlick_weight};
use crate::fit::lanes::{Block, LobeSamples};
use crate::fit::metric::Metric;
use crate::fit::minima::{local_minima, lowest};
use crate::fit::reason::{self, Reason};
use crate::fit::target::{Pair, Residuals as FitResiduals, Target};
use crate::material::Material;
use crate::math::instruction_set::{InstructionSet, per_instruction_set};
use crate::math::least_squares::{
    Bounds, LANES, Lanes, Minimum, NormalEquations, Residuals, Terms, minimise,
};
use crate::microfacet::ggx;

/// The best glTF material, with its residuals.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GltfFit {
    /// The material's factors.
    #[serde(flatten)]
    pub material: GltfBrdf,
    /// How far it is from the SGD material.
    pub residuals: FitResiduals,
    /// Oddities of the material or the fit.
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
///
/// # Example
///
/// ```
/// use sgdbake::{fit_gltf, named};
///
/// let fit = fit_gltf(named("alum-bronze")?);
/// assert!((0.0..=1.0).contains(&fit.material.roughness));
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
#[must_use]
pub fn fit(material: &Material) -> GltfFit {
    fit_target(&Target::new(material), Metric::default())
}

/// The best glTF material for a target, in `metric`.
///
/// Three families, each containing materials that the one before cannot reach: core properties
/// alone; a dielectric with `KHR_materials_specular`, whose F0 may be any colour; that with
/// `KHR_materials_clearcoat`. A family is chosen where it lowers the residual by more than 5 %. Its
/// best material is found by a scan over roughness and a descent from every local minimum that shows.
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

/// Returns whether `other` has a residual so much lower that its extension pays.
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

/// The quantities at the pairs of a block that do not depend on the unknowns.
struct Fixed {
    schlick_weight: Lanes,
    /// For light along either direction: the coat's Fresnel term is the viewer's.
    coat_fresnel: [Lanes; 2],
    tan2_theta_h: Lanes,
    cot_theta: [Lanes; 2],
    cos_theta: [Lanes; 2],
}

impl Fixed {
    /// Those of a target, block by block.
    fn blocks(target: &Target) -> Vec<Self> {
        let side = |of: fn(&Pair) -> [f64; 2], none: f64| {
            [0, 1].map(|side| target.lanes(|pair| of(pair)[side], none))
        };
        let schlick_weight = target.lanes(|pair| schlick_weight(pair.cos_theta_d), 0.0);
        let coat_fresnel =
            side(|pair| [1, 0].map(|viewer| coat_fresnel(pair.cos_theta[viewer])), 0.0);
        let tan2_theta_h = target.lanes(|pair| pair.tan2_theta_h, 1.0);
        let cot_theta = side(|pair| pair.cot_theta, 1.0);
        let cos_theta = side(|pair| pair.cos_theta, 1.0);
        let block = |i: usize| Self {
            schlick_weight: schlick_weight[i],
            coat_fresnel: coat_fresnel.each_ref().map(|side| side[i]),
            tan2_theta_h: tan2_theta_h[i],
            cot_theta: cot_theta.each_ref().map(|side| side[i]),
            cos_theta: cos_theta.each_ref().map(|side| side[i]),
        };
        (0..schlick_weight.len()).map(block).collect()
    }
}

struct Search {
    metric: Metric,
    set: InstructionSet,
    blocks: Vec<Block>,
    fixed: Vec<Fixed>,
}

impl Search {
    fn new(target: &Target, metric: Metric) -> Self {
        Self {
            metric,
            set: InstructionSet::widest(),
            blocks: target.blocks(metric),
            fixed: Fixed::blocks(target),
        }
    }

    /// The best of a family without a coat.
    fn best(&self, family: Family) -> Minimum {
        let scan = self.scan(family);
        let starts = local_minima(&scan.iter().map(|m| m.squares).collect::<Vec<_>>());
        let equations = |x: &DVector<f64>| self.equations(x, &self.lobe(x[ROUGHNESS]));
        let descend = |i: usize| minimise(equations, &scan[i].x, &family.bounds(), TOLERANCE);
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
    fn lobe(&self, roughness: f64) -> Vec<LobeSamples> {
        dispatch::lobe(self.set, self, roughness)
    }

    fn equations(&self, x: &DVector<f64>, lobe: &[LobeSamples]) -> NormalEquations {
        let (brightest, channels) = (brightest(x), Factors::of(x));
        let mut equations = NormalEquations::zero(UNKNOWNS);
        for (c, factors) in channels.iter().enumerate() {
            let places = [SPECULAR, F0 + c, brightest, BASE + c, METALLIC, ROUGHNESS];
            equations.add(&dispatch::residuals(self.set, self, c, factors, lobe), places);
        }
        equations
    }

    fn coated_equations(
        &self,
        x: &DVector<f64>,
        lobe: &[LobeSamples],
        coat: &[LobeSamples],
    ) -> NormalEquations {
        let (brightest, channels) = (brightest(x), Factors::of(x));
        let mut equations = NormalEquations::zero(UNKNOWNS);
        for (c, factors) in channels.iter().enumerate() {
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
            let clearcoat = x[CLEARCOAT];
            let sums =
                dispatch::coated_residuals(self.set, self, c, factors, clearcoat, [lobe, coat]);
            equations.add(&sums, places);
        }
        equations
    }

    /// The residuals of a channel without a coat.
    #[inline(always)]
    fn residuals(&self, c: usize, factors: &Factors, lobe: &[LobeSamples]) -> Residuals<6> {
        let mut sums = Residuals::none();
        for ((block, fixed), lobe) in self.blocks.iter().zip(&self.fixed).zip(lobe) {
            let (f, row) = factors.material(fixed, lobe);
            let mut terms = Terms::default();
            self.metric.add(&mut terms, &f, &block.sides, c);
            sums.add(&terms, &row);
        }
        sums
    }

    /// The residuals of a channel under a coat.
    #[inline(always)]
    fn coated_residuals(
        &self,
        c: usize,
        factors: &Factors,
        clearcoat: f64,
        [lobe, coat]: [&[LobeSamples]; 2],
    ) -> Residuals<8> {
        let mut sums = Residuals::none();
        for (i, (block, fixed)) in self.blocks.iter().zip(&self.fixed).enumerate() {
            let (material, by_factor) = factors.material(fixed, &lobe[i]);
            for (side, coat_fresnel) in block.sides.iter().zip(&fixed.coat_fresnel) {
                let (mut f, mut row) = ([0.0; LANES], [[0.0; LANES]; 8]);
                for l in 0..LANES {
                    let share = coat_fresnel[l] * clearcoat;
                    f[l] = (1.0 - share) * material[l] + share * coat[i].value[l];
                    for n in 0..6 {
                        row[n][l] = (1.0 - share) * by_factor[n][l];
                    }
                    row[6][l] = coat_fresnel[l] * (coat[i].value[l] - material[l]);
                    row[7][l] = share * coat[i].slope[l];
                }
                let mut terms = Terms::default();
                self.metric.add(&mut terms, &f, from_ref(side), c);
                sums.add(&terms, &row);
            }
        }
        sums
    }
}

/// The sums once per instruction set, all with the same bits.
mod dispatch {
    use super::*;

    per_instruction_set!(lobe(search: &Search, roughness: f64) -> Vec<LobeSamples> {
        search.fixed.iter().map(|fixed| lobe_samples(roughness, fixed)).collect()
    });
    per_instruction_set!(residuals
    (search: &Search, c: usize, factors: &Factors, lobe: &[LobeSamples]) -> Residuals<6> {
        search.residuals(c, factors, lobe)
    });
    per_instruction_set!(coated_residuals
        (search: &Search, c: usize, factors: &Factors, clearcoat: f64, lobes: [&[LobeSamples]; 2])
        -> Residuals<8> { search.coated_residuals(c, factors, clearcoat, lobes) });
}

/// The channel whose F0 is the largest, as the place of its unknown.
fn brightest(x: &DVector<f64>) -> usize {
    (F0..F0 + 3).max_by(|a, b| x[*a].total_cmp(&x[*b])).unwrap_or(F0)
}

/// V·D and its derivative by roughness.
#[inline(always)]
fn lobe_samples(roughness: f64, fixed: &Fixed) -> LobeSamples {
    let alpha = roughness * roughness;
    let mut samples = LobeSamples::ZERO;
    for l in 0..LANES {
        let [cot_i, cot_o] = [fixed.cot_theta[0][l], fixed.cot_theta[1][l]];
        let [cos_i, cos_o] = [fixed.cos_theta[0][l], fixed.cos_theta[1][l]];
        let value = ggx_lobe(alpha, fixed.tan2_theta_h[l], [cot_i, cot_o], [cos_i, cos_o]);
        let lambdas = ggx::lambda(cot_i / alpha) + ggx::lambda(cot_o / alpha);
        let slopes =
            ggx::lambda_by_log_alpha(cot_i / alpha) + ggx::lambda_by_log_alpha(cot_o / alpha);
        let by_log_alpha =
            ggx::ndf_by_log_alpha(alpha, fixed.tan2_theta_h[l]) - slopes / (1.0 + lambdas);
        samples.value[l] = value;
        samples.slope[l] = value * by_log_alpha * 2.0 / roughness;
    }
    samples
}

/// The factors that f of a channel depends on besides its lobe.
struct Factors {
    specular: f64,
    f0: f64,
    /// The largest F0 of the three channels.
    brightest: f64,
    base: f64,
    metallic: f64,
}

impl Factors {
    fn of(x: &DVector<f64>) -> [Self; 3] {
        [0, 1, 2].map(|c| Self {
            specular: x[SPECULAR],
            f0: x[F0 + c],
            brightest: x[brightest(x)],
            base: x[BASE + c],
            metallic: x[METALLIC],
        })
    }

    /// f without a coat (see [`GltfBrdf`] for the formula) and its derivatives by specular factor,
    /// own F0, largest F0, base colour, metallic and roughness.
    #[inline(always)]
    fn material(&self, fixed: &Fixed, lobe: &LobeSamples) -> (Lanes, [Lanes; 6]) {
        let Self { specular, f0, brightest, base, metallic } = *self;
        let nonmetallic = 1.0 - metallic;
        let (mut f, mut row) = ([0.0; LANES], [[0.0; LANES]; 6]);
        for l in 0..LANES {
            let (u, value) = (fixed.schlick_weight[l], lobe.value[l]);
            let fr = f0 + (1.0 - f0) * u;
            let most = brightest + (1.0 - brightest) * u;
            let metal_fr = base + (1.0 - base) * u;
            let through = 1.0 - specular * most;
            let dielectric = through * base * FRAC_1_PI + specular * fr * value;
            let metal = metal_fr * value;
            f[l] = nonmetallic * dielectric + metallic * metal;
            row[0][l] = nonmetallic * (fr * value - most * base * FRAC_1_PI);
            row[1][l] = nonmetallic * specular * (1.0 - u) * value;
            row[2][l] = -nonmetallic * specular * (1.0 - u) * base * FRAC_1_PI;
            row[3][l] = nonmetallic * through * FRAC_1_PI + metallic * (1.0 - u) * value;
            row[4][l] = metal - dielectric;
            row[5][l] = (nonmetallic * specular * fr + metallic * metal_fr) * lobe.slope[l];
        }
        (f, row)
    }
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

    #[test]
    fn every_instruction_set_sums_to_the_same_bits() {
        let target = Target::new(&find("gold-paint").expect("in the catalogue").material);
        let x = [0.8, 0.1, 0.2, 0.3, 0.4, 0.3, 0.2, 0.3, 0.5, 0.7, 0.2];
        let x = DVector::from_column_slice(&x);
        let on = |set: InstructionSet| {
            let search = Search { set, ..Search::new(&target, Metric::default()) };
            let [lobe, coat] = [ROUGHNESS, COAT_ROUGHNESS].map(|at| search.lobe(x[at]));
            [search.equations(&x, &lobe), search.coated_equations(&x, &lobe, &coat)]
        };
        let baseline = on(InstructionSet::Baseline);
        for set in InstructionSet::available() {
            assert!(on(set) == baseline, "{}", set.name());
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
                metric.transform(f[c], pair.cos_theta[side]).0
                    - metric.transform(target.channels[c][i], pair.cos_theta[side]).0
            };
            (0..3).map(|c| pair.weights[side] * residual(c).powi(2)).sum::<f64>()
        };
        let summed: f64 =
            (0..target.pairs.len()).flat_map(|i| [0, 1].map(|side| square(i, side))).sum();
        assert!((searched / summed - 1.0).abs() < 1e-9, "{searched} {summed}");
    }
}
