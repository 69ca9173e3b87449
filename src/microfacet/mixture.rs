//! Mixtures of Beckmann distributions. SGD is one, which makes its exact masking and its exact
//! sampling elementary.

use std::f64::consts::PI;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::math::direction::cot_theta;
use crate::math::quadrature::gauss_jacobi;
use crate::microfacet::Distribution;
use crate::microfacet::beckmann::{self, Beckmann};

/// A component of a mixture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Component {
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
///
/// # Example
///
/// ```
/// use sgdbake::{BeckmannMixture, Distribution, Sgd, microfacet::Accuracy};
///
/// let (alpha, p) = (0.12, 0.8);
/// let sgd = Sgd::new(alpha, p, Accuracy::Reference);
/// let mixture = BeckmannMixture::new(alpha, p, 1e-6);
/// assert!((mixture.ndf(0.1) / sgd.ndf(0.1) - 1.0).abs() < 1e-3);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BeckmannMixture {
    components: Vec<Component>,
    /// 1/α_b of each: multiplying is faster than dividing, and Λ of a pair takes some forty.
    inv_alpha: Vec<f64>,
}

/// Below this p the mixture is its limit, the single Beckmann lobe s = 0 of width √α.
///
/// The neglected weight is 1 − w(0) ≤ p·(ln(1 + 1/α) + 1), so Λ and D change by less than that
/// fraction of their largest value: under 2e-16 · 20 for every α ≥ 1e-8.
const SINGLE_P: f64 = 1e-16;

impl BeckmannMixture {
    /// The mixture for an SGD channel's `alpha` > 0, `p` ≥ 0 whose masking G1 is within
    /// `accuracy` (relative) of the exact one at every angle. `accuracy` is taken into
    /// [1e-13, 0.1].
    #[must_use]
    pub fn new(alpha: f64, p: f64, accuracy: f64) -> Self {
        if p < SINGLE_P {
            return Self::of(vec![Component { alpha: alpha.sqrt(), weight: 1.0 }]);
        }
        let accuracy = accuracy.clamp(1e-13, 0.1);
        let length = support(alpha, p, accuracy);
        let rule = gauss_jacobi(p, node_count(alpha, p, length, accuracy));
        let log_density: Vec<f64> =
            rule.iter().map(|node| log_density(alpha, p, node.x * length)).collect();
        // `of` scales the sum to 1, so K is not needed; relative to the largest, none overflows.
        let largest = log_density.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let raw = rule.iter().zip(&log_density).map(|(node, log_density)| Component {
            alpha: (alpha / (node.x * length).exp()).sqrt(),
            weight: node.weight * (log_density - largest).exp(),
        });
        Self::of(raw.collect())
    }

    /// The mixture of the given components, widest first, weights scaled to sum 1 and a
    /// negligible end cut off.
    #[must_use]
    pub fn of(mut components: Vec<Component>) -> Self {
        // Widest first: `lambda` ends early at the narrow ones, which mask least.
        components.sort_by(|a, b| b.alpha.total_cmp(&a.alpha));
        let total: f64 = components.iter().map(|component| component.weight).sum();
        // The narrow end: each adds less than its weight to Λ and D alike.
        while components.last().is_some_and(|component| component.weight < 1e-20 * total) {
            components.pop();
        }
        for component in &mut components {
            component.weight /= total;
        }
        let inv_alpha = components.iter().map(|component| 1.0 / component.alpha).collect();
        Self { components, inv_alpha }
    }

    /// The components, widest first.
    #[must_use]
    pub fn components(&self) -> &[Component] {
        &self.components
    }

    /// The widths of the narrowest and of the widest component.
    #[must_use]
    pub fn widths(&self) -> [f64; 2] {
        [self.components.last(), self.components.first()].map(|end| end.map_or(1.0, |c| c.alpha))
    }

    /// The width of the component that `choice` falls to among those seen at cotθo.
    ///
    /// Component j is chosen with probability ∝ w_j (1 + Λ_j(wo)), its share of the visible area.
    fn visible_width(&self, cot_theta: f64, choice: f64) -> f64 {
        // 1 + Λ = Σ w_j (1 + Λ_j) is the whole, as the weights sum to 1.
        let mut rest = choice * (1.0 + self.lambda(cot_theta));
        for Component { alpha, weight } in &self.components {
            rest -= weight * (1.0 + beckmann::lambda(cot_theta / alpha));
            if rest < 0.0 {
                return *alpha;
            }
        }
        self.components.last().map_or(1.0, |component| component.alpha)
    }

    /// The width of the component that `choice` falls to among those that mask at cotθ, and the
    /// place in its share, in [0, 1).
    ///
    /// Component j is chosen with probability w_j Λ_j/Λ; `lambda` is Λ there.
    #[must_use]
    pub fn masking_width(&self, cot_theta: f64, lambda: f64, choice: f64) -> (f64, f64) {
        let mut rest = choice * lambda;
        let widest = self.components.first().map_or(1.0, |component| component.alpha);
        for Component { alpha, weight } in &self.components {
            let masked = weight * beckmann::lambda(cot_theta / alpha);
            if rest < masked {
                return (*alpha, rest / masked);
            }
            rest -= masked;
        }
        // `lambda` was rounded up, or comes from a table.
        (widest, 0.5)
    }
}

impl Distribution for BeckmannMixture {
    fn slope_density(&self, tan2_theta: f64) -> f64 {
        let components = self.components.iter();
        components.map(|c| c.weight * Beckmann { alpha: c.alpha }.slope_density(tan2_theta)).sum()
    }

