//! Visible normals of SGD by one draw from its slopes, without root finding.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::math::RealErrorFunctions as _;
use crate::math::direction::cot_theta;
use crate::math::octave_table::OctaveTable;
use crate::microfacet::{BeckmannMixture, G1Table};

/// Draws normals of density D(h) G1(wo) ⟨wo, h⟩/cosθo.
///
/// # Formula
///
/// With x the slope of a normal towards `wo` and t = tanθo, visible normals have the slope density
/// G1 P22 (1 + t x)₊. A slope drawn from P22 and mirrored to x > 0 with the probability
/// min(t |x|, 1) where x < 0 has the density P22 (1 + t x) for t |x| < 1 and 2 P22 for t x ≥ 1:
///
/// ```text
/// G1 P22 (1 + t x)₊ = G1 · [the density of that slope] + (1 − G1) · P22 (t x − 1)₊/Λ
/// ```
///
/// since ∫ P22 (t x − 1)₊ = Λ and 1 − G1 = G1 Λ. The rest, a twentieth of the draws over the
/// hemisphere, comes from one component of the Beckmann mixture.
///
/// The squared length x of a slope of P22 follows from e = −ln S(x), S the share of slopes that are
/// longer: S is uniform, and x(e) is a table within a relative 2e-7.
#[derive(Clone, Debug, PartialEq)]
pub struct VisibleNormals {
    g1: G1Table,
    squared_slope: SquaredSlope,
    mixture: BeckmannMixture,
}

impl VisibleNormals {
    /// The visible normals of a mixture.
    #[must_use]
    pub fn new(mixture: &BeckmannMixture) -> Self {
        Self {
            g1: G1Table::of(mixture),
            squared_slope: SquaredSlope::new(mixture),
            mixture: mixture.clone(),
        }
    }

    /// G1 at cotθ, within 1e-8.
    #[inline]
    #[must_use]
    pub fn g1(&self, cot_theta: f64) -> f64 {
        self.g1.g1(cot_theta)
    }

    /// A visible normal from three uniform numbers in [0, 1); `g1` is G1(wo).
    #[must_use]
    pub fn draw(&self, wo: DVec3, g1: f64, [choice, u, v]: [f64; 3]) -> DVec3 {
        let cot = cot_theta(wo);
        let across = DVec2::new(wo.x, wo.y);
        let towards = across.try_normalize().unwrap_or(DVec2::X);
        // With probability G1 a mirrored slope; what is left of `choice` is uniform again.
        let slope = if choice < g1 {
            self.mirrored(cot, [choice / g1, u, v])
        } else {
            self.beyond(cot, g1.recip() - 1.0, [(choice - g1) / (1.0 - g1), u, v])
        };
        let slope = slope.x * towards + slope.y * towards.perp();
        DVec3::new(slope.x, slope.y, 1.0).normalize()
    }

    /// A slope of P22, its x mirrored to point towards the viewer where that is due.
    fn mirrored(&self, cot: f64, [mirror, u, v]: [f64; 3]) -> DVec2 {
        // 1 − u, unlike u, is never 0.
        let length = self.squared_slope.at(-(-u).ln_1p()).sqrt();
        let (sin, cos) = (TAU * v).sin_cos();
        let x = length * cos;
        // mirror < t |x|, without the division by cot = 1/t, which is 0 at grazing.
        DVec2::new(if mirror * cot < -x { -x } else { x }, length * sin)
    }

    /// The squared length of a slope against e = −ln of the share of longer ones.
    #[must_use]
    pub fn squared_slope(&self, e: f64) -> f64 {
        self.squared_slope.at(e)
    }

    /// A slope of density ∝ P22 (t x − 1)₊, x towards the viewer, from Λ = `lambda` at cotθo and
    /// three uniform numbers.
    #[must_use]
    pub fn beyond(&self, cot: f64, lambda: f64, [choice, u, v]: [f64; 3]) -> DVec2 {
        let (alpha, place) = self.mixture.masking_width(cot, lambda, choice);
        // One coordinate of Box and Muller's pair, of density e^{−s²}/√π.
        let across = (-(-place).ln_1p()).sqrt() * (TAU * v).cos();
        alpha * DVec2::new(masking_slope(cot / alpha, u), across)
    }
}

/// The s > a of density ∝ (s − a) e^{−s²} at which the share `u` lies below.
///
/// # Formula
///
/// ```text
/// −ln(1 − u) = d (2a + d) − ln(q(a + d)/q(a)),   d = s − a,   q(s) = 1 − a √π erfcx(s)
/// ```
///
/// The right side is convex in d and at least d², so Newton's method from √(−ln(1 − u)) descends to
/// the root.
fn masking_slope(a: f64, u: f64) -> f64 {
    const MAX_STEPS: usize = 30;
    const ENOUGH: f64 = 1e-9;
    // a < 28, where Λ ends: q(a), about 1/(2a²), keeps twelve digits.
    let (e, q_a) = (-(-u).ln_1p(), q(a, a));
    let mut d = e.sqrt();
    for _ in 0..MAX_STEPS {
        let q_s = q(a, a + d);
        let excess = d * (2.0 * a + d) - (q_s / q_a).ln() - e;
        // The slope is 2d/q(s), since q′ = 2s q − 2d.
        let step = excess * q_s / (2.0 * d);
        // Rounding may be all that is left of the excess; it is not a number at d = 0.
        if step.is_nan() || step <= 0.0 {
            break;
        }
        d -= step;
        if step <= ENOUGH * d {
            break;
        }
    }
    a + d.max(0.0)
}

