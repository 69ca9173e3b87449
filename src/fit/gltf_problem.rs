//! The normal equations of a glTF material at the pairs of a target.

use std::f64::consts::FRAC_1_PI;
use std::slice::from_ref;

use nalgebra::DVector;

use crate::brdf::gltf::{coat_fresnel, ggx_lobe, schlick_weight};
use crate::fit::gltf_unknowns::{
    BASE, CLEARCOAT, COAT_ROUGHNESS, F0, METALLIC, ROUGHNESS, SPECULAR, UNKNOWNS, brightest,
};
use crate::fit::lanes::{LobeSamples, PairLanes, lanes};
use crate::fit::metric::Metric;
use crate::fit::target::Target;
use crate::math::instruction_set::{InstructionSet, per_instruction_set};
use crate::math::least_squares::{LANES, LaneResiduals, LaneSums, Lanes, NormalEquations};
use crate::microfacet::ggx;

/// The quantities at [`LANES`] pairs that do not depend on the unknowns.
struct Fixed {
    schlick_weight: Lanes,
    /// The coat's Fresnel term, which is the viewer's, for light along either direction.
    coat_fresnel: [Lanes; 2],
    tan2_theta_h: Lanes,
    cot_theta: [Lanes; 2],
    cos_theta: [Lanes; 2],
}

impl Fixed {
    /// The quantities of a target, [`LANES`] pairs at a time.
    fn of(target: &Target) -> Vec<Self> {
        // Lanes without a pair have weight 0; their values only have to give a finite lobe.
        let chunks = target.pairs.chunks(LANES);
        chunks
            .map(|pairs| Self {
                schlick_weight: lanes(pairs, |pair| schlick_weight(pair.cos_theta_d), 0.0),
                // Side 0 has its light along wi and so its viewer along wo, of index 1.
                coat_fresnel: [1, 0]
                    .map(|viewer| lanes(pairs, |pair| coat_fresnel(pair.cos_theta[viewer]), 0.0)),
                tan2_theta_h: lanes(pairs, |pair| pair.tan2_theta_h, 1.0),
                cot_theta: [0, 1].map(|side| lanes(pairs, |pair| pair.cot_theta[side], 1.0)),
                cos_theta: [0, 1].map(|side| lanes(pairs, |pair| pair.cos_theta[side], 1.0)),
            })
            .collect()
    }
}

/// The residuals of a glTF material, and everything in them that does not depend on the unknowns.
pub struct Problem {
    metric: Metric,
    set: InstructionSet,
    pairs: Vec<PairLanes>,
    fixed: Vec<Fixed>,
}

impl Problem {
    /// The problem of a target in `metric`.
    #[must_use]
    pub fn new(target: &Target, metric: Metric) -> Self {
        Self {
            metric,
            set: InstructionSet::widest(),
            pairs: target.pair_lanes(metric),
            fixed: Fixed::of(target),
        }
    }

    /// V·D at every pair.
    #[must_use]
    pub fn lobe(&self, roughness: f64) -> Vec<LobeSamples> {
        dispatch::lobe(self.set, self, roughness)
    }

    /// The equations of a material without a coat, `lobe` that of its roughness.
    #[must_use]
    pub fn equations(&self, x: &DVector<f64>, lobe: &[LobeSamples]) -> NormalEquations {
        let (brightest, channels) = (brightest(x), ChannelFactors::of(x));
        let mut equations = NormalEquations::zero(UNKNOWNS);
        for (c, factors) in channels.iter().enumerate() {
            // The largest F0 dims the base of every channel, its own too: it may stand here twice.
            let places = [SPECULAR, F0 + c, brightest, BASE + c, METALLIC, ROUGHNESS];
            equations.add(&dispatch::residuals(self.set, self, c, factors, lobe), places);
        }
        equations
    }

