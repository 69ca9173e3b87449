//! Directional albedo by deterministic quadrature.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::LazyLock;

use crate::brdf::{Lobe, SgdBrdf};
use crate::math::quadrature::{Node, gauss_legendre};
use crate::microfacet::{Distribution as _, Fresnel, Sgd};

/// Integrals over wi of the specular term without its Fresnel factor and scale, each times one of
/// the three functions of θd that F is made of.
///
/// # Formula
///
/// ```text
/// moment = ∫ φ(cosθd) · D(h) G1(wi) G1(wo)/(4 cosθi cosθo) · cosθi dωi
/// φ = 1, (1 − cosθd)^5, cosθd
/// ```
///
/// With the usual ¼, so that `one` is the albedo of a surface that reflects all light once: at
/// most 1. The model's own specular scale is 4ρs/π.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FresnelMoments {
    /// φ = 1.
    pub one: f64,
    /// φ = (1 − cosθd)⁵.
    pub schlick: f64,
    /// φ = cosθd.
    pub cosine: f64,
}

impl FresnelMoments {
    /// The moments at cosθo in (0, 1], to about six digits; 0 at and below the horizon.
    #[must_use]
    pub fn new(lobe: &Lobe<Sgd>, cos_theta_o: f64) -> Self {
        static RULES: LazyLock<(Vec<Node>, Vec<f64>)> =
            LazyLock::new(|| (gauss_legendre(RADIAL_NODES), azimuths(AZIMUTH_NODES)));
        let (radial, azimuth) = &*RULES;
        Self::with_rules(lobe, cos_theta_o, radial, azimuth)
    }

    /// The integral over half vectors of slope tanθh = a and azimuth φ from wo.
    ///
    /// dωi = 4 (wo·h) dωh and D cosθh dωh = ½ P22(x)/π dx dφ, x = a². The radial variable
    /// v = ln(1 + x/α²) is the one in which P22 is smooth on every scale. wi is above the horizon
    /// for cosφ > cotθo (a²−1)/(2a): all of the circle up to a = tan(½(π/2−θo)), none of it from
    /// a = tan(½(π/2+θo)).
    fn with_rules(lobe: &Lobe<Sgd>, cos_theta_o: f64, radial: &[Node], azimuth: &[f64]) -> Self {
        if cos_theta_o.is_nan() || cos_theta_o < f64::MIN_POSITIVE {
            return Self::default();
        }
        let view = View::new(lobe, cos_theta_o.min(1.0));
        let alpha = lobe.distribution.alpha();
        let alpha2 = alpha * alpha;
        let [whole, none] = view.radial_ends(alpha, LARGEST_DECAY);
        let mut sum = Self::default();
        // Apart, as the integrand has a kink where the horizon starts to cut the rings. At normal
        // incidence, or where D has decayed before, the second part is empty.
        for (low, high) in [(0.0, whole), (whole, none)].into_iter().filter(|(a, b)| a < b) {
            for node in radial {
                let v = low + (high - low) * node.x;
                let tan2 = alpha2 * v.exp_m1();
                let dx = alpha2 * v.exp() * (high - low) * node.weight;
                let ring = view.ring(lobe, tan2.sqrt(), azimuth);
                sum = sum.plus(lobe.distribution.slope_density(tan2) * dx, ring);
            }
        }
        sum
    }

    fn plus(self, weight: f64, other: Self) -> Self {
        Self {
            one: self.one + weight * other.one,
            schlick: self.schlick + weight * other.schlick,
            cosine: self.cosine + weight * other.cosine,
        }
    }

    /// The moment of F itself: F = f0 + (f90 − f0)(1 − cosθd)⁵ − f1 cosθd.
    #[must_use]
    pub fn with_fresnel(&self, fresnel: &Fresnel) -> f64 {
        let Fresnel { f0, f90, f1 } = *fresnel;
        f0 * self.one + (f90 - f0) * self.schlick - f1 * self.cosine
    }
}

/// Rings of half vectors in each of the two parts.
const RADIAL_NODES: usize = 48;
/// Half vectors of a ring.
const AZIMUTH_NODES: usize = 48;

/// x/α beyond which e^{−x/α}, 4e-18, no longer counts.
const LARGEST_DECAY: f64 = 40.0;

/// cos²ψ of the nodes of the midpoint rule over ψ in [0, π/2].
pub(super) fn azimuths(nodes: usize) -> Vec<f64> {
    (0..nodes).map(|k| (FRAC_PI_2 * (k as f64 + 0.5) / nodes as f64).cos().powi(2)).collect()
}

/// The fixed direction of the integral, in the plane φ = 0.
pub(super) struct View {
    pub(super) cos: f64,
    pub(super) sin: f64,
    /// G1(wo)/cosθo.
    pub(super) v: f64,
}

impl View {
    pub(super) fn new(lobe: &Lobe<Sgd>, cos: f64) -> Self {
        let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
        Self { cos, sin, v: lobe.g1(cos / sin) / cos }
    }

    /// v = ln(1 + a²/α²) up to which all of a circle of half vectors is lit, and from which none
    /// of it is: at a = tan(½(π/2−θo)) and tan(½(π/2+θo)), or where D has decayed.
    pub(super) fn radial_ends(&self, alpha: f64, largest_decay: f64) -> [f64; 2] {
        let largest = largest_decay * alpha;
        // tan(½(π/2 − θ)) = cosθ/(1 + sinθ), and the tangent of the complement is its reciprocal.
        let whole = self.cos / (1.0 + self.sin);
        [whole, whole.recip()].map(|slope| ((slope * slope).min(largest) / (alpha * alpha)).ln_1p())
    }

