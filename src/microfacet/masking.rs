//! Masking: the share of microfacets seen from a direction, exact (Smith) and as fitted by the
//! paper.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DVector, Dyn, OMatrix, U3, Vector3};

use crate::material::{ChannelParams, MaskingParams};
use crate::microfacet::SmithTable;
use crate::microfacet::beckmann_mixture::{BeckmannLobe, BeckmannMixture, beckmann_lambda};

/// Which masking function a reflectance uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MaskingKind {
    /// Smith's masking of the distribution, exactly
    #[default]
    Exact,
    /// The paper's three-parameter fit
    Fitted,
}

/// Exact Smith masking of an SGD channel through its Beckmann mixture.
///
/// # Formula
///
/// Λ(θ) = ∫_{cotθ}^∞ (r tanθ − 1) P2(r) dr = Σ w_j Λ_beckmann(cotθ/α_j),   G1 = 1/(1+Λ)
#[derive(Clone, Debug, PartialEq)]
pub struct SmithMasking {
    /// Widest first.
    nodes: Vec<SmithNode>,
    table: Option<SmithTable>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct SmithNode {
    inv_alpha: f64,
    weight: f64,
}

impl SmithMasking {
    /// The masking of the surface that `mixture` describes.
    #[must_use]
    pub fn new(mixture: &BeckmannMixture) -> Self {
        let node =
            |lobe: &BeckmannLobe| SmithNode { inv_alpha: 1.0 / lobe.alpha, weight: lobe.weight };
        let mut nodes: Vec<SmithNode> = mixture.lobes().iter().map(node).collect();
        nodes.sort_by(|a, b| a.inv_alpha.total_cmp(&b.inv_alpha));
        Self { nodes, table: None }
    }

    /// The same with G1 from a table, for many evaluations: within a relative 1e-8 of the sum.
    #[must_use]
    pub fn tabulated(mut self) -> Self {
        let width = |node: &SmithNode| 1.0 / node.inv_alpha;
        let narrowest = self.nodes.last().map_or(1.0, width);
        let widest = self.nodes.first().map_or(1.0, width);
        self.table = Some(SmithTable::new(narrowest, widest, |cot_theta| self.g1(cot_theta)));
        self
    }

    /// The masking of a channel to a relative `accuracy` of G1.
    #[must_use]
    pub fn of(params: &ChannelParams, accuracy: f64) -> Self {
        Self::new(&BeckmannMixture::new(params.alpha, params.p, accuracy))
    }

    /// Smith's Λ at cotθ ≥ 0; infinite at grazing.
    #[must_use]
    pub fn lambda(&self, cot_theta: f64) -> f64 {
        let mut sum = 0.0;
        for node in &self.nodes {
            let lobe = beckmann_lambda(cot_theta * node.inv_alpha);
            sum += node.weight * lobe;
            // Narrower lobes mask less, and the weights sum to 1: what is left is below `lobe`.
            if lobe <= 0.5 * f64::EPSILON * sum {
                break;
            }
        }
        sum
    }

    /// G1 = 1/(1+Λ) at cotθ, in [0, 1].
    #[must_use]
    pub fn g1(&self, cot_theta: f64) -> f64 {
        match &self.table {
            Some(table) => table.g1(cot_theta),
            None => 1.0 / (1.0 + self.lambda(cot_theta)),
        }
    }
}

/// The published masking fit, in a form that cannot overflow.
///
/// # Formula
///
/// ```text
/// G1(θ) = 1 + λ (1 - e^{c(θ-θ0)^k}) for θ > θ0, else 1;   θ0 = π/2 - (ln(1+1/λ)/c)^{1/k}
/// ```
///
/// (Bagher et al. 2012, equation 15). With L = ln(1+1/λ) and u = (π/2−θ)/(π/2−θ0),
/// c(θ−θ0)^k = L(1−u)^k, so
///
/// ```text
/// G1 = -(1+λ) expm1(-L (1-(1-u)^k)),   1-(1-u)^k = -expm1(k ln1p(-u))
/// ```
///
/// exactly 0 at grazing, for c up to 1e109 and λ from 4.5e-8 to 1.5e7. The amplitude λ is not
/// Smith's Λ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedMasking {
    amplitude: f64,
    log_ratio: f64,
    k: f64,
    /// π/2 − θ0, the elevation below which masking sets in \[rad\].
    onset_elevation: f64,
}

