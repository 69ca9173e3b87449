//! The paper's masking: a curve of three parameters, and its fit to the exact masking of a lobe for
//! which none is given.

use nalgebra::{DMatrix, DVector};

use crate::material::{LobeParams, MaskingParams};
use crate::math::least_squares::{Bounds, NormalEquations, minimise};
use crate::microfacet::{Accuracy, Distribution, Sgd};

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

    /// The fit of a lobe: the one given, or one made here where the lobe has none.
    #[must_use]
    pub fn of(lobe: &LobeParams) -> Self {
        // Six digits are far more than three parameters can follow.
        match lobe.masking() {
            Some(params) => Self::new(params),
            None => Self::fit(&Sgd::new(lobe.alpha(), lobe.p(), Accuracy::Picture)),
        }
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
        // Above the onset ln(1 − u) has no value.
        if u >= 1.0 {
            return 1.0;
        }
        let risen = -(self.k * (-u).ln_1p()).exp_m1();
        // Rounding may pass 1 near the onset; an elevation below the horizon gives less than 0.
        (-(1.0 + self.amplitude) * (-self.log_ratio * risen).exp_m1()).clamp(0.0, 1.0)
    }

    /// G1 at cotθ ≥ 0.
    #[must_use]
    pub fn g1(&self, cot_theta: f64) -> f64 {
        self.g1_at_elevation(cot_theta.atan())
    }
}

/// Bounds for what follows G1 between two elevations.
impl FittedMasking {
    /// Bounds on d ln G1/d ln e over elevations e in an interval that ends or starts at
    /// the onset, or does not hold it.
    ///
    /// # Derivation
    ///
    /// With w = e/(π/2−θ0), m = 1 − (1−w)^k and L = ln(1+1/λ),
    ///
    /// ```text
    /// d ln G1/d ln e = r·q,   r = L m/(e^{L m} − 1),   q = k w (1−w)^{k−1}/m
    /// ```
    ///
    /// r falls from 1. 1/q is the mean of (s/(1−w))^{k−1} over s in \[1−w, 1\]: q falls from 1 for
    /// k > 1 and rises from 1, without bound, for k < 1.
    #[must_use]
    pub fn elasticity(&self, elevations: [f64; 2]) -> [f64; 2] {
        let w = elevations.map(|e| (e / self.onset_elevation).min(1.0));
        if w[0] >= 1.0 {
            return [0.0; 2];
        }
        let [r_most, r_least] = w.map(|w| {
            let x = self.log_ratio * self.risen(w);
            if x > 0.0 { x / x.exp_m1() } else { 1.0 }
        });
        let q = w.map(|w| self.power_elasticity(w));
        // Rounding may leave the onset just inside, where G1 stops rising.
        let least = if elevations[1] > self.onset_elevation { 0.0 } else { q[0].min(q[1]) };
        [r_least * least, r_most * q[0].max(q[1])]
    }

    /// Bounds on d ln(G1/e)/de over elevations e in an interval, infinite beyond the onset: those of
    /// [`Self::elasticity`] without the 1/e.
    ///
    /// # Derivation
    ///
    /// With y = w/(1−w) and x = L m,
    ///
    /// ```text
    /// d ln(G1/e)/dw = A L k (1−w)^{k−1} − H q/(1−w)
    /// A = 1/(eˣ−1) − 1/x,   H = (1/q − 1)/y = (k−1) ∫₀¹ (1−θ)(1+θy)^{k−2} dθ
    /// ```
    ///
    /// A rises from −½ to 0; the magnitude of H rises with y for k > 2 and falls for k < 2.
    #[must_use]
    pub fn ratio_slope(&self, elevations: [f64; 2]) -> [f64; 2] {
        let w = elevations.map(|e| e / self.onset_elevation);
        if w[1] >= 1.0 {
            return [f64::NEG_INFINITY, f64::INFINITY];
        }
        let v = w.map(|w| 1.0 - w);
        let decay = w.map(|w| slope_of_decay(self.log_ratio * self.risen(w)));
        let rise = v.map(|v| self.log_ratio * self.k * v.powf(self.k - 1.0));
        let q = w.map(|w| self.power_elasticity(w));
        let h = [0, 1].map(|end| self.excess(w[end] / v[end]).abs());
        let (least, most) =
            (h[0].min(h[1]) * q[0].min(q[1]) / v[0], h[0].max(h[1]) * q[0].max(q[1]) / v[1]);
        let of_power = if self.k >= 1.0 { [-most, -least] } else { [least, most] };
        let per_w = [
            decay[0] * rise[0].max(rise[1]) + of_power[0],
            decay[1] * rise[0].min(rise[1]) + of_power[1],
        ];
        if per_w.iter().all(|slope| slope.is_finite()) {
            per_w.map(|slope| slope / self.onset_elevation)
        } else {
            [f64::NEG_INFINITY, f64::INFINITY]
        }
    }

