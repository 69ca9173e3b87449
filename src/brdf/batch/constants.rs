//! A material's constants in f32, and the factors that follow from them at one pair of directions.

use std::f64::consts::{FRAC_1_PI, LOG2_E};

use crate::material::{LobeParams, Material};
use crate::math::arithmetic::{Arithmetic, exp2, log2, max, min};
use crate::microfacet::SgdNdf;

/// tan²θh beyond which D of every lobe that f32 can hold is 0; its square is still finite.
const LARGEST_TAN2: f32 = 1e15;
/// 1/α² at most: its product with [`LARGEST_TAN2`] is finite.
const LARGEST_INV_ALPHA2: f64 = 1e22;

/// A material's constants besides its masking, saturated to the range of f32.
#[derive(Clone, Debug, PartialEq)]
pub struct Constants {
    /// ρd/π per colour.
    pub diffuse: [f32; 3],
    /// Of each lobe.
    pub lobes: Vec<LobeConstants>,
    /// (ρs/π) F of each lobe and colour where every lobe colours all channels.
    pub full: Option<Vec<[FresnelConstants; 3]>>,
}

/// A lobe's constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeConstants {
    /// D at θ = 0.
    pub peak: f32,
    /// log₂e/α.
    pub decay: f32,
    /// 1/α².
    pub inv_alpha2: f32,
    /// p.
    pub p: f32,
    /// Of each colour.
    pub colours: [ColourConstants; 3],
}

/// The constants of one colour of a lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourConstants {
    /// Of F.
    pub fresnel: FresnelConstants,
    /// Of (ρs/π) F; `None` where the lobe does not colour.
    pub specular: Option<FresnelConstants>,
}

/// The constants of a Fresnel term times a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FresnelConstants {
    /// F(0°) = f0 − f1.
    pub normal: f32,
    /// 1 − f0.
    pub schlick: f32,
    /// f1.
    pub f1: f32,
}

/// The f32 nearest to a value, at most 1e38 in magnitude.
fn single(value: f64) -> f32 {
    value.clamp(-1e38, 1e38) as f32
}

impl Constants {
    /// The constants of a material.
    #[must_use]
    pub fn new(material: &Material) -> Self {
        let lobes: Vec<LobeConstants> = material.lobes().iter().map(LobeConstants::new).collect();
        Self {
            diffuse: material.rho_d().map(|rho_d| single(rho_d * FRAC_1_PI)),
            full: lobes.iter().map(LobeConstants::full).collect(),
            lobes,
        }
    }
}

impl LobeConstants {
    fn new(lobe: &LobeParams) -> Self {
        let (alpha, p) = (lobe.alpha(), lobe.p());
        Self {
            peak: single(SgdNdf::new(alpha, p).peak()),
            decay: single(LOG2_E / alpha),
            inv_alpha2: (1.0 / (alpha * alpha)).min(LARGEST_INV_ALPHA2) as f32,
            p: single(p),
            colours: [0, 1, 2].map(|c| ColourConstants::new(lobe, c)),
        }
    }

    /// D at x = tan²θ: peak · 2^(−x log₂e/α − p log₂(1 + x/α²)) · (1+x)².
    #[inline(always)]
    pub fn ndf<A: Arithmetic>(&self, NormalAt { x, spread }: NormalAt) -> f32 {
        // One exponential for e^{−x/α} and (1 + x/α²)^{−p}. It is 0 below 2^−125, so that far from
        // its peak D is 0 however large (1+x)² is.
        let power = self.p * log2::<A>(A::mul_add(x, self.inv_alpha2, 1.0));
        let density = self.peak * exp2::<A>(A::mul_add(-x, self.decay, -power));
        // An infinite D would be a NaN beside a factor of 0.
        min(density * spread, f32::MAX)
    }

    /// (ρs/π) F of every colour, if the lobe has all.
    fn full(&self) -> Option<[FresnelConstants; 3]> {
        let [r, g, b] = self.colours.each_ref().map(|colour| colour.specular);
        Some([r?, g?, b?])
    }
}

impl ColourConstants {
    fn new(lobe: &LobeParams, c: usize) -> Self {
        let (specular, f0, f1) = (lobe.rho_s()[c] * FRAC_1_PI, lobe.f0()[c], lobe.f1()[c]);
        Self {
            fresnel: FresnelConstants::new(1.0, f0, f1),
            // Of a published lobe only one channel is coloured; the loop skips the others.
            specular: (specular != 0.0).then(|| FresnelConstants::new(specular, f0, f1)),
        }
    }
}

impl FresnelConstants {
    /// F times `scale`.
    fn new(scale: f64, f0: f64, f1: f64) -> Self {
        Self {
            normal: single(scale * (f0 - f1)),
            schlick: single(scale * (1.0 - f0)),
            f1: single(scale * f1),
        }
    }

    /// F at ε = 1 − cosθd, as (f0 − f1) + (1 − f0) ε⁵ + f1 ε: no cancellation towards ε = 0.
    #[inline(always)]
    pub fn at<A: Arithmetic>(&self, FresnelAt { e, e5 }: FresnelAt) -> f32 {
        A::mul_add(self.schlick, e5, A::mul_add(self.f1, e, self.normal))
    }
}

/// x = tan²θh and (1+x)².
#[derive(Clone, Copy, Debug)]
pub struct NormalAt {
    pub x: f32,
    pub spread: f32,
}

impl NormalAt {
    #[inline(always)]
    pub fn new(tan2_theta: f32) -> Self {
        // `min` takes a NaN to the bound, too: the zeros that pad a block have 0/0 here.
        let x = min(tan2_theta, LARGEST_TAN2);
        Self { x, spread: (1.0 + x) * (1.0 + x) }
    }
}

/// ε = 1 − cosθd and ε⁵.
#[derive(Clone, Copy, Debug)]
pub struct FresnelAt {
    pub e: f32,
    pub e5: f32,
}

impl FresnelAt {
    #[inline(always)]
    pub fn new(cos_d: f32) -> Self {
        // Rounding may leave cosθd above 1.
        let e = max(1.0 - cos_d, 0.0);
        let e2 = e * e;
        Self { e, e5: e * (e2 * e2) }
    }
}
