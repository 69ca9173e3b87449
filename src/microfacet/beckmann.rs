//! Beckmann's distribution.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::math::RealErrorFunctions as _;
use crate::microfacet::Distribution;

/// Beckmann's distribution of width `alpha`: D = e^{−x/α²}/(π α² cos⁴θ), x = tan²θ
/// (Walter et al. 2007, equation 25).
///
/// # Example
///
/// ```
/// use sgdbake::{Beckmann, Distribution};
///
/// let d = Beckmann { alpha: 0.3 };
/// assert!((d.ndf(0.0) - 1.0 / (std::f64::consts::PI * 0.09)).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beckmann {
    /// The width: the root mean square slope, times √2.
    pub alpha: f64,
}

impl Distribution for Beckmann {
    fn slope_density(&self, tan2_theta: f64) -> f64 {
        let alpha2 = self.alpha * self.alpha;
        (-tan2_theta / alpha2).exp() / (PI * alpha2)
    }

    fn lambda(&self, cot_theta: f64) -> f64 {
        lambda(cot_theta / self.alpha)
    }

    fn visible_normal(&self, wo: DVec3, [_, u, v]: [f64; 3]) -> DVec3 {
        visible_normal(wo, self.alpha, [u, v])
    }
}

impl Beckmann {
    /// ∂ ln D/∂ ln α at tan²θ: 2 (tan²θ/α² − 1).
    #[must_use]
    pub fn ndf_by_log_alpha(&self, tan2_theta: f64) -> f64 {
        2.0 * (tan2_theta / (self.alpha * self.alpha) - 1.0)
    }

    /// ∂Λ/∂ ln α at cotθ: e^{−a²}/(2a√π), a = cotθ/α.
    #[must_use]
    pub fn lambda_by_log_alpha(&self, cot_theta: f64) -> f64 {
        let a = cot_theta / self.alpha;
        (-a * a).exp() / (2.0 * a * PI.sqrt())
    }
}

/// The a beyond which e^{−a²} is 0 in f64.
const MAX_A: f64 = 27.3;

/// Smith's Λ of a Beckmann surface at a = cotθ/α_b.
///
/// # Formula
///
/// Λ(a) = ½ [e^{−a²}/(a√π) − erfc(a)] = ½ e^{−a²} [1/(a√π) − erfcx(a)]   (Walter et al. 2007)
///
/// The second form neither cancels nor underflows early; infinite at a = 0 (grazing).
#[must_use]
pub fn lambda(a: f64) -> f64 {
    if a > MAX_A {
        return 0.0;
    }
    0.5 * (-a * a).exp() * scaled_lambda(a)
}

/// 1/(a√π) − erfcx(a), from its asymptotic series where the difference would cancel.
fn scaled_lambda(a: f64) -> f64 {
    const FRAC_1_SQRT_PI: f64 = std::f64::consts::FRAC_2_SQRT_PI / 2.0;
    // The difference is 1/(2a²) of its terms: at 12 it has lost a factor 288 of its digits, while
    // ten terms of the series reach rounding there.
    if a < 12.0 {
        return FRAC_1_SQRT_PI / a - a.erfcx();
    }
    let q = 0.5 / (a * a);
    // 1 − 3q(1 − 5q(1 − 7q(…))) for the terms after the leading one of erfcx (DLMF 7.12.1).
    let series = (1..11).rev().fold(1.0, |sum, k| 1.0 - f64::from(2 * k + 1) * q * sum);
    FRAC_1_SQRT_PI / a * q * series
}

/// A visible normal of a Beckmann surface of width `alpha`, from two uniform numbers in [0, 1).
///
/// # Formula
///
/// Slopes seen from the direction stretched to width 1, with t = tanθ of that direction and the
/// x axis towards it, are independent: s_y of density e^{−s²}/√π, and s_x of density
/// ∝ (1 − t s) e^{−s²} for s < 1/t (Heitz 2014, section 5.3), each drawn by inverting its
/// distribution function.
fn visible_normal(wo: DVec3, alpha: f64, [u, v]: [f64; 2]) -> DVec3 {
    /// Beyond, the density no longer changes in f64.
    const LARGEST_TAN: f64 = 1e12;
    let across = DVec2::new(wo.x, wo.y);
    // Slopes divided by α have width 1, so a direction's tangent is multiplied by it.
    let tan_theta = (alpha * across.length() / wo.z).min(LARGEST_TAN);
    // Seen along the normal, every azimuth is as good.
    let towards = across.try_normalize().unwrap_or(DVec2::X);
    let along = visible_slope(tan_theta, u);
    // Across the view all slopes are seen alike: t = 0.
    let beside = visible_slope(0.0, v);
    let slope = alpha * (along * towards + beside * towards.perp());
    // A facet that rises towards the viewer has a normal that leans away.
    DVec3::new(-slope.x, -slope.y, 1.0).normalize()
}

/// The s < 1/t at which the density ∝ (1 − t s) e^{−s²} has accumulated to the share `u`.
///
/// Newton's method on F(s) = ½ erfc(−s) + t e^{−s²}/(2√π), kept inside a shrinking bracket.
fn visible_slope(tan_theta: f64, u: f64) -> f64 {
    /// erfc(6.5) is 4e-20, less than any step of `u` in f64.
    const FARTHEST: f64 = 6.5;
    let (mut low, mut high) = (-FARTHEST, (1.0 / tan_theta).min(FARTHEST));
    // F(1/t) = 1 + Λ, the whole: F is not normalised.
    let target = u * cumulative(tan_theta, high);
    // The median for t = 0; below the end 1/t, where the density is 0, for large t.
    let mut s = (low + high).clamp(-1.0, 0.0);
    for _ in 0..60 {
        let excess = cumulative(tan_theta, s) - target;
        if excess > 0.0 {
            high = s;
        } else {
            low = s;
        }
        let newton = s - excess / density(tan_theta, s);
        // Halve where Newton leaves the bracket, or has no step as the density is 0.
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - s).abs() < 1e-12 {
            return next;
        }
        s = next;
    }
    s
}

/// F(s) = ½ erfc(−s) + t e^{−s²}/(2√π).
fn cumulative(tan_theta: f64, s: f64) -> f64 {
    0.5 * libm::erfc(-s) + 0.5 * tan_theta * (-s * s).exp() / PI.sqrt()
}

/// dF/ds = (1 − t s) e^{−s²}/√π.
fn density(tan_theta: f64, s: f64) -> f64 {
    (1.0 - tan_theta * s) * (-s * s).exp() / PI.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_invert_their_distribution_function() {
        for tan_theta in [0.0, 1e-3, 0.5, 1.0, 30.0, 1e12] {
            let end = (1.0_f64 / tan_theta).min(6.5);
            for u in [0.0, 1e-12, 1e-3, 0.3, 0.5, 0.9, 1.0 - 1e-9] {
                let s = visible_slope(tan_theta, u);
                let share = cumulative(tan_theta, s) / cumulative(tan_theta, end);
                assert!(s <= end && (share - u).abs() < 1e-11, "{tan_theta} {u}: {s} {share}");
            }
        }
    }

    #[test]
    fn both_forms_of_scaled_lambda_meet() {
        let below = scaled_lambda(12.0 - 1e-12);
        let above = scaled_lambda(12.0);
        assert!((below / above - 1.0).abs() < 1e-12, "{below} {above}");
    }

    #[test]
    fn grazing_is_finite() {
        assert_eq!(Beckmann { alpha: 0.1 }.ndf(f64::INFINITY), 0.0);
    }
}
