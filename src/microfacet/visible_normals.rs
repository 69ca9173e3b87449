//! Normals of a rough surface as they are seen from a direction: density D(h) G1(wo) ⟨wo, h⟩/cosθo.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

/// A visible normal of a Beckmann surface of width `alpha`, from two uniform numbers in [0, 1).
///
/// # Formula
///
/// Slopes seen from the direction stretched to width 1, with t = tanθ of that direction and the
/// x axis towards it, are independent: s_y of density e^{−s²}/√π, and s_x of density
/// ∝ (1 − t s) e^{−s²} for s < 1/t (Heitz 2014, section 5.3), each drawn by inverting its
/// distribution function.
#[must_use]
pub fn beckmann(wo: DVec3, alpha: f64, [u, v]: [f64; 2]) -> DVec3 {
    /// Beyond, the density no longer changes in f64.
    const LARGEST_TAN: f64 = 1e12;
    let across = DVec2::new(wo.x, wo.y);
    let tan_theta = (alpha * across.length() / wo.z).min(LARGEST_TAN);
    let towards = across.try_normalize().unwrap_or(DVec2::X);
    let along = visible_slope(tan_theta, u);
    let beside = visible_slope(0.0, v);
    let slope = alpha * (along * towards + beside * towards.perp());
    DVec3::new(-slope.x, -slope.y, 1.0).normalize()
}

/// A visible normal of a GGX surface of width `alpha`, from two uniform numbers in [0, 1).
///
/// A point of the spherical cap that the stretched `wo` sees, halved with it (Heitz 2018, in the
/// form of Dupuy and Benyoub 2023).
#[must_use]
pub fn ggx(wo: DVec3, alpha: f64, [u, v]: [f64; 2]) -> DVec3 {
    let stretched = DVec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize();
    let z = (1.0 - v) * (1.0 + stretched.z) - stretched.z;
    let sin_theta = (1.0 - z * z).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (TAU * u).sin_cos();
    let h = DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, z) + stretched;
    DVec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize()
}

/// The s < 1/t at which the density ∝ (1 − t s) e^{−s²} has accumulated to the share `u`.
///
/// Newton's method on F(s) = ½ erfc(−s) + t e^{−s²}/(2√π), kept inside a shrinking bracket.
fn visible_slope(tan_theta: f64, u: f64) -> f64 {
    const FARTHEST: f64 = 6.5;
    let cumulative = |s: f64| 0.5 * libm::erfc(-s) + 0.5 * tan_theta * (-s * s).exp() / PI.sqrt();
    let density = |s: f64| (1.0 - tan_theta * s) * (-s * s).exp() / PI.sqrt();
    let (mut low, mut high) = (-FARTHEST, (1.0 / tan_theta).min(FARTHEST));
    let target = u * cumulative(high);
    let mut s = (low + high).clamp(-1.0, 0.0);
    for _ in 0..60 {
        let excess = cumulative(s) - target;
        if excess > 0.0 {
            high = s;
        } else {
            low = s;
        }
        let newton = s - excess / density(s);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - s).abs() < 1e-12 {
            return next;
        }
        s = next;
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_invert_their_distribution_function() {
        for tan_theta in [0.0, 1e-3, 0.5, 1.0, 30.0, 1e12] {
            let end = (1.0_f64 / tan_theta).min(6.5);
            let cumulative =
                |s: f64| 0.5 * libm::erfc(-s) + 0.5 * tan_theta * (-s * s).exp() / PI.sqrt();
            for u in [0.0, 1e-12, 1e-3, 0.3, 0.5, 0.9, 1.0 - 1e-9] {
                let s = visible_slope(tan_theta, u);
                let share = cumulative(s) / cumulative(end);
                assert!(s <= end && (share - u).abs() < 1e-11, "{tan_theta} {u}: {s} {share}");
            }
        }
    }
}
