//! A distribution of microfacet normals with everything that follows from it.

use glam::DVec3;

/// cotθ that stands for the limit at grazing.
const GRAZING: f64 = 1e-12;

/// An isotropic distribution of normals, against tan²θh and cotθ.
///
/// D is normalised to ∫ D cosθ dω = 1. It is written through the slope density D·cos⁴θ, with
/// cos⁻⁴θ = (1 + tan²θ)²: from tan²θ nothing cancels however sharp the lobe.
///
/// # Example
///
/// ```
/// use sgdbake::{Beckmann, Distribution, Ggx};
///
/// /// How much of a facet's area is seen at 45°.
/// fn seen(distribution: &dyn Distribution) -> f64 {
///     distribution.g1(1.0)
/// }
/// assert!(seen(&Beckmann { alpha: 0.1 }) > seen(&Ggx { alpha: 0.8 }));
/// ```
pub trait Distribution: Sync {
    /// D·cos⁴θ at tan²θ \[1/sr\].
    fn slope_density(&self, tan2_theta: f64) -> f64;

    /// Smith's Λ at cotθ ≥ 0; infinite at grazing.
    fn lambda(&self, cot_theta: f64) -> f64;

    /// A normal seen from `wo`, of density D(h) G1(wo) ⟨wo, h⟩/cosθo, from uniform numbers in
    /// [0, 1).
    fn visible_normal(&self, wo: DVec3, u: [f64; 3]) -> DVec3;

    /// D at tan²θ \[1/sr\].
    fn ndf(&self, tan2_theta: f64) -> f64 {
        from_slope_density(self.slope_density(tan2_theta), tan2_theta)
    }

    /// Smith's masking G1 = 1/(1 + Λ) at cotθ, in [0, 1].
    fn g1(&self, cot_theta: f64) -> f64 {
        1.0 / (1.0 + self.lambda(cot_theta))
    }

    /// The density of the direction that `wo` is reflected to by a visible normal \[1/sr\]:
    /// D(h) G1(wo)/(4 cosθo).
    fn reflected_pdf(&self, tan2_theta_h: f64, cot_theta_o: f64, cos_theta_o: f64) -> f64 {
        // G1/cosθ first: it stays finite down to the horizon.
        self.ndf(tan2_theta_h) * (0.25 * (self.g1(cot_theta_o) / cos_theta_o))
    }
}

/// lim cotθ/G1 at grazing, of any masking.
#[must_use]
pub fn grazing_limit(g1: impl Fn(f64) -> f64) -> f64 {
    // cosθ and cotθ are equal to rounding there, so this is lim cosθ/G1 as well.
    GRAZING / g1(GRAZING)
}

/// D = slope density · (1+x)², 0 where the density has underflowed whatever cos⁻⁴θ is.
#[must_use]
pub fn from_slope_density(slope_density: f64, tan2_theta: f64) -> f64 {
    // At x = ∞ the product would be 0·∞.
    if slope_density == 0.0 {
        return 0.0;
    }
    let inv_cos2 = 1.0 + tan2_theta;
    slope_density * inv_cos2 * inv_cos2
}
