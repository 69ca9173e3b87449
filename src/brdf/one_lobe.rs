//! The reflectance of one Beckmann or GGX lobe over a diffuse base, as most engines have it.

use std::f64::consts::{FRAC_1_PI, PI};
use std::str::FromStr;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::brdf::Reflectance;
use crate::brdf::eval::{above_horizon, cos_theta_d};
use crate::math::direction::{cos_theta, cot_theta, half_sum, tan2_theta};
use crate::microfacet::beckmann_mixture::beckmann_lambda;
use crate::microfacet::{BeckmannNdf, GgxNdf};

/// A normal distribution with one width.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Distribution {
    /// D ∝ e^{−tan²θ/α²}/cos⁴θ.
    Beckmann,
    /// D ∝ 1/(cos⁴θ (α² + tan²θ)²).
    Ggx,
}

/// Not the name of a distribution.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no distribution is called '{0}'; accepted are beckmann, ggx")]
pub struct UnknownDistribution(String);

impl FromStr for Distribution {
    type Err = UnknownDistribution;

    fn from_str(name: &str) -> Result<Self, UnknownDistribution> {
        match name {
            "beckmann" => Ok(Self::Beckmann),
            "ggx" => Ok(Self::Ggx),
            _ => Err(UnknownDistribution(name.to_owned())),
        }
    }
}

impl Distribution {
    /// D at x = tan²θ for width `alpha` \[1/sr\].
    #[must_use]
    pub fn ndf(self, alpha: f64, tan2_theta: f64) -> f64 {
        match self {
            Self::Beckmann => BeckmannNdf { alpha }.eval(tan2_theta),
            Self::Ggx => GgxNdf { alpha }.eval(tan2_theta),
        }
    }

    /// Smith's Λ at cotθ for width `alpha`; infinite at grazing.
    #[must_use]
    pub fn lambda(self, alpha: f64, cot_theta: f64) -> f64 {
        match self {
            Self::Beckmann => beckmann_lambda(cot_theta / alpha),
            Self::Ggx => ggx_lambda(cot_theta / alpha),
        }
    }
}

impl Distribution {
    /// ∂ ln D/∂ ln α at x = tan²θ.
    #[must_use]
    pub fn ndf_slope(self, alpha: f64, tan2_theta: f64) -> f64 {
        match self {
            Self::Beckmann => 2.0 * (tan2_theta / (alpha * alpha) - 1.0),
            Self::Ggx => ggx_ndf_slope(alpha, tan2_theta),
        }
    }

    /// ∂Λ/∂ ln α at cotθ: e^{−a²}/(2a√π) of Beckmann, 1/(2a√(1+a²)) of GGX, a = cotθ/α.
    #[must_use]
    pub fn lambda_slope(self, alpha: f64, cot_theta: f64) -> f64 {
        let a = cot_theta / alpha;
        match self {
            Self::Beckmann => (-a * a).exp() / (2.0 * a * PI.sqrt()),
            Self::Ggx => ggx_lambda_slope(a),
        }
    }
}

/// Smith's Λ of a GGX surface at a = cotθ/α: ½(√(1 + 1/a²) − 1) (Heitz 2014, eq. 72).
#[inline]
#[must_use]
pub fn ggx_lambda(a: f64) -> f64 {
    // √(1+y) − 1 = y/(√(1+y) + 1) without cancellation.
    let y = 1.0 / (a * a);
    if y.is_finite() { 0.5 * y / ((1.0 + y).sqrt() + 1.0) } else { f64::INFINITY }
}

/// ∂Λ/∂ ln α of a GGX surface at a = cotθ/α.
#[inline]
#[must_use]
pub fn ggx_lambda_slope(a: f64) -> f64 {
    0.5 / (a * (1.0 + a * a).sqrt())
}

/// ∂ ln D/∂ ln α of a GGX surface at x = tan²θ.
#[inline]
#[must_use]
pub fn ggx_ndf_slope(alpha: f64, tan2_theta: f64) -> f64 {
    let alpha2 = alpha * alpha;
    2.0 - 4.0 * alpha2 / (alpha2 + tan2_theta)
}

/// F(cosθd) = f0 + (f90 − f0)(1−cosθd)⁵ − f1·cosθd: the SGD Fresnel curve times a scale.
///
/// Never negative on \[0, 1\] when f0, f90 and f0 − f1 are ≥ 0; may exceed 1, as published curves do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScaledFresnel {
    /// The value that Schlick's term starts from.
    pub f0: f64,
    /// F(90°).
    pub f90: f64,
    /// The slope of the linear term; F(0°) = f0 − f1.
    pub f1: f64,
}

impl ScaledFresnel {
    /// F at cosθd = wi·h.
    #[must_use]
    pub fn eval(&self, cos_theta_d: f64) -> f64 {
        self.f0 + (self.f90 - self.f0) * (1.0 - cos_theta_d).powi(5) - self.f1 * cos_theta_d
    }
}

/// One colour channel of a [`OneLobeBrdf`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OneLobeChannel {
    /// Diffuse albedo ρd.
    pub rho_d: f64,
    /// Width α of the distribution (roughness² in the usual convention).
    pub alpha: f64,
    /// The specular colour against angle.
    pub fresnel: ScaledFresnel,
}

/// A diffuse base and one microfacet lobe per channel.
///
/// # Formula
///
/// f(wi, wo) = ρd/π + F(wi·h) D(h) G1(wi) G1(wo)/(4 cosθi cosθo)   \[1/sr\],   G1 = 1/(1+Λ)
///
/// (Walter et al. 2007, with the separable Smith masking that SGD has too.)
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OneLobeBrdf {
    /// Which D, and with it which Λ.
    pub distribution: Distribution,
    /// Parameters in the order r, g, b.
    pub channels: [OneLobeChannel; 3],
}

impl Reflectance for OneLobeBrdf {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !(above_horizon(wi) && above_horizon(wo)) {
            return [0.0; 3];
        }
        let h = half_sum(wi, wo);
        let cot = [cot_theta(wi), cot_theta(wo)];
        let cos = [cos_theta(wi), cos_theta(wo)];
        self.channels.map(|channel| {
            let lobe = self.lobe(channel.alpha, tan2_theta(h), cot, cos);
            channel.rho_d * FRAC_1_PI + channel.fresnel.eval(cos_theta_d(h)) * lobe
        })
    }
}

impl OneLobeBrdf {
    /// D G1 G1/(4 cosθi cosθo).
    fn lobe(&self, alpha: f64, tan2_theta_h: f64, cot: [f64; 2], cos: [f64; 2]) -> f64 {
        let d = self.distribution.ndf(alpha, tan2_theta_h);
        let v = |i: usize| 1.0 / ((1.0 + self.distribution.lambda(alpha, cot[i])) * cos[i]);
        0.25 * d * (v(0) * v(1))
    }
}

/// 4/π·ρs, the factor from a published ρs to [`ScaledFresnel`]: SGD's formula has no ¼ and a 1/π.
pub const SCALE_OF_RHO_S: f64 = 4.0 / PI;
