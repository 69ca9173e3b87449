//! Masking in f32: the published fit in closed form, the exact one as a polynomial or a table.

use crate::brdf::batch::block::{BLOCK, PerPair};
use crate::math::arithmetic::{Arithmetic, Separate, atan2, exp_m1, ln_1p, max, min};
use crate::math::direction::cot_of_cos;
use crate::microfacet::{
    Distribution as _, FittedMasking, G1Polynomial, Sgd, SingleG1Table, grazing_limit,
};

/// What the masking of all lobes needs to know of a direction.
pub type Place = [f32; 2];

/// The masking of one lobe.
pub trait BatchMasking {
    /// The place of a direction.
    fn place<A: Arithmetic>(w: [f32; 3]) -> Place;
    /// G1 there, in [0, 1].
    fn g1<A: Arithmetic>(&self, place: Place) -> f32;
    /// (G1/cosθ)(wi) · (G1/cosθ)(wo).
    fn visibility<A: Arithmetic>(&self, wi: Place, wo: Place) -> f32;
    /// The same for a block of pairs, with the same bits.
    #[inline(always)]
    fn visibilities<A: Arithmetic>(
        &self,
        [place_i, rest_i]: &[PerPair; 2],
        [place_o, rest_o]: &[PerPair; 2],
        visibilities: &mut PerPair,
    ) {
        for i in 0..BLOCK {
            visibilities[i] =
                self.visibility::<A>([place_i[i], rest_i[i]], [place_o[i], rest_o[i]]);
        }
    }
}

/// sinθ ≥ 0.
#[inline(always)]
fn sin_theta<A: Arithmetic>([x, y, _]: [f32; 3]) -> f32 {
    A::mul_add(x, x, y * y).sqrt()
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
            // A file may hold any positive f64; the caps keep all of them finite in f32.
            scale: (1.0 + amplitude) as f32,
            log_ratio: amplitude.recip().ln_1p().min(1e30) as f32,
            k: masking.params().k.min(1e30) as f32,
            inv_onset: masking.onset_elevation().recip().clamp(1e-30, 1e30) as f32,
        }
    }
}

impl BatchMasking for FittedG1 {
    /// The elevation and 1/cosθ.
    #[inline(always)]
    fn place<A: Arithmetic>(w: [f32; 3]) -> Place {
        // The arc sine of z would lose half of its digits near the normal.
        [atan2::<A>(w[2], sin_theta::<A>(w)), 1.0 / w[2]]
    }

    #[inline(always)]
    fn g1<A: Arithmetic>(&self, [elevation, _]: Place) -> f32 {
        const BELOW_ONE: f32 = 1.0 - f32::EPSILON;
        let u = elevation * self.inv_onset;
        // Computed above the onset too, so u is capped: a branch would stop the vectorisation.
        let risen = -exp_m1::<A>(self.k * ln_1p::<A>(-min(u, BELOW_ONE)));
        let g1 = min(-self.scale * exp_m1::<A>(-self.log_ratio * risen), 1.0);
        if u >= 1.0 { 1.0 } else { g1 }
    }

    #[inline(always)]
    fn visibility<A: Arithmetic>(&self, wi: Place, wo: Place) -> f32 {
        (self.g1::<A>(wi) * wi[1]) * (self.g1::<A>(wo) * wo[1])
    }
}

impl BatchMasking for SingleG1Table {
    /// cosθ/(cosθ + sinθ) and 1/cosθ.
    #[inline(always)]
    fn place<A: Arithmetic>(w: [f32; 3]) -> Place {
        [w[2] / (w[2] + sin_theta::<A>(w)), 1.0 / w[2]]
    }

    #[inline(always)]
    fn g1<A: Arithmetic>(&self, [t, _]: Place) -> f32 {
        min(self.ratio(t) * t, 1.0)
    }

    #[inline(always)]
    fn visibility<A: Arithmetic>(&self, wi: Place, wo: Place) -> f32 {
        (self.g1::<A>(wi) * wi[1]) * (self.g1::<A>(wo) * wo[1])
    }
}

/// Coefficients of the exact masking's polynomial, at most; an even number.
const ORDER: usize = 20;