    /// The equations of a material under a coat.
    #[must_use]
    pub fn coated_equations(&self, x: &DVector<f64>) -> NormalEquations {
        let [lobe, coat] = [ROUGHNESS, COAT_ROUGHNESS].map(|at| self.lobe(x[at]));
        let (brightest, channels) = (brightest(x), ChannelFactors::of(x));
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
            let (set, lobes) = (self.set, [&*lobe, &*coat]);
            let sums = dispatch::coated_residuals(set, self, c, factors, x[CLEARCOAT], lobes);
            equations.add(&sums, places);
        }
        equations
    }

    /// The residuals of a channel without a coat.
    #[inline(always)]
    fn residuals(&self, c: usize, factors: &ChannelFactors, lobe: &[LobeSamples]) -> LaneSums<6> {
        let mut sums = LaneSums::none();
        for ((pairs, fixed), lobe) in self.pairs.iter().zip(&self.fixed).zip(lobe) {
            // Reciprocal without a coat: both sides have the same f, and share its derivatives.
            let (f, row) = factors.material(fixed, lobe);
            let mut terms = LaneResiduals::default();
            self.metric.add(&mut terms, &f, &pairs.sides, c);
            sums.add(&terms, &row);
        }
        sums
    }

    /// The residuals of a channel under a coat.
    #[inline(always)]
    fn coated_residuals(
        &self,
        c: usize,
        factors: &ChannelFactors,
        clearcoat: f64,
        [lobe, coat]: [&[LobeSamples]; 2],
    ) -> LaneSums<8> {
        let mut sums = LaneSums::none();
        for (i, (pairs, fixed)) in self.pairs.iter().zip(&self.fixed).enumerate() {
            let (material, by_factor) = factors.material(fixed, &lobe[i]);
            // The coat's Fresnel term makes f differ with the direction of the light.
            for (side, coat_fresnel) in pairs.sides.iter().zip(&fixed.coat_fresnel) {
                let (mut f, mut row) = ([0.0; LANES], [[0.0; LANES]; 8]);
                for l in 0..LANES {
                    // KHR_materials_clearcoat: (1 − s) base + s V D of the coat, s = clearcoat · F.
                    let share = coat_fresnel[l] * clearcoat;
                    f[l] = (1.0 - share) * material[l] + share * coat[i].value[l];
                    for n in 0..6 {
                        row[n][l] = (1.0 - share) * by_factor[n][l];
                    }
                    row[6][l] = coat_fresnel[l] * (coat[i].value[l] - material[l]);
                    row[7][l] = share * coat[i].slope[l];
                }
                let mut terms = LaneResiduals::default();
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

    per_instruction_set!(lobe(problem: &Problem, roughness: f64) -> Vec<LobeSamples> {
        problem.fixed.iter().map(|fixed| lobe_samples(roughness, fixed)).collect()
    });
    per_instruction_set!(residuals
    (problem: &Problem, c: usize, factors: &ChannelFactors, lobe: &[LobeSamples]) -> LaneSums<6> {
        problem.residuals(c, factors, lobe)
    });
    per_instruction_set!(coated_residuals
        (problem: &Problem, c: usize, factors: &ChannelFactors, clearcoat: f64, lobes: [&[LobeSamples]; 2])
        -> LaneSums<8> { problem.coated_residuals(c, factors, clearcoat, lobes) });
}

/// V·D and its derivative by roughness.
#[inline(always)]
fn lobe_samples(roughness: f64, fixed: &Fixed) -> LobeSamples {
    let alpha = roughness * roughness;
    let mut samples = LobeSamples::ZERO;
    for l in 0..LANES {
        // GGX's Λ depends on cotθ/α alone, so ∂Λ/∂ln α needs no step.
        let [cot_i, cot_o] = [fixed.cot_theta[0][l], fixed.cot_theta[1][l]];
        let [cos_i, cos_o] = [fixed.cos_theta[0][l], fixed.cos_theta[1][l]];
        let value = ggx_lobe(alpha, fixed.tan2_theta_h[l], [cot_i, cot_o], [cos_i, cos_o]);
        // V = 1/(4 cosθi cosθo (1 + Λi + Λo)), so ∂ln V/∂ln α = −(Λi' + Λo')/(1 + Λi + Λo).
        let lambdas = ggx::lambda(cot_i / alpha) + ggx::lambda(cot_o / alpha);
        let slopes =
            ggx::lambda_by_log_alpha(cot_i / alpha) + ggx::lambda_by_log_alpha(cot_o / alpha);
        let by_log_alpha =
            ggx::ndf_by_log_alpha(alpha, fixed.tan2_theta_h[l]) - slopes / (1.0 + lambdas);
        samples.value[l] = value;
        // α = roughness², so ∂ln α/∂roughness = 2/roughness.
        samples.slope[l] = value * by_log_alpha * 2.0 / roughness;
    }
    samples
}

/// The factors that f of a channel depends on besides its lobe.
struct ChannelFactors {
    specular: f64,
    f0: f64,
    /// The largest F0 of the three channels.
    brightest: f64,
    base: f64,
    metallic: f64,
}

impl ChannelFactors {
    /// The factors of the three channels.
    fn of(x: &DVector<f64>) -> [Self; 3] {
        [0, 1, 2].map(|c| Self {
            specular: x[SPECULAR],
            f0: x[F0 + c],
            brightest: x[brightest(x)],
            base: x[BASE + c],
            metallic: x[METALLIC],
        })
    }

    /// f without a coat (see [`crate::brdf::gltf::GltfBrdf`] for the formula) and its derivatives
    /// by specular factor, own F0, largest F0, base colour, metallic and roughness.
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
            // KHR_materials_specular dims the base by the largest F of the three channels.
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
    use crate::fit::gltf_unknowns::gltf_material;
    use crate::material::find;

    #[test]
    fn every_instruction_set_sums_to_the_same_bits() {
        let target = Target::new(&find("gold-paint").expect("in the catalogue").material);
        let x = [0.8, 0.1, 0.2, 0.3, 0.4, 0.3, 0.2, 0.3, 0.5, 0.7, 0.2];
        let x = DVector::from_column_slice(&x);
        let mut problem = Problem::new(&target, Metric::default());
        problem.set = InstructionSet::Baseline;
        let baseline = both_equations(&problem, &x);
        for set in InstructionSet::available() {
            problem.set = set;
            assert!(both_equations(&problem, &x) == baseline, "{}", set.name());
        }
    }

    /// The equations without and with a coat.
    fn both_equations(problem: &Problem, x: &DVector<f64>) -> [NormalEquations; 2] {
        [problem.equations(x, &problem.lobe(x[ROUGHNESS])), problem.coated_equations(x)]
    }

    /// A coated material's squares are those of its reflectance, each pair lit from both sides.
    #[test]
    fn the_problem_sums_what_the_material_is() {
        let target = Target::new(&find("chrome").expect("in the catalogue").material);
        let metric = Metric::default();
        let x = [0.8, 0.1, 0.2, 0.3, 0.4, 0.3, 0.2, 0.0, 0.5, 0.7, 0.2];
        let x = DVector::from_column_slice(&x);
        let squares = Problem::new(&target, metric).coated_equations(&x).squares;
        let brdf = gltf_material(&x);
        let mut summed = 0.0;
        for (i, pair) in target.pairs.iter().enumerate() {
            let lit = [brdf.eval(pair.wi, pair.wo), brdf.eval(pair.wo, pair.wi)];
            for (side, f) in lit.iter().enumerate() {
                for c in 0..3 {
                    let [fitted, exact] = [f[c], target.channels[c][i]]
                        .map(|f| metric.transform(f, pair.cos_theta[side]).0);
                    summed += pair.weights[side] * (fitted - exact).powi(2);
                }
            }
        }
        assert!((squares / summed - 1.0).abs() < 1e-9, "{squares} {summed}");
    }
}
