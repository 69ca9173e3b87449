//! SGD as a convex mixture of Beckmann lobes: what makes its exact masking and its exact
//! sampling elementary.

use std::f64::consts::PI;

use crate::math::RealErrorFunctions as _;
use crate::math::quadrature::gauss_jacobi;
use crate::microfacet::ndf::BeckmannNdf;

/// One Beckmann lobe of a mixture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeckmannLobe {
    /// Beckmann width α_b.
    pub alpha: f64,
    /// Share of the mixture's slope density; a mixture's weights sum to 1.
    pub weight: f64,
}

/// D_sgd = Σ weight · D_beckmann(alpha), to a requested accuracy of its masking.
///
/// # Formula
///
/// From t^{−p} = 1/Γ(p) ∫ s^{p−1} e^{−st} ds, for p > 0 (exact, not an approximation):
///
/// ```text
/// D_sgd = ∫_0^∞ w(s) D_beckmann(α_b(s)) ds,     α_b(s)² = α/(1+s)
/// w(s) ds ∝ (e^y - 1)^{p-1} e^{-α(e^y - 1)} dy,   y = ln(1+s),   ∫ w ds = 1
/// ```
///
/// discretised by Gauss–Jacobi quadrature with the endpoint weight y^{p−1}. The slope density of
/// a rough surface enters Smith's Λ linearly, so the same nodes give Λ_sgd.
#[derive(Clone, Debug, PartialEq)]
pub struct BeckmannMixture {
    lobes: Vec<BeckmannLobe>,
}

/// Below this p the mixture is its limit, the single Beckmann lobe s = 0 of width √α.
///
/// The neglected weight is 1 − w(0) ≤ p·(ln(1 + 1/α) + 1), so Λ and D change by less than that
/// fraction of their largest value: under 2e-16 · 20 for every α ≥ 1e-8.
const SINGLE_LOBE_P: f64 = 1e-16;

impl BeckmannMixture {
    /// The mixture for an SGD channel's `alpha` > 0, `p` ≥ 0 whose masking G1 is within
    /// `accuracy` (relative) of the exact one at every angle. `accuracy` is taken into
    /// [1e-13, 0.1].
    #[must_use]
    pub fn new(alpha: f64, p: f64, accuracy: f64) -> Self {
        if p < SINGLE_LOBE_P {
            return Self { lobes: vec![BeckmannLobe { alpha: alpha.sqrt(), weight: 1.0 }] };
        }
        let accuracy = accuracy.clamp(1e-13, 0.1);
        let length = support(alpha, p, accuracy);
        let rule = gauss_jacobi(p, node_count(alpha, length, accuracy));
        let log_density: Vec<f64> =
            rule.iter().map(|node| log_density(alpha, p, node.x * length)).collect();
        let largest = log_density.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let raw = rule.iter().zip(&log_density).map(|(node, log_density)| BeckmannLobe {
            alpha: (alpha / (node.x * length).exp()).sqrt(),
            weight: node.weight * (log_density - largest).exp(),
        });
        Self::of_lobes(raw.collect())
    }

    /// The mixture of the given lobes, widest first or in any order, weights scaled to sum 1 and a
    /// negligible end cut off.
    #[must_use]
    pub fn of_lobes(mut lobes: Vec<BeckmannLobe>) -> Self {
        let total: f64 = lobes.iter().map(|lobe| lobe.weight).sum();
        // Sharp lobes at the far end: each adds less than its weight to Λ and D alike.
        while lobes.last().is_some_and(|lobe| lobe.weight < 1e-20 * total) {
            lobes.pop();
        }
        for lobe in &mut lobes {
            lobe.weight /= total;
        }
        Self { lobes }
    }

    /// The lobes, widest first.
    #[must_use]
    pub fn lobes(&self) -> &[BeckmannLobe] {
        &self.lobes
    }

    /// D = Σ weight · D_beckmann(alpha) at x = tan²θ \[1/sr\].
    #[must_use]
    pub fn ndf(&self, tan2_theta: f64) -> f64 {
        let lobe = |l: &BeckmannLobe| l.weight * BeckmannNdf { alpha: l.alpha }.eval(tan2_theta);
        self.lobes.iter().map(lobe).sum()
    }
}

/// ln of the mixture's density over y, without its endpoint factor y^{p−1}.
fn log_density(alpha: f64, p: f64, y: f64) -> f64 {
    let ratio = if y < 1e-8 { 1.0 } else { y.exp_m1() / y };
    (p - 1.0) * ratio.ln() - alpha * y.exp_m1()
}

