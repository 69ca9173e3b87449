//! Normal distributions D(h) \[1/sr\], all isotropic, all normalised to ∫ D cosθ dω = 1.
//!
//! Each is written through the slope density P22(x), x = tan²θ, as D = P22(x)/cos⁴θ, with
//! cos⁻⁴θ = (1+x)²: from x there is no cancellation however sharp the lobe.

use std::f64::consts::PI;

use crate::math::exponential_integral::scaled_exponential_integral;

/// The Shifted Gamma Distribution of Bagher, Soler and Holzschuch (2012), equation 11.
///
/// # Formula
///
/// ```text
/// D(θ) = P22(tan²θ)/(π cos⁴θ),   P22(x) = K e^{-t} t^{-p},   t = α + x/α,   K = 1/(α Γ(1-p, α))
/// ```
///
/// evaluated as P22(x) = P22(0) e^{−x/α} (1 + x/α²)^{−p} with P22(0) = 1/(α² eᵅE_p(α)), which is
/// the same without Γ of a negative order and without overflow for any α, p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SgdNdf {
    alpha: f64,
    p: f64,
    peak: f64,
}

impl SgdNdf {
    /// The distribution of shape `alpha` > 0, `p` ≥ 0.
    #[must_use]
    pub fn new(alpha: f64, p: f64) -> Self {
        let scaled_e_p = scaled_exponential_integral(p, alpha);
        Self { alpha, p, peak: 1.0 / (PI * alpha * alpha * scaled_e_p) }
    }

    /// The normalisation K = 1/(α Γ(1−p, α)) of the published table.
    #[must_use]
    pub fn k(&self) -> f64 {
        // K = π P22(0)/π · e^α α^p, from the definition at x = 0.
        PI * self.peak * self.alpha.exp() * self.alpha.powf(self.p)
    }

    /// D at θ = 0, the largest value of D·cos⁴θ \[1/sr\].
    #[must_use]
    pub fn peak(&self) -> f64 {
        self.peak
    }

    /// The width α.
    #[must_use]
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    /// The exponent p of the power factor.
    #[must_use]
    pub fn p(&self) -> f64 {
        self.p
    }

    /// ln(D·cos⁴θ / D(0)) = −x/α − p ln(1 + x/α²) at x = tan²θ; 0 at the peak, never above.
    #[must_use]
    pub fn log_decay(&self, tan2_theta: f64) -> f64 {
        -tan2_theta / self.alpha - self.p * (tan2_theta / self.alpha / self.alpha).ln_1p()
    }

    /// D·cos⁴θ = P22(x)/π at x = tan²θ.
    #[must_use]
    pub fn slope_density(&self, tan2_theta: f64) -> f64 {
        let decay = (-tan2_theta / self.alpha).exp();
        let power = (-self.p * (tan2_theta / self.alpha / self.alpha).ln_1p()).exp();
        if decay == 0.0 { 0.0 } else { self.peak * decay * power }
    }

    /// D at x = tan²θ \[1/sr\].
    #[must_use]
    pub fn eval(&self, tan2_theta: f64) -> f64 {
        from_slope_density(self.slope_density(tan2_theta), tan2_theta)
    }
}

/// Beckmann's distribution of width `alpha`: D = e^{−x/α²}/(π α² cos⁴θ) (Walter et al. 2007, eq. 25).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeckmannNdf {
    /// The root mean square slope, times √2.
    pub alpha: f64,
}

impl BeckmannNdf {
    /// D·cos⁴θ at x = tan²θ.
    #[must_use]
    pub fn slope_density(&self, tan2_theta: f64) -> f64 {
        let alpha2 = self.alpha * self.alpha;
        (-tan2_theta / alpha2).exp() / (PI * alpha2)
    }

    /// D at x = tan²θ \[1/sr\].
    #[must_use]
    pub fn eval(&self, tan2_theta: f64) -> f64 {
        from_slope_density(self.slope_density(tan2_theta), tan2_theta)
    }
}

/// The GGX distribution of width `alpha`: D = α²/(π cos⁴θ (α² + x)²) (Walter et al. 2007, eq. 33).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GgxNdf {
    /// The width α_g.
    pub alpha: f64,
}

impl GgxNdf {
    /// D at x = tan²θ \[1/sr\]; finite at grazing, where (1+x)/(α²+x) tends to 1.
    #[inline]
    #[must_use]
    pub fn eval(&self, tan2_theta: f64) -> f64 {
        let alpha2 = self.alpha * self.alpha;
        let ratio =
            if tan2_theta.is_finite() { (1.0 + tan2_theta) / (alpha2 + tan2_theta) } else { 1.0 };
        alpha2 / PI * ratio * ratio
    }
}

/// D = slope density · (1+x)², 0 where the density has underflowed whatever cos⁻⁴θ is.
fn from_slope_density(slope_density: f64, tan2_theta: f64) -> f64 {
    if slope_density == 0.0 {
        return 0.0;
    }
    let inv_cos2 = 1.0 + tan2_theta;
    slope_density * inv_cos2 * inv_cos2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn p_zero_is_beckmann_of_width_sqrt_alpha() {
        let (sgd, beckmann) = (SgdNdf::new(0.04, 0.0), BeckmannNdf { alpha: 0.2 });
        for x in [0.0, 0.01, 0.3, 2.0] {
            assert!((sgd.eval(x) / beckmann.eval(x) - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn grazing_is_finite() {
        assert_eq!(SgdNdf::new(0.01, 0.5).eval(f64::INFINITY), 0.0);
        assert_eq!(BeckmannNdf { alpha: 0.1 }.eval(f64::INFINITY), 0.0);
        assert!((GgxNdf { alpha: 0.1 }.eval(f64::INFINITY) - 0.01 / PI).abs() < 1e-17);
    }
}
