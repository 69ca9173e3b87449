//! The Fresnel factor of the SGD model.

/// F(cosθd) = f0 + (1−f0)(1−cosθd)⁵ − f1·cosθd (Bagher et al. 2012, equation 9).
///
/// A fitted curve, not a physical law: it leaves [0, 1] for some published channels (below 0 in
/// 7, above 1 in 10), and is evaluated as published, never clamped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fresnel {
    /// The value that Schlick's term starts from.
    pub f0: f64,
    /// The slope of the linear term; F(0°) = f0 − f1.
    pub f1: f64,
}

/// Schlick(f0 → f90, exponent) = f0 + (f90−f0)(1−cosθ)^exponent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SchlickTerm {
    /// Value at normal incidence.
    pub f0: f64,
    /// Value at grazing incidence.
    pub f90: f64,
    /// 5 for Schlick's own curve.
    pub exponent: f64,
}

impl Fresnel {
    /// F at cosθd = wi·h.
    #[must_use]
    pub fn eval(&self, cos_theta_d: f64) -> f64 {
        let Self { f0, f1 } = *self;
        f0 + (1.0 - f0) * (1.0 - cos_theta_d).powi(5) - f1 * cos_theta_d
    }

    /// The exact split into two generalised Schlick terms, for renderers that offer those.
    ///
    /// f1 ≥ 0: Schlick(f0−f1 → 1−f1, 5) + Schlick(0 → f1, 1);
    /// f1 < 0: Schlick(f0 → 1, 5) + Schlick(−f1 → 0, 1).
    #[must_use]
    pub fn schlick_terms(&self) -> [SchlickTerm; 2] {
        let Self { f0, f1 } = *self;
        let falling = f1.max(0.0);
        let rising = (-f1).max(0.0);
        [
            SchlickTerm { f0: f0 - falling, f90: 1.0 - falling, exponent: 5.0 },
            SchlickTerm { f0: rising, f90: falling, exponent: 1.0 },
        ]
    }
}

impl SchlickTerm {
    /// The term at cosθd = wi·h.
    #[must_use]
    pub fn eval(&self, cos_theta_d: f64) -> f64 {
        self.f0 + (self.f90 - self.f0) * (1.0 - cos_theta_d).powf(self.exponent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_schlick_terms_are_the_published_curve() {
        for fresnel in [Fresnel { f0: 0.24, f1: 0.18 }, Fresnel { f0: 9e-12, f1: -0.61 }] {
            for cos_theta_d in [0.0, 0.1, 0.5, 0.9, 1.0] {
                let sum: f64 = fresnel.schlick_terms().iter().map(|t| t.eval(cos_theta_d)).sum();
                assert!((sum - fresnel.eval(cos_theta_d)).abs() < 1e-15);
            }
        }
    }
}
