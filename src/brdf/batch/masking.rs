//! Masking in f32: the published fit in closed form, the exact one from a table.

use crate::math::arithmetic::{Arithmetic, atan2, exp_m1, ln_1p, min};
use crate::microfacet::{FittedMasking, SingleG1Table};

/// G1 of one lobe, as a function of a coordinate that the lobes share.
pub trait BatchMasking {
    /// The coordinate of the direction with cosine `cos` ≥ 0 and sine `sin` ≥ 0.
    fn coordinate<A: Arithmetic>(cos: f32, sin: f32) -> f32;
    /// G1 there, in [0, 1].
    fn g1<A: Arithmetic>(&self, coordinate: f32) -> f32;
}

/// The published fit (see [`FittedMasking`]); its coordinate is the elevation π/2 − θ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedG1 {
    /// 1 + λ.
    scale: f32,
    /// L = ln(1 + 1/λ).
    log_ratio: f32,
    k: f32,
    /// 1/(π/2 − θ0).
    inv_onset: f32,
}

impl FittedG1 {
    /// Above this λ the fit no longer changes in f32, but 1 + λ would overflow.
    const LARGEST_AMPLITUDE: f64 = 1e12;

    /// The fit in single precision.
    #[must_use]
    pub fn new(masking: &FittedMasking) -> Self {
        let amplitude = masking.params().lambda.min(Self::LARGEST_AMPLITUDE);
        Self {
            scale: (1.0 + amplitude) as f32,
            log_ratio: amplitude.recip().ln_1p().min(1e30) as f32,
            k: masking.params().k.min(1e30) as f32,
            inv_onset: masking.onset_elevation().recip().clamp(1e-30, 1e30) as f32,
        }
    }
}

impl BatchMasking for FittedG1 {
    #[inline(always)]
    fn coordinate<A: Arithmetic>(cos: f32, sin: f32) -> f32 {
        atan2::<A>(cos, sin)
    }

    #[inline(always)]
    fn g1<A: Arithmetic>(&self, elevation: f32) -> f32 {
        const BELOW_ONE: f32 = 1.0 - f32::EPSILON;
        let u = elevation * self.inv_onset;
        let risen = -exp_m1::<A>(self.k * ln_1p::<A>(-min(u, BELOW_ONE)));
        let g1 = min(-self.scale * exp_m1::<A>(-self.log_ratio * risen), 1.0);
        if u >= 1.0 { 1.0 } else { g1 }
    }
}

impl BatchMasking for SingleG1Table {
    #[inline(always)]
    fn coordinate<A: Arithmetic>(cos: f32, sin: f32) -> f32 {
        cos / (cos + sin)
    }

    #[inline(always)]
    fn g1<A: Arithmetic>(&self, t: f32) -> f32 {
        min(self.ratio(t) * t, 1.0)
    }
}

/// The masking of each lobe in the form its kind needs.
#[derive(Clone, Debug, PartialEq)]
pub enum BatchMaskings {
    /// Smith's, tabulated.
    Exact(Vec<SingleG1Table>),
    /// The published fit.
    Fitted(Vec<FittedG1>),
}
