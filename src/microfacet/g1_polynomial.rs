//! G1 as one polynomial, for straight loops: a few fused operations in registers, where a table
//! would have to gather.

use crate::math::chebyshev::{nodes, powers, series};
use crate::math::direction::cot_of_cos;

/// G1 = u·P(u) in u = c/(c + s), c = cosθ.
///
/// # Derivation
///
/// With s near lim cosθ/G1 at grazing, u rises as G1 does there and both tend to 1; the ratio P is
/// smooth on the scale of the widest lobe that masks, so that its Chebyshev series over the range
/// of u is short. v = G1/cosθ = P(u)/(c + s) stays finite down to the horizon.
#[derive(Clone, Debug, PartialEq)]
pub struct G1Polynomial {
    /// s.
    pub scale: f64,
    /// The factor that takes u into [0, 2]; the polynomial's variable is t = `stretch`·u − 1.
    pub stretch: f64,
    /// Coefficients of the powers of t, lowest first.
    pub coefficients: Vec<f64>,
}

impl G1Polynomial {
    /// The polynomial through `g1`, a function of cotθ, at `N` nodes from the horizon to
    /// cosθ = `end`, without the last coefficients, which together change it by less than
    /// `accuracy` of it.
    #[must_use]
    pub fn new<const N: usize>(
        g1: impl Fn(f64) -> f64,
        scale: f64,
        end: f64,
        accuracy: f64,
    ) -> Self {
        /// cosθ/s that stands for the limit at grazing.
        const GRAZING: f64 = 1e-12;
        let last = end / (end + scale);
        let values = nodes::<N>().map(|t| {
            let u = 0.5 * (t + 1.0) * last;
            // The inverse of u = c/(c + s).
            let c = (scale * u / (1.0 - u).max(f64::MIN_POSITIVE)).clamp(GRAZING * scale, 1.0);
            g1(cot_of_cos(c)) * (c + scale) / c
        });
        // T_j is at most 1, so a share of the smallest P bounds the relative change everywhere.
        let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
        let coefficients = powers(needed(&series(values), accuracy * smallest));
        Self { scale, stretch: 2.0 / last, coefficients }
    }

    /// d(ln v)/du at the horizon.
    #[must_use]
    pub fn log_slope(&self) -> f64 {
        // At t = −1: P = Σ a (−1)^k, dP/dt = −Σ k a (−1)^k, and v ∝ P·(1 − u).
        let (value, slope) =
            self.coefficients.iter().enumerate().fold((0.0, 0.0), |(p, dp), (k, a)| {
                let signed = if k.is_multiple_of(2) { *a } else { -a };
                (p + signed, dp - k as f64 * signed)
            });
        if value > 0.0 { slope / value * self.stretch - 1.0 } else { 0.0 }
    }

    /// The coefficients in single precision, filled up with 0.
    #[must_use]
    pub fn single<const N: usize>(&self) -> [f32; N] {
        std::array::from_fn(|k| self.coefficients.get(k).copied().unwrap_or(0.0) as f32)
    }
}

/// The leading coefficients of a Chebyshev series, without the last ones that together stay below
/// `negligible`.
fn needed(series: &[f64], negligible: f64) -> &[f64] {
    let count = (0..series.len())
        .find(|count| series[*count..].iter().map(|a| a.abs()).sum::<f64>() <= negligible);
    &series[..count.unwrap_or(series.len())]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::microfacet::{Accuracy, Distribution as _, Sgd, grazing_limit};

    /// v = P(u)/(c + s).
    fn visibility(polynomial: &G1Polynomial, c: f64) -> f64 {
        let t = polynomial.stretch * c / (c + polynomial.scale) - 1.0;
        let ratio = polynomial.coefficients.iter().rev().fold(0.0, |sum, a| sum * t + a);
        ratio / (c + polynomial.scale)
    }

    #[test]
    fn the_polynomial_is_g1_and_its_slope_is_its_own() {
        for (alpha, p) in [(0.12, 0.8), (0.015, 0.46), (1e-3, 1.2)] {
            let sgd = Sgd::new(alpha, p, Accuracy::Table);
            let scale = 3.0 * grazing_limit(|cot| sgd.g1(cot));
            let polynomial = G1Polynomial::new::<20>(|cot| sgd.g1(cot), scale, 1.0, 0.0);
            for c in [1e-6, 1e-3, 0.05, 0.3, 0.9] {
                let g1 = visibility(&polynomial, c) * c;
                let exact = sgd.g1(c / (1.0_f64 - c * c).sqrt());
                assert!((g1 / exact - 1.0).abs() < 2e-5, "{alpha} {p} {c}: {g1} {exact}");
            }
            let step = 1e-6 * scale;
            let [low, high] = [0.0, step].map(|c| visibility(&polynomial, c).ln());
            let slope = (high - low) / (step / (step + scale));
            assert!((slope - polynomial.log_slope()).abs() < 1e-4 * (1.0 + slope.abs()));
        }
    }
}