impl FittedMasking {
    /// The fit with published parameters.
    #[must_use]
    pub fn new(params: MaskingParams) -> Self {
        let log_ratio = params.lambda.recip().ln_1p();
        // In logarithms: c alone reaches 1e109 and a file may hold more.
        let onset_elevation = ((log_ratio.ln() - params.c.ln()) / params.k).exp();
        Self { amplitude: params.lambda, log_ratio, k: params.k, onset_elevation }
    }

    /// The fit of a channel: the published one, or one made here where the channel has none.
    #[must_use]
    pub fn of(params: &ChannelParams) -> Self {
        /// Far below what three parameters can follow.
        const FIT_SOURCE_ACCURACY: f64 = 1e-6;
        params
            .masking
            .map_or_else(|| Self::fit(&SmithMasking::of(params, FIT_SOURCE_ACCURACY)), Self::new)
    }

    /// π/2 − θ0, the elevation below which masking sets in \[rad\].
    #[must_use]
    pub fn onset_elevation(&self) -> f64 {
        self.onset_elevation
    }

    /// θ0, the angle at which masking sets in \[rad\]; negative for many published channels.
    #[must_use]
    pub fn theta0(&self) -> f64 {
        std::f64::consts::FRAC_PI_2 - self.onset_elevation
    }

    /// G1 at the elevation π/2 − θ above the horizon \[rad\].
    #[must_use]
    pub fn g1_at_elevation(&self, elevation: f64) -> f64 {
        let u = elevation / self.onset_elevation;
        if u >= 1.0 {
            return 1.0;
        }
        let risen = -(self.k * (-u).ln_1p()).exp_m1();
        (-(1.0 + self.amplitude) * (-self.log_ratio * risen).exp_m1()).clamp(0.0, 1.0)
    }

    /// G1 at cotθ ≥ 0.
    #[must_use]
    pub fn g1(&self, cot_theta: f64) -> f64 {
        self.g1_at_elevation(cot_theta.atan())
    }
}

/// The masking function of one channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Masking {
    /// Smith's, exactly.
    Exact(SmithMasking),
    /// The paper's fit.
    Fitted(FittedMasking),
}

impl Masking {
    /// The same, the exact one from a table ([`SmithMasking::tabulated`]).
    #[must_use]
    pub fn tabulated(self) -> Self {
        match self {
            Self::Exact(smith) => Self::Exact(smith.tabulated()),
            fitted @ Self::Fitted(_) => fitted,
        }
    }

    /// G1 at cotθ ≥ 0, in [0, 1].
    #[must_use]
    pub fn g1(&self, cot_theta: f64) -> f64 {
        match self {
            Self::Exact(smith) => smith.g1(cot_theta),
            Self::Fitted(fitted) => fitted.g1(cot_theta),
        }
    }

    /// Λ = 1/G1 − 1 at cotθ: Smith's own, or the one that the fit implies.
    #[must_use]
    pub fn lambda(&self, cot_theta: f64) -> f64 {
        match self {
            Self::Exact(smith) => smith.lambda(cot_theta),
            Self::Fitted(fitted) => fitted.g1(cot_theta).recip() - 1.0,
        }
    }
}

/// The samples of exact masking that a fit goes through.
const FIT_SAMPLES: usize = 128;

