//! The best single Beckmann or GGX lobe.

use std::f64::consts::FRAC_1_PI;

use nalgebra::DVector;
use serde::Serialize;

use crate::brdf::one_lobe::{OneLobe, OneLobeChannel, SCALE_OF_RHO_S};
use crate::fit::lanes::{LobeSamples, PairLanes, lanes};
use crate::fit::metric::Metric;
use crate::fit::minima::{local_minima, lowest};
use crate::fit::reason::{self, Reason};
use crate::fit::target::{Pair, Residuals as FitResiduals, Target};
use crate::material::{Channel, Material};
use crate::math::instruction_set::{InstructionSet, per_instruction_set};
use crate::math::least_squares::{
    Bounds, LANES, LaneResiduals, LaneSums, Lanes, Minimum, NormalEquations, minimise,
};
use crate::microfacet::{Distribution as _, Family, Fresnel, OneWidth};

/// The best fits of one lobe: a width per channel, and one width for all three.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OneLobeFit {
    /// The best of every channel by itself.
    pub per_channel: OneLobe,
    /// The distance of `per_channel` from the material.
    pub per_channel_residuals: FitResiduals,
    /// The best with one width for the three channels.
    pub joint: OneLobe,
    /// The distance of `joint` from the material.
    pub joint_residuals: FitResiduals,
    /// Oddities of the material or the fit.
    pub reasons: Vec<Reason>,
}

/// The widths that are searched: from a mirror for any picture to slopes no surface exceeds.
pub const ALPHA_RANGE: [f64; 2] = [1e-3, 2.0];
/// Widths looked at before the best are refined, a factor 1.5 apart.
const SCAN: usize = 20;
/// Relative decrease of Σ r² at which the scan and the refinement end.
const SCAN_TOLERANCE: f64 = 3e-2;
const TOLERANCE: f64 = 1e-7;

/// The best lobe of `family` for a material, in the default metric.
///
/// # Example
///
/// ```
/// use sgdbake::{Family, fit_one_lobe, named};
///
/// let fit = fit_one_lobe(named("gold-paint")?, Family::Ggx);
/// let widths = fit.per_channel.channels.map(|channel| channel.alpha);
/// assert!(widths.iter().all(|alpha| (1e-3..=2.0).contains(alpha)));
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
#[must_use]
pub fn fit(material: &Material, family: Family) -> OneLobeFit {
    fit_target(&Target::new(material), family, Metric::default())
}

/// The best lobe of `family` for a target, in `metric`.
///
/// At a fixed width the model is linear in four non-negative coefficients per channel. A scan over
/// all widths solves for those alone; Levenberg–Marquardt in width and coefficients then descends
/// from every local minimum that the scan shows, and at last on finer nodes.
#[must_use]
pub fn fit_target(target: &Target, family: Family, metric: Metric) -> OneLobeFit {
    let search = Search::new(target, family, metric);
    let polish = Search::new(target.polish(), family, metric);
    // One scan serves both fits: at a fixed width the channels do not depend on each other.
    let scan = search.scan([0, 1, 2].map(|c| published(&target.material, c)));
    let joint = polish.descend_jointly(&search.joint(&scan));
    let channels = std::array::from_fn(|c| {
        // An invisible lobe's width is arbitrary: that of the joint fit keeps it from standing out.
        if reason::has_visible_lobe(&target.material, c) {
            polish.descend(c, &search.channel(c, &scan))
        } else {
            joint.channels[c]
        }
    });
    let per_channel = OneLobe { family, channels };
    OneLobeFit {
        per_channel_residuals: target.residuals(&per_channel.brdf()),
        joint_residuals: target.residuals(&joint.brdf()),
        reasons: reasons(&target.material, &per_channel),
        per_channel,
        joint,
    }
}

fn reasons(material: &Material, fit: &OneLobe) -> Vec<Reason> {
    let channels = Channel::ALL.into_iter().zip(&fit.channels);
    let widest = channels.filter(|(_, lobe)| lobe.alpha > 0.99 * ALPHA_RANGE[1]);
    let widest = widest.map(|(channel, _)| Reason::WidestLobe(channel));
    reason::of_material(material).into_iter().chain(widest).collect()
}

/// The unknowns of one channel: ln α, and the coefficients ρd, f0, f90 and F(0°) = f0 − f1.
const UNKNOWNS: usize = 5;

/// Everything that does not depend on the unknowns.
struct Search<'a> {
    target: &'a Target,
    family: Family,
    metric: Metric,
    set: InstructionSet,
    pairs: Vec<PairLanes>,
    /// The Fresnel curve's share of (f0, f90, F(0°)) at each pair.
    fresnel: Vec<[Lanes; 3]>,
}