    /// The integral over azimuths of the half vectors with tanθh = a.
    ///
    /// With cosφ = 1 − 2q sin²ψ, q the lit share of the circle's diameter,
    ///
    /// ```text
    /// cosθi (1+a²) = b + 4a sinθo q cos²ψ,      b = max(cosθo (1−a²) − 2a sinθo, 0)
    /// dφ = 2 √(q cos²ψ / (1 − q + q cos²ψ)) dψ,   cosθd = ½ √(1+a²) (cosθi + cosθo)
    /// ```
    ///
    /// all even about both ends of ψ in [0, π/2], where the midpoint rule converges as it does on a
    /// circle, and without cancellation towards the horizon.
    fn ring(&self, lobe: &Lobe<Sgd>, slope: f64, azimuth: &[f64]) -> FresnelMoments {
        let length2 = 1.0 + slope * slope;
        let length = length2.sqrt();
        let diameter = 4.0 * slope * self.sin;
        // cosθi (1+a²) at φ = π; where it is below 0 the horizon cuts the ring at the share q.
        let lowest = self.cos * (1.0 - slope * slope) - 0.5 * diameter;
        let (base, lit) = if lowest < 0.0 { (0.0, 1.0 + lowest / diameter) } else { (lowest, 1.0) };
        let sum = azimuth.iter().fold(FresnelMoments::default(), |sum, cos2_psi| {
            let cos_i = ((base + diameter * lit * cos2_psi) / length2).min(1.0);
            let sin_i = ((1.0 - cos_i) * (1.0 + cos_i)).sqrt();
            let above = lit * cos2_psi;
            let d_phi = (above / (1.0 - lit + above)).sqrt();
            let cos_d = (0.5 * length * (cos_i + self.cos)).min(1.0);
            let schlick = (1.0 - cos_d).powi(5);
            // dωi = 4 (wo·h) dωh: the 4 takes the usual ¼ away, and wo·h = cosθd is left.
            let weight = d_phi * lobe.g1(cos_i / sin_i) * cos_d;
            sum.plus(weight, FresnelMoments { one: 1.0, schlick, cosine: cos_d })
        });
        // D dωh = slope density · √(1+a²) · ½ dx dφ. Both halves of the circle, the 2 of dφ and the
        // step ½π/n of ψ make it π/n.
        FresnelMoments::default().plus(PI / azimuth.len() as f64 * self.v * length, sum)
    }
}

/// ∫ f cosθi dωi of a lobe, per colour.
#[must_use]
pub fn specular_albedo(lobe: &Lobe<Sgd>, cos_theta_o: f64) -> [f64; 3] {
    let moments = FresnelMoments::new(lobe, cos_theta_o);
    // The moments have the usual ¼, the model ρs/π.
    std::array::from_fn(|c| 4.0 * lobe.rho_s[c] / PI * moments.with_fresnel(&lobe.fresnel[c]))
}

/// Directional albedo ∫ f(wi, wo) cosθi dωi per colour, at cosθo in (0, 1]; 0 at and below the
/// horizon.
///
/// The published fits do not conserve energy: values above 1 occur and are not clamped.
///
/// # Example
///
/// ```
/// use sgdbake::{MaskingKind, SgdBrdf, directional_albedo, named};
///
/// let brdf = SgdBrdf::new(named("gold-paint")?, MaskingKind::Exact);
/// let [r, g, b] = directional_albedo(&brdf, 0.8);
/// assert!(r > g && g > b && r < 1.0);
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
#[must_use]
pub fn directional_albedo(brdf: &SgdBrdf, cos_theta_o: f64) -> [f64; 3] {
    if cos_theta_o.is_nan() || cos_theta_o < f64::MIN_POSITIVE {
        return [0.0; 3];
    }
    let lobes = brdf.lobes.iter().map(|lobe| specular_albedo(lobe, cos_theta_o));
    lobes.fold(brdf.rho_d, |sum, lobe| std::array::from_fn(|c| sum[c] + lobe[c]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::MaskingKind;
    use crate::material::{catalog, find};
    use crate::microfacet::Accuracy;

    #[test]
    fn gold_paint_green_reflects_what_independent_quadrature_gave() {
        let material = &find("gold-paint").expect("catalogue").material;
        let brdf = SgdBrdf::new(material, MaskingKind::Fitted);
        for (degrees, expected) in [(0.0_f64, 0.0890), (80.0, 0.0760)] {
            let [_, albedo, _] = specular_albedo(&brdf.lobes[1], degrees.to_radians().cos());
            assert!((albedo - expected).abs() < 6e-5, "{degrees}: {albedo}");
        }
    }

    #[test]
    fn more_nodes_change_nothing() {
        let (radial, azimuth) = (gauss_legendre(160), azimuths(240));
        let mut worst: f64 = 0.0;
        for entry in catalog().iter().step_by(9) {
            let params = &entry.material.lobes()[1];
            let lobe = Lobe::new(params, MaskingKind::Exact, Accuracy::Picture);
            for cos in [1.0, 0.7, 0.17, 0.0175, 1e-4] {
                let usual = FresnelMoments::new(&lobe, cos);
                let fine = FresnelMoments::with_rules(&lobe, cos, &radial, &azimuth);
                let error = (usual.one / fine.one - 1.0).abs();
                worst = worst.max(error);
                assert!(fine.one <= 1.0 + 1e-9, "one scattering returns at most everything");
            }
        }
        assert!(worst < 1e-6, "{worst:e}");
    }
}