impl FittedMasking {
    /// The least squares fit of the published form to the exact masking, over evenly spaced
    /// elevations up to where masking sets in.
    ///
    /// The unknowns are ln λ, ln k and the logarithm of π/2 − θ0. The objective has long curved
    /// valleys, so the best points of a coarse grid start Levenberg–Marquardt.
    #[must_use]
    pub fn fit(exact: &SmithMasking) -> Self {
        let samples = fit_samples(exact);
        let problem = |unknowns| MaskingFit { samples: &samples, unknowns };
        let solved = fit_starts(&samples).map(|unknowns| {
            LevenbergMarquardt::new().with_patience(60).minimize(problem(unknowns)).0
        });
        let best = solved.into_iter().min_by(|a, b| a.squares().total_cmp(&b.squares()));
        best.expect("there is a start for every k of the grid").masking()
    }

    /// The parameters λ, c, k of this fit.
    #[must_use]
    pub fn params(&self) -> MaskingParams {
        let c = (self.log_ratio.ln() - self.k * self.onset_elevation.ln()).exp();
        MaskingParams { lambda: self.amplitude, c, k: self.k }
    }
}

/// (elevation, exact G1), evenly spaced from just above the horizon to where G1 has all but
/// reached 1, or to the zenith.
fn fit_samples(exact: &SmithMasking) -> Vec<(f64, f64)> {
    let range = onset(exact);
    (1..=FIT_SAMPLES)
        .map(|i| range * i as f64 / FIT_SAMPLES as f64)
        .map(|elevation| (elevation, exact.g1(elevation.tan())))
        .collect()
}

/// The elevation at which G1 = 1 − 1e-5, by bisection of its logarithm, at most π/2.
fn onset(exact: &SmithMasking) -> f64 {
    const UNMASKED: f64 = 1.0 - 1e-5;
    let (mut low, mut high) = (-40.0_f64, std::f64::consts::FRAC_PI_2.ln());
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if exact.g1(middle.exp().tan()) < UNMASKED {
            low = middle;
        } else {
            high = middle;
        }
    }
    high.exp()
}

/// For each k of a coarse grid, the best of the grid's λ and θ0: the valleys around large k and
/// around k = 1 each hold a minimum.
fn fit_starts(samples: &[(f64, f64)]) -> [Vector3<f64>; 7] {
    const LOG_K: [f64; 7] = [0.0, 0.8, 1.6, 2.4, 3.2, 4.0, 5.5];
    const LOG_AMPLITUDE: [f64; 10] = [-16.0, -12.0, -9.0, -6.0, -3.0, -1.0, 1.0, 4.0, 8.0, 14.0];
    const LOG_ONSET: [f64; 6] = [-0.7, -0.2, 0.2, 0.6, 1.2, 2.0];
    let log_range = samples.last().map_or(0.0, |(elevation, _)| elevation.ln());
    LOG_K.map(|k| {
        LOG_AMPLITUDE
            .into_iter()
            .flat_map(|amplitude| LOG_ONSET.map(|o| Vector3::new(amplitude, k, o + log_range)))
            .map(|unknowns| (MaskingFit { samples, unknowns }.squares(), unknowns))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or_else(Vector3::zeros, |(_, unknowns)| unknowns)
    })
}

/// The masking fit as a least squares problem in (ln λ, ln k, ln(π/2 − θ0)).
#[derive(Clone)]
struct MaskingFit<'a> {
    samples: &'a [(f64, f64)],
    unknowns: Vector3<f64>,
}

impl MaskingFit<'_> {
    fn form(log_amplitude: f64, log_k: f64, log_onset: f64) -> FittedMasking {
        /// Keeps c = L (π/2 − θ0)^{−k} within f64.
        const LARGEST_LOG_C: f64 = 600.0;
        let amplitude = log_amplitude.clamp(-18.0, 18.0).exp();
        let log_onset = log_onset.clamp(-60.0, 4.0);
        let largest_k = LARGEST_LOG_C / log_onset.abs().max(0.1);
        FittedMasking {
            amplitude,
            log_ratio: amplitude.recip().ln_1p(),
            k: log_k.clamp(-3.0, 7.0).exp().min(largest_k),
            onset_elevation: log_onset.exp(),
        }
    }

    fn masking(&self) -> FittedMasking {
        Self::form(self.unknowns[0], self.unknowns[1], self.unknowns[2])
    }

    /// Σ (G1_fit − G1)².
    fn squares(&self) -> f64 {
        let squares = self.residuals_at(self.unknowns).norm_squared();
        if squares.is_nan() { f64::INFINITY } else { squares }
    }

    fn residuals_at(&self, unknowns: Vector3<f64>) -> DVector<f64> {
        let masking = Self::form(unknowns[0], unknowns[1], unknowns[2]);
        let residual = |(elevation, g1): &(f64, f64)| masking.g1_at_elevation(*elevation) - g1;
        DVector::from_iterator(self.samples.len(), self.samples.iter().map(residual))
    }
}