/// A lobe D G1 G1/(4 cosθi cosθo) at a pair, and its derivative by ln α.
#[derive(Clone, Copy)]
struct LobeSample {
    value: f64,
    slope: f64,
}

impl<'a> Search<'a> {
    fn new(target: &'a Target, family: Family, metric: Metric) -> Self {
        let fresnel = target.pairs.chunks(LANES).map(|pairs| {
            [0, 1, 2].map(|i| lanes(pairs, |pair| fresnel_basis(pair.cos_theta_d)[i], 0.0))
        });
        Self {
            target,
            family,
            metric,
            set: InstructionSet::widest(),
            pairs: target.pair_lanes(metric),
            fresnel: fresnel.collect(),
        }
    }

    /// The best coefficients of each channel at widths spaced evenly in ln α, widest first, the
    /// first found from `x`, each next from the one before.
    fn scan(&self, mut x: [DVector<f64>; 3]) -> [Vec<Minimum>; 3] {
        let [low, high] = ALPHA_RANGE.map(f64::ln);
        let mut scan = [const { Vec::new() }; 3];
        for i in 0..SCAN {
            // Widest first: its lobe shows at every pair, so that the start matters least.
            let log_alpha = high + (low - high) * i as f64 / (SCAN - 1) as f64;
            let lobe = self.lobe(log_alpha);
            for c in 0..3 {
                // The bounds hold the width, and the model is linear in the rest.
                x[c][0] = log_alpha;
                let best = minimise(
                    |x| self.channel_equations(c, x, 0, &lobe).into(),
                    &x[c],
                    &bounds([log_alpha; 2], 1),
                    SCAN_TOLERANCE,
                );
                x[c].clone_from(&best.x);
                scan[c].push(best);
            }
        }
        scan
    }

    /// The best of one channel.
    fn channel(&self, c: usize, scan: &[Vec<Minimum>; 3]) -> DVector<f64> {
        let starts = local_minima(&scan[c].iter().map(|m| m.squares).collect::<Vec<_>>());
        lowest(starts.into_iter().map(|i| self.channel_minimum(c, &scan[c][i].x))).x
    }

    /// The minimum of one channel that a descent from `start` reaches.
    fn channel_minimum(&self, c: usize, start: &DVector<f64>) -> Minimum {
        minimise(
            |x| self.channel_equations(c, x, 0, &self.lobe(x[0])).into(),
            start,
            &bounds(ALPHA_RANGE.map(f64::ln), 1),
            TOLERANCE,
        )
    }

    /// The best of one channel that a descent from `start` reaches.
    fn descend(&self, c: usize, start: &DVector<f64>) -> OneLobeChannel {
        lobe_channel(&self.channel_minimum(c, start).x, 0)
    }

    /// The best with one width.
    fn joint(&self, scan: &[Vec<Minimum>; 3]) -> DVector<f64> {
        let sums: Vec<f64> =
            (0..SCAN).map(|i| scan.iter().map(|channel| channel[i].squares).sum()).collect();
        let starts =
            local_minima(&sums).into_iter().map(|i| joined(scan.each_ref().map(|s| &s[i])));
        lowest(starts.map(|start| self.joint_minimum(&start))).x
    }

    /// The minimum with one width that a descent from `start` reaches.
    fn joint_minimum(&self, start: &DVector<f64>) -> Minimum {
        let bounds = bounds(ALPHA_RANGE.map(f64::ln), 3);
        minimise(|x| self.joint_equations(x), start, &bounds, TOLERANCE)
    }

    /// The best with one width that a descent from `start` reaches.
    fn descend_jointly(&self, start: &DVector<f64>) -> OneLobe {
        let best = self.joint_minimum(start).x;
        let channels = std::array::from_fn(|c| lobe_channel(&best, c));
        OneLobe { family: self.family, channels }
    }

    fn joint_equations(&self, x: &DVector<f64>) -> NormalEquations {
        let lobe = self.lobe(x[0]);
        let mut equations = NormalEquations::zero(x.len());
        for c in 0..3 {
            // The three channels share the first unknown, their width.
            let places = std::array::from_fn(|i| if i == 0 { 0 } else { place(c, i) });
            equations.add(&self.channel_equations(c, x, c, &lobe), places);
        }
        equations
    }

    /// The lobe of width e^`log_alpha` at every pair.
    fn lobe(&self, log_alpha: f64) -> Vec<LobeSamples> {
        let distribution = self.family.of_width(log_alpha.exp());
        let chunks = self.target.pairs.chunks(LANES);
        chunks.map(|pairs| lobe_samples(distribution, pairs)).collect()
    }

