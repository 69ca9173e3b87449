//! Directions in the shading frame, where the surface normal is +z.

use glam::DVec3;

/// cosθ of a unit direction: its z component.
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

/// tan²θ of a direction of any length (the length cancels); infinite at grazing.
///
/// From the components: 1 − cos²θ would lose all digits of a sharp lobe's argument.
#[must_use]
pub fn tan2_theta(w: DVec3) -> f64 {
    let slope_x = w.x / w.z;
    let slope_y = w.y / w.z;
    slope_x * slope_x + slope_y * slope_y
}

/// The unit direction at polar angle `theta` and azimuth `phi` \[rad\].
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

/// `(cosθ, sinθ)` of an angle in degrees, exact at 0 and 90 and accurate beside them.
#[must_use]
pub fn cos_sin_degrees(theta: f64) -> (f64, f64) {
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

/// wi + wo, the half vector before it is normalised; its length is 2 cosθd.
///
/// Symmetric in its arguments to the last bit, which is what keeps reciprocity exact.
#[must_use]
pub fn half_sum(wi: DVec3, wo: DVec3) -> DVec3 {
    wi + wo
}

#[cfg(test)]
mod tests {
    use super::*;

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