/// The exact masking as [`G1Polynomial`]: G1 = u P(u), u = c/(c + s), c = cosθ.
///
/// Twenty fused operations in registers cost less than four coefficients gathered from a table; and
/// of a pair only the product is needed, with one division for both directions.
#[derive(Clone, Debug, PartialEq)]
pub struct SingleG1Polynomial {
    /// s.
    scale: f32,
    /// The factor that takes u into [0, 2].
    stretch: f32,
    /// Coefficients over [−1, 1], 0 from [`Self::order`] on.
    coefficients: [f32; ORDER],
    order: usize,
}

impl SingleG1Polynomial {
    /// The relative error of G1 up to which the polynomial is used.
    pub const ACCURACY: f64 = 2e-6;

    /// The shortest polynomial of a distribution; `None` where none keeps [`Self::ACCURACY`].
    #[must_use]
    pub fn new(exact: &Sgd) -> Option<Self> {
        /// s as multiples of lim cosθ/G1 at grazing; wide lobes are smoothest with a large one.
        const SCALES: [f64; 11] = [2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 11.0, 16.0, 24.0, 40.0, 80.0];
        /// Smaller scales would underflow in a product of two.
        const SMALLEST: f64 = 1e-15;
        // All factors are tried, as it depends on the shape which gives the shortest polynomial.
        let limit = grazing_limit(|cot| exact.g1(cot));
        let tried = SCALES.map(|factor| Self::of_scale(exact, factor * limit)).into_iter();
        let accurate =
            tried.filter(|tried| limit > SMALLEST && tried.error(exact) <= Self::ACCURACY);
        accurate.min_by_key(|accurate| accurate.order)
    }

    fn of_scale(exact: &Sgd, scale: f64) -> Self {
        /// Together the dropped coefficients change G1 by less than this share.
        const NEGLIGIBLE: f64 = 1e-6;
        let polynomial = G1Polynomial::new::<ORDER>(|cot| exact.g1(cot), scale, 1.0, NEGLIGIBLE);
        Self {
            scale: scale as f32,
            stretch: polynomial.stretch as f32,
            order: polynomial.coefficients.len(),
            coefficients: polynomial.single(),
        }
    }

    /// The largest relative error of G1 seen at even steps of u and at grazing.
    fn error(&self, exact: &Sgd) -> f64 {
        const STEPS: u32 = 256;
        let scale = f64::from(self.scale);
        // u is 1/(1 + s) along the normal.
        let steps = (1..STEPS).map(|k| f64::from(k) / f64::from(STEPS) / (1.0 + scale));
        let inside = steps.map(|u| scale * u / (1.0 - u));
        let places = inside.chain([1e-6 * scale, 1e-3 * scale]).map(|cos| cos as f32);
        places.map(|cos| self.error_at(exact, cos)).fold(0.0, f64::max)
    }

    /// The relative error of G1 at cosθ.
    fn error_at(&self, exact: &Sgd, cos: f32) -> f64 {
        let expected = exact.g1(cot_of_cos(f64::from(cos)));
        (f64::from(self.unclamped_g1::<Separate>(cos)) / expected - 1.0).abs()
    }

    /// P(u) by its first `N` coefficients, an even number.
    #[inline(always)]
    fn ratio<A: Arithmetic, const N: usize>(&self, u: f32) -> f32 {
        let t = A::mul_add(u, self.stretch, -1.0);
        // Even and odd powers apart: two short chains wait less than a long one.
        let t2 = t * t;
        let [mut odd, mut even] = [self.coefficients[N - 1], self.coefficients[N - 2]];
        for k in (0..N / 2 - 1).rev() {
            odd = A::mul_add(odd, t2, self.coefficients[2 * k + 1]);
            even = A::mul_add(even, t2, self.coefficients[2 * k]);
        }
        A::mul_add(odd, t, even)
    }

    #[inline(always)]
    fn unclamped_g1<A: Arithmetic>(&self, cos: f32) -> f32 {
        let u = cos / (cos + self.scale);
        u * self.ratio::<A, ORDER>(u)
    }

