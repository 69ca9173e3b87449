//! The GGX distribution.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::microfacet::Distribution;

/// The GGX distribution of width `alpha`: D = α²/(π cos⁴θ (α² + x)²), x = tan²θ
/// (Walter et al. 2007, equation 33).
///
/// # Example
///
/// ```
/// use sgdbake::{Beckmann, Distribution, Ggx};
///
/// // The tail of GGX is longer: at a slope of 1 its D is larger.
/// assert!(Ggx { alpha: 0.2 }.ndf(1.0) > Beckmann { alpha: 0.2 }.ndf(1.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    /// The width α_g: roughness² in the usual convention.
    pub alpha: f64,
}

impl Distribution for Ggx {
    fn slope_density(&self, tan2_theta: f64) -> f64 {
        let alpha2 = self.alpha * self.alpha;
        alpha2 / PI / (alpha2 + tan2_theta).powi(2)
    }

    #[inline]
    fn lambda(&self, cot_theta: f64) -> f64 {
        lambda(cot_theta / self.alpha)
    }

    fn visible_normal(&self, wo: DVec3, [_, u, v]: [f64; 3]) -> DVec3 {
        visible_normal(wo, self.alpha, [u, v])
    }

    /// Finite at grazing, where (1+x)/(α²+x) tends to 1.
    #[inline]
    fn ndf(&self, tan2_theta: f64) -> f64 {
        let alpha2 = self.alpha * self.alpha;
        let ratio =
            if tan2_theta.is_finite() { (1.0 + tan2_theta) / (alpha2 + tan2_theta) } else { 1.0 };
        alpha2 / PI * ratio * ratio
    }
}

/// Smith's Λ of a GGX surface at a = cotθ/α: ½(√(1 + 1/a²) − 1) (Heitz 2014, eq. 72).
#[inline]
#[must_use]
pub fn lambda(a: f64) -> f64 {
    // √(1+y) − 1 = y/(√(1+y) + 1) without cancellation.
    // At grazing y overflows, and ∞/∞ would be NaN.
    let y = 1.0 / (a * a);
    if y.is_finite() { 0.5 * y / ((1.0 + y).sqrt() + 1.0) } else { f64::INFINITY }
}

/// ∂Λ/∂ ln α of a GGX surface at a = cotθ/α.
#[inline]
#[must_use]
pub fn lambda_by_log_alpha(a: f64) -> f64 {
    0.5 / (a * (1.0 + a * a).sqrt())
}

/// ∂ ln D/∂ ln α of a GGX surface at x = tan²θ.
#[inline]
#[must_use]
pub fn ndf_by_log_alpha(alpha: f64, tan2_theta: f64) -> f64 {
    let alpha2 = alpha * alpha;
    2.0 - 4.0 * alpha2 / (alpha2 + tan2_theta)
}

/// A visible normal of a GGX surface of width `alpha`, from two uniform numbers in [0, 1).
///
/// A point of the spherical cap that the stretched `wo` sees, halved with it (Heitz 2018, in the
/// form of Dupuy and Benyoub 2023).
fn visible_normal(wo: DVec3, alpha: f64, [u, v]: [f64; 2]) -> DVec3 {
    let stretched = DVec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize();
    // Uniform on the cap z > −stretched.z: equal heights of a sphere have equal areas.
    let z = (1.0 - v) * (1.0 + stretched.z) - stretched.z;
    let sin_theta = (1.0 - z * z).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (TAU * u).sin_cos();
    let h = DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, z) + stretched;
    // h.z is 0 or more but for rounding.
    DVec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grazing_is_finite() {
        assert!((Ggx { alpha: 0.1 }.ndf(f64::INFINITY) - 0.01 / PI).abs() < 1e-17);
    }
}