impl LeastSquaresProblem<f64, Dyn, U3> for MaskingFit<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, U3>;
    type ParameterStorage = Owned<f64, U3>;

    fn set_params(&mut self, unknowns: &Vector3<f64>) {
        self.unknowns = *unknowns;
    }

    fn params(&self) -> Vector3<f64> {
        self.unknowns
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(self.residuals_at(self.unknowns))
    }

    fn jacobian(&self) -> Option<OMatrix<f64, Dyn, U3>> {
        const STEP: f64 = 1e-6;
        let column = |axis: usize| {
            let mut step = Vector3::zeros();
            step[axis] = STEP;
            let forward = self.residuals_at(self.unknowns + step);
            (forward - self.residuals_at(self.unknowns - step)) / (2.0 * STEP)
        };
        Some(OMatrix::<f64, Dyn, U3>::from_columns(&[column(0), column(1), column(2)]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::catalog;

    fn exact(alpha: f64, p: f64) -> SmithMasking {
        SmithMasking::new(&BeckmannMixture::new(alpha, p, 1e-13))
    }

    #[test]
    fn theta0_is_the_printed_one() {
        for entry in catalog() {
            for (params, printed) in entry.material.channels.iter().zip(&entry.printed) {
                let masking = FittedMasking::new(params.masking.expect("published"));
                assert!(
                    (masking.theta0() - printed.theta0).abs() < 6e-6,
                    "{}",
                    entry.material.name
                );
                let round_trip = FittedMasking::new(masking.params());
                assert!((round_trip.theta0() - masking.theta0()).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_fresh_fit_is_as_close_as_the_published_one() {
        for entry in catalog().iter().step_by(7) {
            for params in &entry.material.channels {
                let exact = exact(params.alpha, params.p);
                let published = FittedMasking::new(params.masking.expect("published"));
                let fresh = FittedMasking::fit(&exact);
                let samples = fit_samples(&exact);
                let squares = |fit: &FittedMasking| -> f64 {
                    samples.iter().map(|(e, g1)| (fit.g1_at_elevation(*e) - g1).powi(2)).sum()
                };
                let (fresh, published) = (squares(&fresh), squares(&published));
                assert!(fresh <= published * 1.01, "{}", entry.material.name);
            }
        }
    }

    #[test]
    fn fits_of_extreme_shapes_stay_close() {
        // The form was made for glossy surfaces; on a very rough one it can follow less well.
        let shapes = [
            (1e-8, 0.5, 0.005),
            (1e-8, 4.0, 0.005),
            (1e-4, 2.0, 0.005),
            (0.01, 0.0, 0.005),
            (1.0, 3.0, 0.005),
            (50.0, 1.0, 0.06),
        ];
        for (alpha, p, bound) in shapes {
            let exact = exact(alpha, p);
            let fit = FittedMasking::fit(&exact);
            let worst = (1..200)
                .map(|i| f64::from(i) * std::f64::consts::FRAC_PI_2 / 200.0)
                .chain(fit_samples(&exact).iter().map(|s| s.0))
                .map(|e| (fit.g1_at_elevation(e) - exact.g1(e.tan())).abs())
                .fold(0.0, f64::max);
            fit.params().validate().expect("a fit has valid parameters");
            assert!(worst < bound, "{alpha} {p}: {worst}");
        }
    }
}
