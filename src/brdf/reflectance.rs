//! Traits of reflectances: values, and directions drawn with their density.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::brdf::Brdf;
use crate::brdf::batch::{Pairs, RgbMut, SgdBatch};
use crate::math::direction::from_cos_sin;
use crate::microfacet::Distribution;

/// A reflectance of three colours over the upper hemisphere: SGD itself, a best fit to it, a
/// lookup texture of it, or a measurement.
///
/// `wi`, `wo` are unit; below the horizon f is 0.
///
/// # Example
///
/// ```
/// use sgdbake::{DVec3, Reflectance, spherical};
///
/// /// The same in all directions.
/// struct Matte([f64; 3]);
///
/// impl Reflectance for Matte {
///     fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
///         let above = wi.z > 0.0 && wo.z > 0.0;
///         self.0.map(|albedo| if above { albedo * std::f64::consts::FRAC_1_PI } else { 0.0 })
///     }
/// }
///
/// let mut f = [[0.0; 3]];
/// Matte([0.5; 3]).eval_all(&[[spherical(0.1, 0.0), spherical(0.2, 0.0)]], &mut f);
/// assert!((f[0][0] - 0.159).abs() < 1e-3);
/// ```
pub trait Reflectance: Sync {
    /// f(wi, wo) \[1/sr\] per colour; NaN where a measurement has no value.
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3];

    /// f of every pair `[wi, wo]` into the slot of the same index.
    fn eval_all(&self, pairs: &[[DVec3; 2]], f: &mut [[f64; 3]]) {
        for (slot, [wi, wo]) in f.iter_mut().zip(pairs) {
            *slot = self.eval(*wi, *wo);
        }
    }
}

/// A reflectance that draws directions in proportion to what it reflects.
///
/// # Example
///
/// ```
/// use sgdbake::{MaskingKind, Sample, Sampler, Strategy, named, spherical};
///
/// let sampler = Sampler::new(named("gold-paint")?, MaskingKind::Exact, Strategy::Vndf);
/// let wo = spherical(0.8, 0.0);
/// if let Some(wi) = Sample::sample(&sampler, wo, [0.1, 0.5, 0.7]) {
///     assert!(Sample::pdf(&sampler, wi, wo) > 0.0);
/// }
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
pub trait Sample: Reflectance {
    /// A direction to the light for `wo`, from three uniform numbers in [0, 1); `None` where the
    /// draw falls below the horizon.
    fn sample(&self, wo: DVec3, u: [f64; 3]) -> Option<DVec3>;

    /// The density of [`Self::sample`] at `wi` \[1/sr\]; 0 exactly where it never draws.
    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64;
}

/// A direction of density cosθ/π: the unit disc by polar coordinates, lifted to the hemisphere
/// (Malley's method).
#[must_use]
pub fn cosine_sample(u: [f64; 2]) -> DVec3 {
    // u < 1 keeps cosθ above 0.
    from_cos_sin((1.0 - u[0]).sqrt(), u[0].sqrt(), TAU * u[1])
}

impl<D: Distribution> Reflectance for Brdf<D> {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        Self::eval(self, wi, wo)
    }
}

impl Reflectance for SgdBatch {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.terms(wi.as_vec3(), wo.as_vec3()).brdf
    }

    fn eval_all(&self, pairs: &[[DVec3; 2]], f: &mut [[f64; 3]]) {
        // The batch takes a column for each component.
        let [wi, wo] = [0, 1].map(|side| {
            [0, 1, 2].map(|axis| pairs.iter().map(|pair| pair[side][axis] as f32).collect())
        });
        let (wi, wo): ([Vec<f32>; 3], [Vec<f32>; 3]) = (wi, wo);
        let mut rgb = [(); 3].map(|()| vec![0.0_f32; pairs.len()]);
        let [r, g, b] = &mut rgb;
        let pairs =
            Pairs { wi: wi.each_ref().map(Vec::as_slice), wo: wo.each_ref().map(Vec::as_slice) };
        Self::eval(self, &pairs, &mut RgbMut([r, g, b])).expect("all columns have one length");
        for (i, slot) in f.iter_mut().enumerate() {
            *slot = rgb.each_ref().map(|channel| f64::from(channel[i]));
        }
    }
}
