//! Beckmann or GGX, as a fit chooses between them.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::microfacet::{Beckmann, Distribution, Ggx};

/// A family of distributions with one width.
///
/// # Example
///
/// ```
/// use sgdbake::{Distribution, Family};
///
/// for family in [Family::Beckmann, Family::Ggx] {
///     let distribution = family.of_width(0.3);
///     assert!(distribution.ndf(0.0) > distribution.ndf(0.5));
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Family {
    /// D ∝ e^{−tan²θ/α²}/cos⁴θ.
    Beckmann,
    /// D ∝ 1/(cos⁴θ (α² + tan²θ)²).
    Ggx,
}

/// A distribution of one width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OneWidth {
    /// Beckmann's.
    Beckmann(Beckmann),
    /// GGX.
    Ggx(Ggx),
}

impl Family {
    /// The member of width `alpha`.
    #[must_use]
    pub fn of_width(self, alpha: f64) -> OneWidth {
        match self {
            Self::Beckmann => OneWidth::Beckmann(Beckmann { alpha }),
            Self::Ggx => OneWidth::Ggx(Ggx { alpha }),
        }
    }
}

impl OneWidth {
    /// ∂ ln D/∂ ln α at tan²θ.
    #[must_use]
    pub fn ndf_by_log_alpha(&self, tan2_theta: f64) -> f64 {
        match self {
            Self::Beckmann(beckmann) => beckmann.ndf_by_log_alpha(tan2_theta),
            Self::Ggx(ggx) => crate::microfacet::ggx::ndf_by_log_alpha(ggx.alpha, tan2_theta),
        }
    }

    /// ∂Λ/∂ ln α at cotθ.
    #[must_use]
    pub fn lambda_by_log_alpha(&self, cot_theta: f64) -> f64 {
        match self {
            Self::Beckmann(beckmann) => beckmann.lambda_by_log_alpha(cot_theta),
            Self::Ggx(ggx) => crate::microfacet::ggx::lambda_by_log_alpha(cot_theta / ggx.alpha),
        }
    }
}

impl Distribution for OneWidth {
    fn slope_density(&self, tan2_theta: f64) -> f64 {
        match self {
            Self::Beckmann(beckmann) => beckmann.slope_density(tan2_theta),
            Self::Ggx(ggx) => ggx.slope_density(tan2_theta),
        }
    }

    fn lambda(&self, cot_theta: f64) -> f64 {
        match self {
            Self::Beckmann(beckmann) => beckmann.lambda(cot_theta),
            Self::Ggx(ggx) => ggx.lambda(cot_theta),
        }
    }

    fn visible_normal(&self, wo: DVec3, u: [f64; 3]) -> DVec3 {
        match self {
            Self::Beckmann(beckmann) => beckmann.visible_normal(wo, u),
            Self::Ggx(ggx) => ggx.visible_normal(wo, u),
        }
    }

    fn ndf(&self, tan2_theta: f64) -> f64 {
        match self {
            Self::Beckmann(beckmann) => beckmann.ndf(tan2_theta),
            Self::Ggx(ggx) => ggx.ndf(tan2_theta),
        }
    }
}
