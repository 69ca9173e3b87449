//! Masking in f32: the published fit in closed form, the exact one from a table.

use nalgebra::{Matrix4, Vector4};

use crate::math::arithmetic::{Arithmetic, atan2, exp_m1, ln_1p, max, min};
use crate::microfacet::{Distribution as _, FittedMasking, Sgd};

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

/// Pieces of a [`TabulatedG1`].
const PIECES: usize = 2048;

/// The exact masking as piecewise cubics of G1/t in t = cosθ/(cosθ + sinθ).
///
/// G1/t is smooth and positive from the horizon (t = 0) to the zenith (t = 1), on every scale
/// that a mixture of lobes has. Pieces divide each octave of t evenly, so that the leading bits of
/// t are the piece's index and the rest the place in it. Finer pieces cover fewer octaves; below
/// the last, G1/t is constant.
#[derive(Clone, Debug, PartialEq)]
pub struct TabulatedG1 {
    pieces: Box<[[f32; 4]; PIECES]>,
    /// log₂ of the pieces per octave.
    fineness: u32,
}

impl TabulatedG1 {
    /// The relative error of G1 at which a coarser table is good enough.
    pub const ACCURACY: f64 = 1e-6;

    /// The coarsest table whose measured error keeps [`Self::ACCURACY`], or else the finest.
    #[must_use]
    pub fn new(exact: &Sgd) -> Self {
        let coarse = (5..7).map(|fineness| Self::with_fineness(exact, fineness));
        coarse
            .into_iter()
            .find(|table| table.error(exact) <= Self::ACCURACY)
            .unwrap_or_else(|| Self::with_fineness(exact, 7))
    }

    fn with_fineness(exact: &Sgd, fineness: u32) -> Self {
        let coefficients = interpolation_matrix();
        let mut pieces = Box::new([[0.0; 4]; PIECES]);
        for (index, piece) in pieces.iter_mut().enumerate() {
            let (start, width) = Self::interval(index, fineness);
            let values = NODES.map(|v| ratio(exact, start + width * v));
            *piece = (coefficients * Vector4::from(values)).map(|c| c as f32).into();
        }
        Self { pieces, fineness }
    }

    /// Where piece `index` starts in t, and its width.
    fn interval(index: usize, fineness: u32) -> (f64, f64) {
        let per_octave = 1_usize << fineness;
        let octaves = PIECES >> fineness;
        let scale = ((index / per_octave) as f64 - octaves as f64).exp2();
        let width = scale / per_octave as f64;
        (scale + (index % per_octave) as f64 * width, width)
    }

    /// The largest relative error of G1 seen at the quarters and ends of every piece, and below the first.
    #[must_use]
    pub fn error(&self, exact: &Sgd) -> f64 {
        let lowest = Self::interval(0, self.fineness).0;
        let inside = (0..PIECES).flat_map(|index| {
            let (start, width) = Self::interval(index, self.fineness);
            [0.001, 0.25, 0.5, 0.75, 0.999].map(|v| start + width * v)
        });
        let below = [lowest * 1e-9, lowest * 0.5];
        inside
            .chain(below)
            .map(|t| {
                let table = f64::from(self.ratio(t as f32));
                (table / ratio(exact, t) - 1.0).abs()
            })
            .fold(0.0, f64::max)
    }

    /// G1/t.
    #[inline(always)]
    fn ratio(&self, t: f32) -> f32 {
        const LARGEST: f32 = 1.0 - f32::EPSILON / 2.0;
        let shift = 23 - self.fineness;
        let first = (127 - (PIECES as u32 >> self.fineness)) << 23;
        // Signed, so that everything below the first piece stays there.
        let clamped = max(min(t, LARGEST), 0.0);
        let offset = (clamped.to_bits().cast_signed() - first.cast_signed()).max(0).cast_unsigned();
        let [c0, c1, c2, c3] = self.pieces[((offset >> shift) as usize).min(PIECES - 1)];
        let within = (offset & ((1 << shift) - 1)).cast_signed() as f32;
        let v = within * f32::from_bits((127 - shift) << 23);
        c0 + v * (c1 + v * (c2 + v * c3))
    }
}

impl BatchMasking for TabulatedG1 {
    #[inline(always)]
    fn coordinate<A: Arithmetic>(cos: f32, sin: f32) -> f32 {
        cos / (cos + sin)
    }

    #[inline(always)]
    fn g1<A: Arithmetic>(&self, t: f32) -> f32 {
        min(self.ratio(t) * t, 1.0)
    }
}

/// G1/t of the exact masking at t = cosθ/(cosθ + sinθ).
fn ratio(exact: &Sgd, t: f64) -> f64 {
    exact.g1(t / (1.0 - t)) / t
}

/// Chebyshev nodes of [0, 1].
const NODES: [f64; 4] = [
    0.038_060_233_744_356_62,
    0.308_658_283_817_455_1,
    0.691_341_716_182_544_9,
    0.961_939_766_255_643_4,
];

/// From values at [`NODES`] to the coefficients of the cubic through them.
fn interpolation_matrix() -> Matrix4<f64> {
    let powers = Matrix4::from_fn(|row, column| NODES[row].powi(column as i32));
    powers.try_inverse().expect("a Vandermonde matrix of distinct nodes is invertible")
}

/// The masking of each lobe in the form its kind needs.
#[derive(Clone, Debug, PartialEq)]
pub enum BatchMaskings {
    /// Smith's, tabulated.
    Exact(Vec<TabulatedG1>),
    /// The published fit.
    Fitted(Vec<FittedG1>),
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::arithmetic::Fused;
    use crate::microfacet::Accuracy;

    #[test]
    fn tables_keep_their_accuracy_from_the_sharpest_to_the_roughest() {
        for (alpha, p) in
            [(1.6e-5, 0.9), (0.015, 0.46), (0.85, 0.3), (0.05, 1.78), (1e-8, 4.0), (50.0, 0.1)]
        {
            let exact = Sgd::new(alpha, p, Accuracy::Table);
            let table = TabulatedG1::new(&exact);
            let error = table.error(&exact);
            assert!(error <= TabulatedG1::ACCURACY, "{alpha} {p}: {error:e} at {}", table.fineness);
        }
    }

    #[test]
    fn both_ends_are_exact() {
        let table = TabulatedG1::new(&Sgd::new(0.03, 0.5, Accuracy::Table));
        let g1 = |cos, sin| table.g1::<Fused>(TabulatedG1::coordinate::<Fused>(cos, sin));
        assert_eq!(g1(0.0, 1.0), 0.0);
        assert!((g1(1.0, 0.0) - 1.0).abs() < 1e-6);
    }
}
