//! Directions in the shading frame, where the surface normal is +z, and the angles of a pair.

use glam::DVec3;

/// The angles of a pair of directions that a microfacet model depends on.
///
/// h is the half vector and θd the angle between it and either direction (Rusinkiewicz 1998).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles {
    /// tan²θh; infinite where h lies in the surface.
    pub tan2_h: f64,
    /// cosθd = wi·h = |wi + wo|/2.
    pub cos_d: f64,
    /// cosθi, cosθo.
    pub cos: [f64; 2],
    /// cotθi, cotθo; infinite along the normal.
    pub cot: [f64; 2],
}

impl Angles {
    /// The angles of two unit directions; `None` where either is at or below the horizon.
    #[must_use]
    pub fn of(wi: DVec3, wo: DVec3) -> Option<Self> {
        (above_horizon(wi) && above_horizon(wo)).then(|| {
            let half_sum = wi + wo;
            Self {
                tan2_h: tan2_theta(half_sum),
                // Symmetric in wi and wo to the last bit, which keeps reciprocity exact.
                cos_d: (0.5 * half_sum.length()).min(1.0),
                cos: [wi, wo].map(cos_theta),
                cot: [wi, wo].map(cot_theta),
            }
        })
    }
}

/// |cosφd| = |cosθi − cosθo|/(sinθh |wi − wo|) of a pair of unit directions, in [0, 1].
///
/// 0 where θh or θd is 0 and every φd describes the same pair.
#[must_use]
pub fn abs_cos_phi_d(wi: DVec3, wo: DVec3) -> f64 {
    let tan2_h = tan2_theta(wi + wo);
    // 2 sinθd = |wi − wo|, without the cancellation of 1 − cos²θd.
    // (wi − wo) is perpendicular to h, so its z is 2 sinθd · sinθh · cosφd up to the sign.
    let swing = (tan2_h / (1.0 + tan2_h)).sqrt() * (wi - wo).length();
    if swing > 0.0 { ((wi.z - wo.z).abs() / swing).min(1.0) } else { 0.0 }
}

/// Returns true if light can arrive from or leave in direction `w`.
///
/// Excludes the horizon itself, where cosθ is 0 or denormal, and anything but a unit vector: a NaN,
/// or a squared length that differs from 1 by more than a hundredth.
#[inline]
#[must_use]
pub fn above_horizon(w: DVec3) -> bool {
    // The reciprocal of a denormal cosθ may overflow. A NaN fails both comparisons.
    w.z >= f64::MIN_POSITIVE && (w.length_squared() - 1.0).abs() <= 1e-2
}

/// cosθ of a unit direction: its z component.
#[inline]
#[must_use]
pub fn cos_theta(w: DVec3) -> f64 {
    w.z
}

/// sinθ ≥ 0 of a unit direction, from x and y so that it stays accurate at normal incidence.
#[must_use]
pub fn sin_theta(w: DVec3) -> f64 {
    w.x.hypot(w.y)
}

/// cotθ = cosθ/sinθ; infinite at normal incidence.
#[must_use]
pub fn cot_theta(w: DVec3) -> f64 {
    cos_theta(w) / sin_theta(w)
}

/// cotθ = cosθ/√((1 − cosθ)(1 + cosθ)) of cosθ alone; infinite at 1.
#[inline]
#[must_use]
pub fn cot_of_cos(cos_theta: f64) -> f64 {
    cos_theta / ((1.0 - cos_theta) * (1.0 + cos_theta)).sqrt()
}

/// tan²θ of a direction of any length (the length cancels); infinite at grazing.
///
/// From the components: 1 − cos²θ would lose all digits of a sharp lobe's argument.
#[inline]
#[must_use]
pub fn tan2_theta(w: DVec3) -> f64 {
    // Divided before they are squared: w.z² is 0 in f64 from cosθ = 1e-162 on.
    let slope_x = w.x / w.z;
    let slope_y = w.y / w.z;
    slope_x * slope_x + slope_y * slope_y
}

/// The unit direction at polar angle `theta` and azimuth `phi` \[rad\].
///
/// # Example
///
/// ```
/// use sgdbake::{DVec3, spherical};
///
/// let wi = spherical(30_f64.to_radians(), 0.0);
/// assert!((wi - DVec3::new(0.5, 0.0, 0.75_f64.sqrt())).length() < 1e-15);
/// ```
#[must_use]
pub fn spherical(theta: f64, phi: f64) -> DVec3 {
    let (sin_theta, cos_theta) = theta.sin_cos();
    from_cos_sin(cos_theta, sin_theta, phi)
}

/// The unit direction with the given cosθ and sinθ and azimuth `phi` \[rad\].
#[must_use]
pub fn from_cos_sin(cos_theta: f64, sin_theta: f64, phi: f64) -> DVec3 {
    let (sin_phi, cos_phi) = phi.sin_cos();
    DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
}

/// sinθ of a cotangent, 1/√(1 + cot²θ).
#[must_use]
pub fn sin_of_cot(cot: f64) -> f64 {
    // cot² would overflow near the normal.
    1.0 / cot.hypot(1.0)
}

/// The direction with the given cotθ and azimuth 0, exact however near to grazing.
#[must_use]
pub fn at_cot(cot: f64) -> DVec3 {
    let sin = sin_of_cot(cot);
    from_cos_sin(cot * sin, sin, 0.0)
}

/// `(cosθ, sinθ)` of an angle in degrees, exact at 0 and 90 and accurate near them.
#[must_use]
pub fn cos_sin_degrees(theta: f64) -> (f64, f64) {
    // The cosine of π/2 as rounded is 6e-17, not 0; the sine of the complement is exact.
    ((90.0 - theta).to_radians().sin(), theta.to_radians().sin())
}

/// The unit vector along `v`; `None` for a zero or non-finite vector.
///
/// Scaled by the largest component first, so that neither 1e-300 nor 1e300 is lost on the way.
#[must_use]
pub fn normalised(v: DVec3) -> Option<DVec3> {
    let largest = v.abs().max_element();
    (v.is_finite() && largest > 0.0).then(|| {
        // A denormal's reciprocal overflows; dividing does not.
        (v / largest).normalize()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phi_d_of_the_mirror_pair_and_of_the_plane_of_incidence() {
        let (wi, wo) = (spherical(0.4, 0.0), spherical(0.4, std::f64::consts::PI));
        assert_eq!(abs_cos_phi_d(wi, wo), 0.0, "θh = 0 has no φd");
        assert!((abs_cos_phi_d(spherical(0.9, 0.0), wi) - 1.0).abs() < 1e-12);
        let apart = 1e-9;
        let near = abs_cos_phi_d(spherical(0.4 + apart, 0.0), spherical(0.4, 0.0));
        assert!((near - 1.0).abs() < 1e-6, "small θd does not cancel: {near}");
    }

    #[test]
    fn degrees_are_exact_at_both_ends() {
        assert_eq!(cos_sin_degrees(0.0), (1.0, 0.0));
        assert_eq!(cos_sin_degrees(90.0), (0.0, 1.0));
    }

    #[test]
    fn extreme_lengths_normalise() {
        for scale in [1e-320, 1e-300, 1.0, 1e300] {
            let w = normalised(DVec3::new(0.0, scale, scale)).expect("finite and not zero");
            assert!((w.length() - 1.0).abs() < 1e-15);
        }
        assert_eq!(normalised(DVec3::ZERO), None);
        assert_eq!(normalised(DVec3::new(f64::NAN, 0.0, 1.0)), None);
        assert_eq!(normalised(DVec3::new(f64::INFINITY, 0.0, 1.0)), None);
    }
}
