//! The visible distance of two reflectances: the transform in which a fit takes least squares.

use std::f64::consts::PI;
use std::fmt;

use serde::{Deserialize, Serialize};

/// A transform g of x = π f cosθi, the radiance relative to a white diffuse surface under the same
/// light. A fit minimises ∫∫ (g(x_fit) − g(x))² cosθo dωi dωo.
///
/// # Example
///
/// ```
/// use sgdbake::{Metric, fit_gltf, named};
///
/// let fit = fit_gltf(named("chrome")?);
/// for metric in [Metric::Cosine, Metric::CubeRoot, Metric::Log] {
///     println!("{metric}: {:.3?}", fit.residuals.in_metric(metric));
/// }
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
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

/// x^⅓ for a normal x > 0, to 1e-14: a third of the exponent, then two steps of Halley's method.
/// The standard library's is rounded correctly, which took a fifth of the time of a fit.
#[inline(always)]
pub(super) fn cube_root(x: f64) -> f64 {
    // A third of the biased exponent, its bias restored; within 4 % of the root. The constant is
    // that of FreeBSD's cbrt, (1023 − 1023/3 − 0.03306)·2²⁰.
    let high = (x.to_bits() >> 32) as u32 / 3 + 0x2A9F_7893;
    let mut root = f64::from_bits(u64::from(high) << 32);
    // Halley's method cubes the error each time.
    for _ in 0..2 {
        let cube = root * root * root;
        root *= (cube + 2.0 * x) / (2.0 * cube + x);
    }
    root
}

/// (6/29)³, below which CIELAB's cube root continues as its tangent.
pub(super) const TOE: f64 = 216.0 / 24389.0;
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
    #[must_use]
    pub fn of_radiance(self, x: f64) -> (f64, f64) {
        match self {
            Self::Cosine => (x, 1.0),
            Self::CubeRoot => lightness(x),
            Self::Log => (x.ln_1p(), 1.0 / (1.0 + x)),
        }
    }
}

/// x^⅓ with its toe, and its slope.
#[inline]
fn lightness(x: f64) -> (f64, f64) {
    if x > TOE {
        let root = cube_root(x);
        (root, root / (3.0 * x))
    } else {
        toe(x)
    }
}

/// The tangent of x^⅓ at [`TOE`], and its slope.
#[inline(always)]
pub(super) fn toe(x: f64) -> (f64, f64) {
    (TOE_SLOPE * x + 4.0 / 29.0, TOE_SLOPE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cube_root_is_accurate_over_all_radiances() {
        for i in 0..4000 {
            let x = TOE * 1.01_f64.powi(i);
            assert!((cube_root(x) / x.cbrt() - 1.0).abs() < 1e-14, "{x:e}");
        }
    }
}