    /// The residuals of channel `c`, its coefficients standing in `x` as those of channel `at`.
    fn channel_equations(
        &self,
        c: usize,
        x: &DVector<f64>,
        at: usize,
        lobe: &[LobeSamples],
    ) -> LaneSums<UNKNOWNS> {
        let coefficients: [f64; 4] = std::array::from_fn(|i| x[place(at, i + 1)]);
        dispatch::residuals(self.set, self, c, coefficients, lobe)
    }

    /// The residuals of channel `c` for its coefficients.
    #[inline(always)]
    fn residuals(
        &self,
        c: usize,
        [rho_d, f0, f90, f_facing]: [f64; 4],
        lobe: &[LobeSamples],
    ) -> LaneSums<UNKNOWNS> {
        let mut sums = LaneSums::none();
        for ((pairs, LobeSamples { value, slope }), fresnel) in
            self.pairs.iter().zip(lobe).zip(&self.fresnel)
        {
            let [bump, grazing, facing] = fresnel;
            // Row 1, by ρd, is 1/π everywhere; the loop sets all others.
            let (mut f, mut row) = ([0.0; LANES], [[FRAC_1_PI; LANES]; UNKNOWNS]);
            for l in 0..LANES {
                let fresnel = f0 * bump[l] + f90 * grazing[l] + f_facing * facing[l];
                f[l] = rho_d * FRAC_1_PI + fresnel * value[l];
                row[0][l] = fresnel * slope[l];
                row[2][l] = value[l] * bump[l];
                row[3][l] = value[l] * grazing[l];
                row[4][l] = value[l] * facing[l];
            }
            let mut terms = LaneResiduals::default();
            self.metric.add(&mut terms, &f, &pairs.sides, c);
            sums.add(&terms, &row);
        }
        sums
    }
}

/// The sums once per instruction set, all with the same bits.
mod dispatch {
    use super::*;

    per_instruction_set!(residuals
    (search: &Search<'_>, c: usize, x: [f64; 4], lobe: &[LobeSamples]) -> LaneSums<UNKNOWNS> {
        search.residuals(c, x, lobe)
    });
}

/// The place of unknown `i` ≥ 1 of a channel: ln α first, then four coefficients per channel.
fn place(channel: usize, i: usize) -> usize {
    channel * (UNKNOWNS - 1) + i
}

/// ln α in a range, the coefficients of `channels` channels ≥ 0.
fn bounds(log_alpha: [f64; 2], channels: usize) -> Bounds {
    let mut bounds = Bounds::non_negative(1 + channels * (UNKNOWNS - 1));
    [bounds.lower[0], bounds.upper[0]] = log_alpha;
    bounds
}

/// The unknowns of a joint lobe, from those of three channels at the same width.
fn joined(channels: [&Minimum; 3]) -> DVector<f64> {
    let coefficients = channels.iter().flat_map(|channel| channel.x.iter().skip(1));
    let unknowns = channels[0].x.iter().take(1).chain(coefficients);
    DVector::from_iterator(1 + 3 * (UNKNOWNS - 1), unknowns.copied())
}

/// The lobe of a solution in one channel.
fn lobe_channel(x: &DVector<f64>, channel: usize) -> OneLobeChannel {
    let [rho_d, f0, f90, facing] = std::array::from_fn(|i| x[place(channel, i + 1)]);
    OneLobeChannel { rho_d, alpha: x[0].exp(), fresnel: Fresnel { f0, f90, f1: f0 - facing } }
}

/// D G1 G1/(4 cosθi cosθo) and its derivative by ln α.
fn lobe_sample(distribution: OneWidth, pair: &Pair) -> LobeSample {
    let g1 = pair.cot_theta.map(|cot| distribution.g1(cot));
    let d = distribution.ndf(pair.tan2_theta_h);
    let value = 0.25 * d * (g1[0] / pair.cos_theta[0]) * (g1[1] / pair.cos_theta[1]);
    // Far from the peak D underflows: the derivatives of Λ need not be evaluated.
    if value == 0.0 {
        return LobeSample { value, slope: 0.0 };
    }
    // ∂ln G1/∂ln α = −G1 ∂Λ/∂ln α.
    let [by_i, by_o] =
        [0, 1].map(|side| g1[side] * distribution.lambda_by_log_alpha(pair.cot_theta[side]));
    let slope = distribution.ndf_by_log_alpha(pair.tan2_theta_h) - by_i - by_o;
    LobeSample { value, slope: value * slope }
}