    /// Bounds on G1/e over elevations in an interval: (1+λ)(1 − e^{−L m})/(L m) falls with e, m/w
    /// falls for k ≥ 1 and beyond the onset, and rises to it for k < 1.
    #[must_use]
    pub fn ratio(&self, elevations: [f64; 2]) -> [f64; 2] {
        const LEAST: f64 = 1e-300;
        let w = elevations.map(|e| (e / self.onset_elevation).max(LEAST));
        let by_decay = w.map(|w| {
            let x = self.log_ratio * self.risen(w.min(1.0));
            if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 }
        });
        let by_power = w.map(|w| self.risen(w.min(1.0)) / w);
        let over_onset = w[0] < 1.0 && 1.0 < w[1];
        let most = by_power[0].max(by_power[1]).max(if over_onset { 1.0 } else { 0.0 });
        let scale = (1.0 + self.amplitude) * self.log_ratio / self.onset_elevation;
        [scale * by_decay[1] * by_power[0].min(by_power[1]), scale * by_decay[0] * most]
    }

    /// m = 1 − (1−w)^k.
    fn risen(&self, w: f64) -> f64 {
        -(self.k * (-w).ln_1p()).exp_m1()
    }

    /// q = k w (1−w)^{k−1}/m.
    fn power_elasticity(&self, w: f64) -> f64 {
        let risen = self.risen(w);
        if risen > 0.0 { self.k * w * (1.0 - w).powf(self.k - 1.0) / risen } else { 1.0 }
    }

    /// H = ((1+y)^k − 1 − k y)/(k y²).
    fn excess(&self, y: f64) -> f64 {
        let k = self.k;
        if k * y < SERIES {
            return 0.5 * (k - 1.0) * (1.0 + (k - 2.0) * y / 3.0 * (1.0 + (k - 3.0) * y / 4.0));
        }
        ((k * y.ln_1p()).exp_m1() - k * y) / (k * y * y)
    }
}

/// Below this a difference loses more digits than a series leaves out.
const SERIES: f64 = 1e-4;

/// d ln((1 − e^{−x})/x)/dx = 1/(eˣ−1) − 1/x.
fn slope_of_decay(x: f64) -> f64 {
    if x < SERIES { -0.5 + x / 12.0 } else { 1.0 / x.exp_m1() - 1.0 / x }
}

/// The elevations at which a fit is compared with the exact masking.
const FIT_SAMPLES: usize = 128;