/// The y beyond which the mixture's remaining weight is below `accuracy`: there
/// α(e^y − 1) exceeds the mode (p−1) of the gamma-like tail by enough decades.
fn support(alpha: f64, p: f64, accuracy: f64) -> f64 {
    let decay = 3.0 - accuracy.ln() + 2.5 * p;
    (decay / alpha).ln_1p()
}

/// A rule of n nodes costs n³. Only α below 1e-35 or p above 8e3 ask for more, far from any surface;
/// the accuracy is then lost, which the laws show.
const MOST_NODES: f64 = 400.0;

/// Nodes for a relative `accuracy` over y in [0, length].
///
/// Two things limit Gauss quadrature here. The integrand is analytic only in the strip
/// |Im y| < π/2, where e^{−a²e^y} stops decaying: each node gains ρ² with
/// ln ρ = asinh(π/length), the Bernstein ellipse that touches the strip. And it decays by
/// e^{−decay} over the interval: the Chebyshev coefficients of e^{−decay·z} fall like
/// e^{−n²/decay}.
fn node_count(alpha: f64, length: f64, accuracy: f64) -> usize {
    let digits = -accuracy.ln();
    let for_strip = 0.5 * digits / (PI / length).asinh();
    let for_decay = 0.5 * (alpha * length.exp_m1() * digits).sqrt();
    (for_strip.max(for_decay).ceil() + 2.0).min(MOST_NODES) as usize
}

/// Beyond it e^{−a²} is no number but 0.
const MOST_A: f64 = 27.3;

/// Smith's Λ of a Beckmann surface at a = cotθ/α_b.
///
/// # Formula
///
/// Λ(a) = ½ [e^{−a²}/(a√π) − erfc(a)] = ½ e^{−a²} [1/(a√π) − erfcx(a)]   (Walter et al. 2007)
///
/// The second form neither cancels nor underflows early; infinite at a = 0 (grazing).
#[must_use]
pub fn beckmann_lambda(a: f64) -> f64 {
    if a > MOST_A {
        return 0.0;
    }
    0.5 * (-a * a).exp() * scaled_lambda(a)
}

/// 1/(a√π) − erfcx(a), from its asymptotic series where the difference would cancel.
fn scaled_lambda(a: f64) -> f64 {
    const FRAC_1_SQRT_PI: f64 = std::f64::consts::FRAC_2_SQRT_PI / 2.0;
    if a < 12.0 {
        return FRAC_1_SQRT_PI / a - a.erfcx();
    }
    let q = 0.5 / (a * a);
    // 1 − 3q(1 − 5q(1 − 7q(…))) for the terms after the leading one of erfcx (DLMF 7.12.1).
    let series = (1..11).rev().fold(1.0, |sum, k| 1.0 - f64::from(2 * k + 1) * q * sum);
    FRAC_1_SQRT_PI / a * q * series
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::microfacet::ndf::SgdNdf;

    #[test]
    fn both_forms_of_scaled_lambda_meet() {
        let below = scaled_lambda(12.0 - 1e-12);
        let above = scaled_lambda(12.0);
        assert!((below / above - 1.0).abs() < 1e-12, "{below} {above}");
    }

    #[test]
    fn no_parameters_ask_for_a_rule_without_end() {
        for (alpha, p) in [(0.1, 1e10), (1e-300, 0.5), (f64::MIN_POSITIVE, f64::MAX)] {
            let nodes = node_count(alpha, support(alpha, p, 1e-13), 1e-13);
            assert!(nodes as f64 <= MOST_NODES, "{nodes} for α {alpha}, p {p}");
        }
    }

    #[test]
    fn the_mixture_is_the_distribution() {
        for (alpha, p) in [(0.03, 0.45), (1.6e-5, 0.9), (0.5, 1.78), (50.0, 3.0), (1e-8, 4.0)] {
            let sgd = SgdNdf::new(alpha, p);
            let mixture = BeckmannMixture::new(alpha, p, 1e-13);
            for x in [0.0, 0.1, 1.0, 5.0].map(|z| z * alpha) {
                let sum: f64 = mixture
                    .lobes()
                    .iter()
                    .map(|lobe| lobe.weight * BeckmannNdf { alpha: lobe.alpha }.eval(x))
                    .sum();
                let exact = sgd.eval(x);
                assert!((sum / exact - 1.0).abs() < 1e-10, "{alpha} {p} {x}: {sum} {exact}");
            }
        }
    }
}