    #[inline(always)]
    fn visibility_of<A: Arithmetic, const N: usize>(&self, cos_i: f32, cos_o: f32) -> f32 {
        let (length_i, length_o) = (cos_i + self.scale, cos_o + self.scale);
        // One division, the slowest operation, for both sides: u_i = cosθi · length_o · inverse.
        let inverse = 1.0 / (length_i * length_o);
        let ratio_i = self.ratio::<A, N>(cos_i * length_o * inverse);
        let ratio_o = self.ratio::<A, N>(cos_o * length_i * inverse);
        ratio_i * ratio_o * inverse
    }

    #[inline(always)]
    fn visibilities_of<A: Arithmetic, const N: usize>(
        &self,
        cos_i: &PerPair,
        cos_o: &PerPair,
        visibilities: &mut PerPair,
    ) {
        for i in 0..BLOCK {
            visibilities[i] = self.visibility_of::<A, N>(cos_i[i], cos_o[i]);
        }
    }
}

impl BatchMasking for SingleG1Polynomial {
    /// cosθ.
    #[inline(always)]
    fn place<A: Arithmetic>(w: [f32; 3]) -> Place {
        [max(min(w[2], 1.0), 0.0), 0.0]
    }

    #[inline(always)]
    fn g1<A: Arithmetic>(&self, [cos, _]: Place) -> f32 {
        min(self.unclamped_g1::<A>(cos), 1.0)
    }

    #[inline(always)]
    fn visibility<A: Arithmetic>(&self, [cos_i, _]: Place, [cos_o, _]: Place) -> f32 {
        self.visibility_of::<A, ORDER>(cos_i, cos_o)
    }

    /// Leading coefficients of 0 leave the bits alone.
    #[inline(always)]
    fn visibilities<A: Arithmetic>(
        &self,
        [cos_i, _]: &[PerPair; 2],
        [cos_o, _]: &[PerPair; 2],
        visibilities: &mut PerPair,
    ) {
        match self.order {
            // A length that the compiler knows unrolls the loop.
            0..=14 => self.visibilities_of::<A, 14>(cos_i, cos_o, visibilities),
            15..=18 => self.visibilities_of::<A, 18>(cos_i, cos_o, visibilities),
            _ => self.visibilities_of::<A, ORDER>(cos_i, cos_o, visibilities),
        }
    }
}

/// The masking of each lobe in the form its kind needs.
#[derive(Clone, Debug, PartialEq)]
pub enum BatchMaskings {
    /// Smith's, as polynomials.
    Exact(Vec<SingleG1Polynomial>),
    /// Smith's, tabulated: for distributions on too many scales for one polynomial.
    Tabulated(Vec<SingleG1Table>),
    /// The published fit.
    Fitted(Vec<FittedG1>),
}

impl BatchMaskings {
    /// Smith's masking of distributions.
    #[must_use]
    pub fn exact(distributions: &[Sgd]) -> Self {
        let polynomials =
            distributions.iter().map(|sgd| SingleG1Polynomial::new(&sgd.clone().tabulated()));
        // One lobe without a polynomial puts all in tables: a kernel has one form of masking.
        match polynomials.collect() {
            Some(polynomials) => Self::Exact(polynomials),
            None => Self::Tabulated(distributions.iter().map(SingleG1Table::new).collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{Edition, Material};
    use crate::microfacet::Accuracy;

    /// Lobes as wide as any that a fit may have change too fast near the normal.
    #[test]
    fn every_lobe_but_the_widest_is_a_polynomial() {
        const WIDEST: f64 = 1.9;
        let (mut worst, mut orders) = (0.0_f64, [0; ORDER + 1]);
        let materials = Edition::Published.materials().chain(Edition::Refit.materials());
        for lobe in materials.flat_map(Material::lobes).filter(|lobe| lobe.alpha() < WIDEST) {
            let exact = Sgd::new(lobe.alpha(), lobe.p(), Accuracy::Table).tabulated();
            let polynomial = SingleG1Polynomial::new(&exact).expect("within the accuracy");
            orders[polynomial.order] += 1;
            worst = worst.max(polynomial.error(&exact));
        }
        println!("largest relative error of G1 {worst:.2e}, lobes of each order {orders:?}");
    }
}