impl FittedMasking {
    /// The least squares fit of the published form to the exact masking, over evenly spaced
    /// elevations up to where masking sets in.
    ///
    /// The unknowns are ln λ, ln k and the logarithm of π/2 − θ0. The objective has long curved
    /// valleys, so the best points of a coarse grid start Levenberg–Marquardt.
    #[must_use]
    pub fn fit(exact: &impl Distribution) -> Self {
        let samples = fit_samples(exact);
        let solved = fit_starts(&samples).map(|start| {
            minimise(|x| equations(&samples, x), &start, &unknown_bounds(), TOLERANCE)
        });
        let best = solved.into_iter().min_by(|a, b| a.squares.total_cmp(&b.squares));
        form(&best.expect("there is a start for every k of the grid").x)
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
fn fit_samples(exact: &impl Distribution) -> Vec<(f64, f64)> {
    let range = onset(exact);
    (1..=FIT_SAMPLES)
        .map(|i| range * i as f64 / FIT_SAMPLES as f64)
        // cotθ is the tangent of the elevation.
        .map(|elevation| (elevation, exact.g1(elevation.tan())))
        .collect()
}

/// The elevation at which G1 = 1 − 1e-5, by bisection of its logarithm, at most π/2.
fn onset(exact: &impl Distribution) -> f64 {
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
    // `high` is on the unmasked side, or the zenith where even that is masked.
    high.exp()
}

/// For each k of a coarse grid, the best of the grid's λ and θ0: the regions around large k and
/// around k = 1 each hold a minimum.
fn fit_starts(samples: &[(f64, f64)]) -> [DVector<f64>; 7] {
    const LOG_K: [f64; 7] = [0.0, 0.8, 1.6, 2.4, 3.2, 4.0, 5.5];
    const LOG_AMPLITUDE: [f64; 10] = [-16.0, -12.0, -9.0, -6.0, -3.0, -1.0, 1.0, 4.0, 8.0, 14.0];
    const LOG_ONSET: [f64; 6] = [-0.7, -0.2, 0.2, 0.6, 1.2, 2.0];
    // The onset is searched relative to the range of the samples, which ends where masking does.
    let log_range = samples.last().map_or(0.0, |(elevation, _)| elevation.ln());
    LOG_K.map(|k| {
        LOG_AMPLITUDE
            .into_iter()
            .flat_map(|amplitude| LOG_ONSET.map(|onset| [amplitude, k, onset + log_range]))
            .map(|unknowns| DVector::from_column_slice(&unknowns))
            .map(|unknowns| (residuals(samples, &unknowns).norm_squared(), unknowns))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or_else(|| DVector::zeros(UNKNOWNS), |(_, unknowns)| unknowns)
    })
}

/// ln λ, ln k, ln(π/2 − θ0).
const UNKNOWNS: usize = 3;

/// Relative decrease of Σ (G1_fit − G1)² at which the descent ends.
const TOLERANCE: f64 = 1e-10;

/// Where the form still changes with its unknowns in f64. The published fits have ln λ from −16.9
/// to 16.6 and ln k from 1.7 to 6.8.
fn unknown_bounds() -> Bounds {
    Bounds {
        lower: DVector::from_column_slice(&[-18.0, -3.0, -60.0]),
        upper: DVector::from_column_slice(&[18.0, 7.0, 4.0]),
    }
}

/// The fit of the unknowns.
fn form(unknowns: &DVector<f64>) -> FittedMasking {
    /// Keeps c = L (π/2 − θ0)^{−k} within f64.
    const MAX_LOG_C: f64 = 600.0;
    let (amplitude, log_onset) = (unknowns[0].exp(), unknowns[2]);
    let largest_k = MAX_LOG_C / log_onset.abs().max(0.1);
    FittedMasking {
        amplitude,
        log_ratio: amplitude.recip().ln_1p(),
        k: unknowns[1].exp().min(largest_k),
        onset_elevation: log_onset.exp(),
    }
}

/// G1_fit − G1 at every sample.
fn residuals(samples: &[(f64, f64)], unknowns: &DVector<f64>) -> DVector<f64> {
    let masking = form(unknowns);
    let residuals = samples.iter().map(|(elevation, g1)| masking.g1_at_elevation(*elevation) - g1);
    DVector::from_iterator(samples.len(), residuals)
}

/// The normal equations of the residuals, their derivatives by central differences.
fn equations(samples: &[(f64, f64)], unknowns: &DVector<f64>) -> NormalEquations {
    /// Of logarithms, hence relative; the truncation is 1e-12, the rounding 1e-10.
    const STEP: f64 = 1e-6;
    let columns: Vec<DVector<f64>> = (0..UNKNOWNS)
        .map(|axis| {
            let [after, before] = [STEP, -STEP].map(|step| {
                let mut unknowns = unknowns.clone();
                unknowns[axis] += step;
                residuals(samples, &unknowns)
            });
            (after - before) / (2.0 * STEP)
        })
        .collect();
    let jacobian = DMatrix::from_columns(&columns);
    let residuals = residuals(samples, unknowns);
    NormalEquations {
        squares: residuals.norm_squared(),
        gradient: jacobian.tr_mul(&residuals),
        hessian: jacobian.tr_mul(&jacobian),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::catalog;

    fn exact(alpha: f64, p: f64) -> Sgd {
        Sgd::new(alpha, p, Accuracy::Reference)
    }

    #[test]
    fn theta0_is_the_printed_one() {
        for entry in catalog() {
            for (params, printed) in entry.channels.iter().zip(&entry.printed) {
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
            for params in &entry.channels {
                let exact = exact(params.alpha, params.p);
                let published = FittedMasking::new(params.masking.expect("published"));
                let fresh = FittedMasking::fit(&exact);
                let samples = fit_samples(&exact);
                let [fresh, published] = [fresh, published].map(|fit| -> f64 {
                    samples.iter().map(|(e, g1)| (fit.g1_at_elevation(*e) - g1).powi(2)).sum()
                });
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
