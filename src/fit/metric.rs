//! How far apart two reflectances look: the transform in which a fit takes least squares.

use std::f64::consts::PI;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::fit::lanes::Side;
use crate::math::least_squares::{LANES, Lanes, Terms};

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
fn cube_root(x: f64) -> f64 {
    // A third of the biased exponent, its bias restored; within 4 % of the root.
    let high = (x.to_bits() >> 32) as u32 / 3 + 0x2A9F_7893;
    let mut root = f64::from_bits(u64::from(high) << 32);
    for _ in 0..2 {
        let cube = root * root * root;
        root *= (cube + 2.0 * x) / (2.0 * cube + x);
    }
    root
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

    /// Adds the residuals g − goal of channel `c`, of f at the pairs of each side.
    #[inline(always)]
    pub fn add(self, terms: &mut Terms, f: &Lanes, sides: &[Side], c: usize) {
        match self {
            Self::Cosine => add(terms, f, sides, c, |x| (x, 1.0)),
            Self::CubeRoot => add_lightness(terms, f, sides, c),
            Self::Log => add(terms, f, sides, c, |x| (x.ln_1p(), 1.0 / (1.0 + x))),
        }
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
fn toe(x: f64) -> (f64, f64) {
    (TOE_SLOPE * x + 4.0 / 29.0, TOE_SLOPE)
}

#[inline(always)]
fn add(
    terms: &mut Terms,
    f: &Lanes,
    sides: &[Side],
    c: usize,
    of_radiance: impl Fn(f64) -> (f64, f64),
) {
    for side in sides {
        for (l, f) in f.iter().enumerate() {
            let (value, slope) = of_radiance(f * side.scale[l]);
            terms.add(l, side.weight[l], value - side.goal[c][l], slope * side.scale[l]);
        }
    }
}

/// As [`add`] of [`lightness`], with (f·scale)^⅓ as f^⅓·scale^⅓: one root for both sides.
#[inline(always)]
fn add_lightness(terms: &mut Terms, f: &Lanes, sides: &[Side], c: usize) {
    let (mut root, mut inverse) = ([0.0; LANES], [0.0; LANES]);
    for l in 0..LANES {
        let above = if f[l] > f64::MIN_POSITIVE { f[l] } else { f64::MIN_POSITIVE };
        root[l] = cube_root(above);
        inverse[l] = 1.0 / (3.0 * above);
    }
    for side in sides {
        for l in 0..LANES {
            let x = f[l] * side.scale[l];
            let above = root[l] * side.scale_root[l];
            let (toe, toe_slope) = toe(x);
            let (value, slope) = if x > TOE {
                (above, above * inverse[l])
            } else {
                (toe, toe_slope * side.scale[l])
            };
            terms.add(l, side.weight[l], value - side.goal[c][l], slope);
        }
    }
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