    /// Λ = Σ w_j Λ_j: the slope density enters it linearly.
    fn lambda(&self, cot_theta: f64) -> f64 {
        let mut sum = 0.0;
        for (component, inv_alpha) in self.components.iter().zip(&self.inv_alpha) {
            let lambda = beckmann::lambda(cot_theta * inv_alpha);
            sum += component.weight * lambda;
            // Narrower components mask less, and the weights sum to 1: the rest is below `lambda`.
            if lambda <= 0.5 * f64::EPSILON * sum {
                break;
            }
        }
        sum
    }

    /// Exact: with D = Σ w_j D_j and one G1, a component is chosen by its visible area.
    fn visible_normal(&self, wo: DVec3, [choice, u, v]: [f64; 3]) -> DVec3 {
        let alpha = self.visible_width(cot_theta(wo), choice);
        // Beckmann's distribution has no use for the first number.
        Beckmann { alpha }.visible_normal(wo, [0.0, u, v])
    }
}

/// Mixtures of one set of widths: a column of weights for each lobe of a material.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SharedMixture {
    /// Widths, ascending.
    pub alpha: Vec<f64>,
    /// Weights of each width, one per lobe, ≥ 0; each lobe's sum to 1.
    pub weights: Vec<Vec<f64>>,
}

impl SharedMixture {
    /// The mixture of one lobe.
    #[must_use]
    pub fn of_lobe(&self, lobe: usize) -> BeckmannMixture {
        let components = self.alpha.iter().zip(&self.weights);
        let components = components.map(|(alpha, weights)| Component {
            alpha: *alpha,
            weight: weights.get(lobe).copied().unwrap_or(0.0),
        });
        BeckmannMixture::of(components.collect())
    }
}

/// ln of the mixture's density over y, without its endpoint factor y^{p−1}.
fn log_density(alpha: f64, p: f64, y: f64) -> f64 {
    // (e^y − 1)/y is 0/0 at y = 0, where the first node of a p → 0 lies.
    let ratio = if y < 1e-8 { 1.0 } else { y.exp_m1() / y };
    (p - 1.0) * ratio.ln() - alpha * y.exp_m1()
}

/// The y beyond which the mixture's remaining weight is below `accuracy`.
fn support(alpha: f64, p: f64, accuracy: f64) -> f64 {
    // With t = α(e^y − 1) the density is about t^{p−1} e^{−t}: e^{−t} = `accuracy` there, and
    // 3 + 2.5p more make up for the power.
    let decay = 3.0 - accuracy.ln() + 2.5 * p;
    (decay / alpha).ln_1p()
}

/// A rule of n nodes costs n³. Only α below 1e-35 or p above 8e3 ask for more, far from any
/// surface; the accuracy is then lost, which the laws show.
const MAX_NODES: f64 = 400.0;

/// No fit of the catalogue has a larger p.
const LARGEST_MEASURED_P: f64 = 3.0;

/// Nodes for a relative `accuracy` over y in [0, length].
///
/// Two things limit Gauss quadrature here. The integrand is analytic only in the strip
/// |Im y| < π/2, where e^{−a²e^y} stops decaying: each node gains ρ² with
/// ln ρ = asinh(π/length), the Bernstein ellipse that touches the strip. And it decays by
/// e^{−decay} over the interval: the Chebyshev coefficients of e^{−decay·z} fall like
/// e^{−n²/decay}. A p above every measured one adds a factor (e^y−1)^{p−1} that both leave out:
/// one more node for each whole power.
fn node_count(alpha: f64, p: f64, length: f64, accuracy: f64) -> usize {
    let digits = -accuracy.ln();
    // ρ^{−2n} = `accuracy`, as n nodes integrate polynomials of degree 2n − 1 exactly.
    let for_strip = 0.5 * digits / (PI / length).asinh();
    // (2n)²/decay = −ln `accuracy`, with decay = α(e^length − 1).
    let for_decay = 0.5 * (alpha * length.exp_m1() * digits).sqrt();
    let for_power = (p - LARGEST_MEASURED_P).max(0.0);
    (for_strip.max(for_decay).ceil() + 2.0 + for_power.ceil()).min(MAX_NODES) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::microfacet::SgdNdf;

    #[test]
    fn no_parameters_ask_for_a_rule_without_end() {
        for (alpha, p) in [(0.1, 1e10), (1e-300, 0.5), (f64::MIN_POSITIVE, f64::MAX)] {
            let nodes = node_count(alpha, p, support(alpha, p, 1e-13), 1e-13);
            assert!(nodes as f64 <= MAX_NODES, "{nodes} for α {alpha}, p {p}");
        }
    }

    #[test]
    fn the_mixture_is_the_distribution() {
        for (alpha, p) in [(0.03, 0.45), (1.6e-5, 0.9), (0.5, 1.78), (50.0, 3.0), (1e-8, 4.0)] {
            let sgd = SgdNdf::new(alpha, p);
            let mixture = BeckmannMixture::new(alpha, p, 1e-13);
            for x in [0.0, 0.1, 1.0, 5.0].map(|z| z * alpha) {
                let sum = mixture.ndf(x);
                let exact = sgd.ndf(x);
                assert!((sum / exact - 1.0).abs() < 1e-10, "{alpha} {p} {x}: {sum} {exact}");
            }
        }
    }
}