/// [`lobe_sample`] of at most [`LANES`] pairs.
fn lobe_samples(distribution: OneWidth, pairs: &[Pair]) -> LobeSamples {
    let mut samples = LobeSamples::ZERO;
    for (l, pair) in pairs.iter().enumerate() {
        let LobeSample { value, slope } = lobe_sample(distribution, pair);
        (samples.value[l], samples.slope[l]) = (value, slope);
    }
    samples
}

/// F = f0·(1 − u − cosθd) + f90·u + F(0°)·cosθd with u = (1−cosθd)⁵: all three shares are ≥ 0.
fn fresnel_basis(cos_theta_d: f64) -> [f64; 3] {
    let u = (1.0 - cos_theta_d).powi(5);
    [1.0 - u - cos_theta_d, u, cos_theta_d]
}

/// The unknowns of a colour that its lobes add up to, in units of a lobe with ¼.
fn published(material: &Material, c: usize) -> DVector<f64> {
    let mut x = DVector::from_column_slice(&[0.0, material.rho_d()[c], 0.0, 0.0, 0.0]);
    for lobe in material.lobes() {
        let scale = SCALE_OF_RHO_S * lobe.rho_s()[c];
        // A published F(0°) may be below 0, which no fit's is; `minimise` clamps f0.
        let facing = (lobe.f0()[c] - lobe.f1()[c]).max(0.0);
        x += DVector::from_column_slice(&[0.0, 0.0, scale * lobe.f0()[c], scale, scale * facing]);
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Beckmann material is recovered by the Beckmann fit.
    #[test]
    fn a_beckmann_channel_is_its_own_fit() {
        let channels = [0.01, 0.04, 0.16].map(|alpha| crate::material::ChannelParams {
            rho_d: 0.2,
            rho_s: 0.3,
            alpha,
            p: 0.0,
            f0: 0.4,
            f1: 0.1,
            masking: None,
        });
        let material = Material::of_channels("beckmann", &channels).expect("in range");
        let fit = fit(&material, Family::Beckmann);
        for (fitted, exact) in fit.per_channel.channels.iter().zip(&channels) {
            assert!((fitted.alpha / exact.alpha.sqrt() - 1.0).abs() < 1e-4, "{fitted:?}");
            assert!((fitted.rho_d - exact.rho_d).abs() < 1e-4, "{fitted:?}");
            let facing = fitted.fresnel.f0 - fitted.fresnel.f1;
            assert!((facing / (SCALE_OF_RHO_S * 0.3 * 0.3) - 1.0).abs() < 1e-3, "{fitted:?}");
        }
    }

    /// The lobe of one channel, and the one of all, of a scan that starts from these coefficients.
    fn found_from(search: &Search<'_>, values: [f64; UNKNOWNS]) -> (DVector<f64>, DVector<f64>) {
        let start = DVector::from_column_slice(&values);
        let scan = search.scan([start.clone(), start.clone(), start]);
        (search.channel(1, &scan), search.joint(&scan))
    }

    /// From whatever coefficients the scan starts, the same lobe is found.
    #[test]
    fn every_start_ends_in_the_same_place() {
        for name in ["chrome", "beige-fabric", "gold-paint", "two-layer-silver", "delrin"] {
            let target =
                Target::new(&crate::material::find(name).expect("in the catalogue").material);
            for family in [Family::Beckmann, Family::Ggx] {
                let search = Search::new(&target, family, Metric::default());
                let (channel, joint) = found_from(&search, [0.0, 1.0, 0.0, 0.0, 0.0]);
                for start in
                    [[0.0; UNKNOWNS], [0.0, 0.0, 9.0, 0.0, 9.0], [0.0, 0.3, 1e-3, 5.0, 1e-3]]
                {
                    let (other, other_joint) = found_from(&search, start);
                    // The first unknown is ln α.
                    assert!((other[0] - channel[0]).abs() < 1e-3, "{name} {start:?}");
                    assert!((other_joint[0] - joint[0]).abs() < 1e-3, "{name} {start:?}");
                }
            }
        }
    }

    /// The derivatives that the descent uses, against differences.
    #[test]
    fn slopes_are_derivatives() {
        let entry = crate::material::find("gold-paint").expect("in the catalogue");
        let target = Target::new(&entry.material);
        for family in [Family::Beckmann, Family::Ggx] {
            for pair in target.pairs.iter().step_by(17) {
                let (alpha, step) = (0.3_f64, 1e-6_f64);
                let [LobeSample { value, slope }, above, below] = [0.0, step, -step]
                    .map(|step| lobe_sample(family.of_width(alpha * step.exp()), pair));
                let difference = (above.value - below.value) / (2.0 * step);
                assert!((slope - difference).abs() <= 1e-6 * (slope.abs() + value), "{pair:?}");
            }
        }
    }
}
