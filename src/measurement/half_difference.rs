//! Half and difference angles of a pair of directions (Rusinkiewicz 1998).

use std::f64::consts::TAU;

use glam::DVec3;

use crate::math::direction::spherical;

/// The angles that an isotropic reflectance depends on \[rad\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfDifference {
    /// Angle between the normal and h, in \[0, π/2\].
    pub theta_h: f64,
    /// Angle between wi and h, in \[0, π/2\].
    pub theta_d: f64,
    /// Azimuth of wi about h, from the plane of the normal and h, in \[0, 2π).
    ///
    /// φd + π swaps wi and wo; −φd mirrors the pair in that plane.
    pub phi_d: f64,
}

impl HalfDifference {
    /// The angles of unit `wi`, `wo`.
    #[must_use]
    pub fn of(wi: DVec3, wo: DVec3) -> Self {
        let h = wi + wo;
        let across = h.x.hypot(h.y);
        let theta_h = across.atan2(h.z);
        // At θh = 0 every azimuth is the same pair; 0 is as good as any.
        let phi_h = if across > 0.0 { h.y.atan2(h.x) } else { 0.0 };
        let difference = wi - wo;
        // wi − wo is perpendicular to h, so that its components along t and b give φd.
        let [_, t, b] = frame(theta_h, phi_h);
        Self {
            theta_h,
            // |wi − wo| = 2 sinθd, |wi + wo| = 2 cosθd: accurate at 0, where acos(wi·h) is not.
            theta_d: difference.length().atan2(h.length()),
            phi_d: difference.dot(b).atan2(difference.dot(t)).rem_euclid(TAU),
        }
    }

    /// A pair `[wi, wo]` with these angles, h in the half plane φ = 0.
    ///
    /// wi, wo = cosθd h ± sinθd (cosφd t + sinφd b)
    #[must_use]
    pub fn directions(self) -> [DVec3; 2] {
        let [h, t, b] = frame(self.theta_h, 0.0);
        let (sin_d, cos_d) = self.theta_d.sin_cos();
        let (sin_phi, cos_phi) = self.phi_d.sin_cos();
        let aside = sin_d * (cos_phi * t + sin_phi * b);
        [cos_d * h + aside, cos_d * h - aside]
    }
}

/// h, and the tangents towards growing θh and growing φh.
fn frame(theta_h: f64, phi_h: f64) -> [DVec3; 3] {
    let (sin_phi, cos_phi) = phi_h.sin_cos();
    let (sin_theta, cos_theta) = theta_h.sin_cos();
    let t = DVec3::new(cos_theta * cos_phi, cos_theta * sin_phi, -sin_theta);
    [spherical(theta_h, phi_h), t, DVec3::new(-sin_phi, cos_phi, 0.0)]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn angles_and_directions_are_inverse() {
        for (theta_h, theta_d, phi_d) in [(0.1, 0.2, 0.3), (1.2, 0.4, 2.0), (1e-5, 1.0, 6.0)] {
            let angles = HalfDifference { theta_h, theta_d, phi_d };
            let [wi, wo] = angles.directions();
            let again = HalfDifference::of(wi, wo);
            assert!((again.theta_h - theta_h).abs() < 1e-14);
            assert!((again.theta_d - theta_d).abs() < 1e-14);
            assert!((again.phi_d - phi_d).abs() < 1e-9);
            let swapped = HalfDifference::of(wo, wi);
            assert!((swapped.phi_d - (phi_d + PI).rem_euclid(TAU)).abs() < 1e-9);
        }
    }

    #[test]
    fn normal_and_mirrored_pairs_have_finite_angles() {
        let up = DVec3::Z;
        assert_eq!(HalfDifference::of(up, up).theta_d, 0.0);
        let [wi, wo] = [spherical(0.5, 0.0), spherical(0.5, PI)];
        let angles = HalfDifference::of(wi, wo);
        assert!(angles.theta_h < 1e-15 && (angles.theta_d - 0.5).abs() < 1e-15);
        assert!(angles.phi_d.is_finite());
    }
}
