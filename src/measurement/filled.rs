//! A reflectance without gaps, for pictures and for formats that cannot hold them.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use crate::brdf::Reflectance;
use crate::measurement::half_difference::HalfDifference;

/// Steps from a pair that was not measured towards the normal.
const STEPS: usize = 32;

/// A reflectance whose pairs without a measurement (NaN) take the value of a nearby one: that of
/// the largest smaller θd at their θh and φd; if there is none, that of the largest smaller θh,
/// with θd lowered to at most 45°; else 0.
///
/// # Example
///
/// ```
/// use sgdbake::{DVec3, Filled, Reflectance, spherical};
///
/// /// A measurement without values near grazing.
/// struct Gap;
///
/// impl Reflectance for Gap {
///     fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
///         if wi.z.min(wo.z) > 0.2 { [0.3; 3] } else { [f64::NAN; 3] }
///     }
/// }
///
/// let (wi, wo) = (spherical(1.5, 0.0), spherical(1.5, 2.0));
/// assert!(Gap.eval(wi, wo)[0].is_nan());
/// assert_eq!(Filled(&Gap).eval(wi, wo), [0.3; 3]);
/// ```
pub struct Filled<'a>(pub &'a dyn Reflectance);

impl Reflectance for Filled<'_> {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let f = self.0.eval(wi, wo);
        if is_measured(&f) { f } else { self.nearby(HalfDifference::of(wi, wo)) }
    }
}

impl Filled<'_> {
    /// The first value measured on the way to smaller θd, then to smaller θh; 0 if there is none.
    fn nearby(&self, angles: HalfDifference) -> [f64; 3] {
        // From the pair inwards. Both ways stay above the horizon, so that no 0 from below it is
        // taken for a measurement.
        let shares = (0..STEPS).rev().map(|step| step as f64 / STEPS as f64);
        let smaller_d =
            shares.clone().map(|s| HalfDifference { theta_d: s * angles.theta_d, ..angles });
        let smaller_h = shares.map(|s| HalfDifference {
            theta_h: s * angles.theta_h,
            theta_d: angles.theta_d.min(0.5 * FRAC_PI_2),
            ..angles
        });
        let values = smaller_d.chain(smaller_h).map(|angles| {
            let [wi, wo] = angles.directions();
            self.0.eval(wi, wo)
        });
        // Lazy: nothing is evaluated beyond the first value found.
        values.into_iter().find(is_measured).unwrap_or_default()
    }
}

fn is_measured(f: &[f64; 3]) -> bool {
    f.iter().all(|f| !f.is_nan())
}
