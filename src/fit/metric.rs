//! How far apart two reflectances look: the transform in which a fit takes least squares.

use std::f64::consts::PI;
use std::fmt;

use serde::{Deserialize, Serialize};

/// A transform g of x = π f cosθi, the radiance relative to a white diffuse surface under the same
/// light. A fit minimises ∫∫ (g(x_fit) − g(x))² cosθo dωi dωo.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Metric {
    /// g = x: cosine-weighted least squares.
    Cosine,
    /// g = x^⅓ with CIELAB's linear toe: the lightness of x.
    #[default]
    CubeRoot,
    /// g = ln(1 + x).
    Log,
}

impl fmt::Display for Metric {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Cosine => "cosine",
            Self::CubeRoot => "cube root",
            Self::Log => "log",
        })
    }
}

/// (6/29)³, below which CIELAB's cube root continues as its tangent.
const TOE: f64 = 216.0 / 24389.0;
/// The slope there: (29/6)²/3.
const TOE_SLOPE: f64 = 841.0 / 108.0;

impl Metric {
    /// All metrics.
    pub const ALL: [Self; 3] = [Self::Cosine, Self::CubeRoot, Self::Log];

    /// g(π f cosθi) and its derivative with respect to f.
    #[inline]
    #[must_use]
    pub fn transform(self, f: f64, cos_theta_i: f64) -> (f64, f64) {
        let scale = PI * cos_theta_i;
        let (value, slope) = self.of_radiance(f * scale);
        (value, slope * scale)
    }

    /// g(x) and g'(x).
    #[inline]
    fn of_radiance(self, x: f64) -> (f64, f64) {
        match self {
            Self::Cosine => (x, 1.0),
            Self::CubeRoot if x > TOE => {
                let root = x.cbrt();
                (root, root / (3.0 * x))
            }
            Self::CubeRoot => (TOE_SLOPE * x + 4.0 / 29.0, TOE_SLOPE),
            Self::Log => (x.ln_1p(), 1.0 / (1.0 + x)),
        }
    }
}
