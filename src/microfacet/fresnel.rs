//! The Fresnel factor of the SGD model.

use serde::{Deserialize, Serialize};

/// F(cosθd) = f0 + (f90−f0)(1−cosθd)⁵ − f1·cosθd; of SGD, f90 = 1 (Bagher et al. 2012, equation 9).
///
/// A fitted curve, not a physical law: it leaves [0, 1] for some published channels (below 0 in
/// 7, above 1 in 10), and is evaluated as published, never clamped.
///
/// # Example
///
/// ```
/// use sgdbake::Fresnel;
///
/// let glass = Fresnel { f0: 0.04, f90: 1.0, f1: 0.0 };
/// assert_eq!(glass.eval(1.0), 0.04);
/// assert_eq!(glass.range(), [0.04, 1.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fresnel {
    /// The value that Schlick's term starts from.
    pub f0: f64,
    /// The value that Schlick's term ends at: F(90°).
    pub f90: f64,
    /// The coefficient of the linear term; F(0°) = f0 − f1.
    pub f1: f64,
}

impl Fresnel {
    /// The curve of SGD, which reflects everything at 90°.
    #[must_use]
    pub fn sgd(f0: f64, f1: f64) -> Self {
        Self { f0, f90: 1.0, f1 }
    }

    /// F at cosθd = wi·h.
    #[inline]
    #[must_use]
    pub fn eval(&self, cos_theta_d: f64) -> f64 {
        self.f0 + (self.f90 - self.f0) * (1.0 - cos_theta_d).powi(5) - self.f1 * cos_theta_d
    }

    /// The least and the largest F over cosθd in [0, 1].
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        self.range_over([0.0, 1.0])
    }

    /// The least and the largest F over an interval of cosθd.
    ///
    /// At the ends, or where dF/dcosθd = 0: (1−cosθd)⁴ = −f1/(5 (f90−f0)).
    #[must_use]
    pub fn range_over(&self, [from, to]: [f64; 2]) -> [f64; 2] {
        // Without a turning point the power is negative, infinite or NaN (f90 = f0), and `turn` is
        // a NaN or −∞, which lies in no interval.
        let power = -self.f1 / (5.0 * (self.f90 - self.f0));
        let turn = 1.0 - power.sqrt().sqrt();
        let turn = (from..=to).contains(&turn).then(|| self.eval(turn));
        let ends = [self.eval(from), self.eval(to)].into_iter().chain(turn);
        ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], f| [low.min(f), high.max(f)])
    }

    /// The largest |F| over cosθd in [0, 1].
    #[must_use]
    pub fn max_magnitude(&self) -> f64 {
        let [least, largest] = self.range();
        largest.max(-least)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_holds_every_value_and_is_reached() {
        let curves =
            [(0.24, 0.18), (9e-12, -0.61), (-0.274, 0.0), (5.0, 3.9), (0.5, -0.1), (1.0, 0.3)];
        for fresnel in curves.map(|(f0, f1)| Fresnel::sgd(f0, f1)) {
            let [least, largest] = fresnel.range();
            let values = (0..=10_000).map(|i| fresnel.eval(f64::from(i) * 1e-4));
            let [low, high] =
                values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], f| [l.min(f), h.max(f)]);
            assert!(least <= low && low - least < 1e-6, "{fresnel:?}: {least} {low}");
            assert!(largest >= high && largest - high < 1e-6, "{fresnel:?}: {largest} {high}");
        }
    }
}
