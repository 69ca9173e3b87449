//! Texture axes: which variable runs along one, and the warp that spreads the error evenly.

use serde::{Deserialize, Serialize};

/// The variable along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Variable {
    /// tan²θh of the half vector, in [0, ∞].
    Tan2ThetaH,
    /// cotθ = cosθ/sinθ of a direction, in [0, ∞].
    CotTheta,
    /// cosθd = wi·h, in [0, 1].
    CosThetaD,
    /// cosθo of the viewer, in [0, 1].
    CosThetaO,
    /// |cosφd| of the difference vector around the half vector, in [0, 1].
    AbsCosPhiD,
    /// One row per material.
    Row,
}

/// An axis of a texture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// The variable.
    pub variable: Variable,
    /// How the variable becomes a coordinate; a row has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warp: Option<Warp>,
}

/// A map from a variable x to a coordinate u in \[0, 1\], with constants per row of the texture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Warp {
    /// u = x.
    Identity,
    /// u = ln(1 + min(x, m)/s) / ln(1 + m/s).
    Log1p {
        /// s > 0 of each row.
        scale: Vec<f64>,
        /// m > 0 of each row.
        max: Vec<f64>,
    },
    /// u = x/(x + s), 1 for x = ∞.
    Rational {
        /// s > 0 of each row.
        scale: Vec<f64>,
    },
}

impl Axis {
    /// The axis that selects the material.
    pub const ROW: Self = Self { variable: Variable::Row, warp: None };
}

impl Warp {
    /// The coordinate u of x ≥ 0 in a row.
    #[must_use]
    pub fn coordinate(&self, row: usize, x: f64) -> f64 {
        match self {
            Self::Identity => x.clamp(0.0, 1.0),
            Self::Log1p { scale, max } => {
                // The minimum takes x = ∞ to u = 1; ln_1p keeps the digits of x far below s.
                (x.min(max[row]) / scale[row]).ln_1p() / (max[row] / scale[row]).ln_1p()
            }
            // Divided by x, so that x = 0 gives 0 and x = ∞ gives 1, neither of them NaN.
            Self::Rational { scale } => 1.0 / (1.0 + scale[row] / x),
        }
    }

    /// The variable x at a coordinate u in \[0, 1\] of a row: the inverse of [`Self::coordinate`].
    #[must_use]
    pub fn variable(&self, row: usize, u: f64) -> f64 {
        match self {
            Self::Identity => u,
            Self::Log1p { scale, max } => {
                scale[row] * (u * (max[row] / scale[row]).ln_1p()).exp_m1()
            }
            // ∞ at u = 1: normal incidence.
            Self::Rational { scale } => scale[row] * u / (1.0 - u),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coordinate_leads_back_to_its_variable() {
        let log1p = Warp::Log1p { scale: vec![1e-9], max: vec![0.01] };
        let rational = Warp::Rational { scale: vec![0.004] };
        for warp in [Warp::Identity, log1p, rational] {
            for u in [0.0, 1e-6, 0.25, 0.5, 0.999, 1.0] {
                let back = warp.coordinate(0, warp.variable(0, u));
                assert!((back - u).abs() < 1e-14, "{warp:?} {u} {back}");
            }
        }
    }
}