/// q(s) = 1 − a √π erfcx(s).
fn q(a: f64, s: f64) -> f64 {
    1.0 - a * PI.sqrt() * s.erfcx()
}

/// The squared length x of a slope against e = −ln S(x), S the share of longer slopes, within a
/// relative 2e-7 of e, the largest error of the published lobes and harder ones.
#[derive(Clone, Debug, PartialEq)]
struct SquaredSlope(OctaveTable);

impl SquaredSlope {
    /// e of the least share that 1 − u has in f64, and more.
    const FARTHEST: f64 = 38.0;

    /// x/e is smooth on every scale from where the narrowest component ends.
    fn new(mixture: &BeckmannMixture) -> Self {
        let rates: Vec<_> =
            mixture.components().iter().map(|c| (c.weight, 1.0 / (c.alpha * c.alpha))).collect();
        let [narrowest, _] = mixture.widths();
        // Below, even the narrowest component has not decayed: x/e is smooth, one piece suffices.
        let core = longer(&rates, narrowest * narrowest)[0].max(f64::MIN_POSITIVE);
        let steepest = longer(&rates, 0.0)[1];
        let mut last = [0.0, 0.0, steepest];
        // Each search starts where the last one ended.
        Self(OctaveTable::new([core.clamp(1e-12, 1.0), Self::FARTHEST], |e| {
            last = inverse(&rates, e, last, steepest);
            last[0] / e
        }))
    }

    #[inline]
    fn at(&self, e: f64) -> f64 {
        self.0.value(e).unwrap_or_default() * e
    }
}

/// e = −ln S and de/dx at x, of S = Σ weight e^{−rate x}.
fn longer(rates: &[(f64, f64)], x: f64) -> [f64; 2] {
    let (mut share, mut shorter, mut density) = (0.0, 0.0, 0.0);
    for (weight, rate) in rates {
        let kept = weight * (-rate * x).exp();
        shorter -= weight * (-rate * x).exp_m1();
        share += kept;
        density += rate * kept;
    }
    // Relatively exact at both ends.
    let e = if shorter < 0.5 { -(-shorter).ln_1p() } else { -share.ln() };
    [e, density / share]
}

/// The x at which −ln S is `e`, with what [`longer`] says there, from the place of another.
///
/// e(x) is concave, as S is a mixture of exponentials: Newton's method ends up below the root and
/// climbs.
fn inverse(rates: &[(f64, f64)], e: f64, last: [f64; 3], steepest: f64) -> [f64; 3] {
    const MAX_STEPS: usize = 60;
    const ENOUGH: f64 = 1e-13;
    let [mut x, mut found, mut slope] = last;
    for _ in 0..MAX_STEPS {
        // A concave curve lies below its tangent at 0, so x ≥ e/steepest: never below 0.
        let next = (x + (e - found) / slope).max(e / steepest);
        let done = (next - x).abs() <= ENOUGH * next;
        x = next;
        [found, slope] = longer(rates, x);
        if done {
            break;
        }
    }
    [x, found, slope]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::catalog;
    use crate::microfacet::{Accuracy, Sgd};

    fn published() -> impl Iterator<Item = Sgd> {
        let shapes = catalog().iter().flat_map(|entry| entry.channels).map(|c| (c.alpha, c.p));
        let odd = [(1e-8, 4.0), (50.0, 0.1), (0.3, 0.0), (1e-4, 1.8)];
        shapes.chain(odd).map(|(alpha, p)| Sgd::new(alpha, p, Accuracy::Table))
    }

    #[test]
    fn the_table_inverts_the_share_of_longer_slopes() {
        let mut worst: f64 = 0.0;
        for sgd in published() {
            let rates: Vec<_> =
                sgd.mixture().components().iter().map(|c| (c.weight, c.alpha.powi(-2))).collect();
            let table = SquaredSlope::new(sgd.mixture());
            for k in 0..400 {
                let e = 36.7 * 10_f64.powf(-f64::from(k) / 25.0);
                let error = (longer(&rates, table.at(e))[0] / e - 1.0).abs();
                worst = worst.max(error);
            }
        }
        assert!(worst < 2e-7, "{worst:e}");
    }

    #[test]
    fn masking_slopes_invert_their_distribution_function() {
        for a in [1e-6, 0.3, 1.0, 3.0, 8.0_f64] {
            // ∫ (s − a) e^{−s²} beyond s is e^{−s²} q(s)/2.
            let all = q(a, a) * f64::exp(-a * a);
            for u in [0.0, 1e-9, 1e-3, 0.3, 0.5, 0.9, 1.0 - 1e-9] {
                let s = masking_slope(a, u);
                let share = 1.0 - (-s * s).exp() * q(a, s) / all;
                assert!(s >= a && (share - u).abs() < 1e-10, "{a} {u}: {s} {share}");
            }
        }
    }
}
