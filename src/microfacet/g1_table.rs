//! G1 as a table, in f64 and in f32: polynomials on every scale that a mixture of Beckmann
//! distributions has.

use nalgebra::SVector;

use crate::math::arithmetic::{max, min};
use crate::math::chebyshev::{interpolation, nodes};
use crate::math::octave_table::OctaveTable;
use crate::microfacet::{BeckmannMixture, Distribution};

/// A lobe of width α no longer changes for cotθ below α/8, but for a smooth series.
const LOW: f64 = 0.125;
/// At cotθ = 6.5 α, Λ of a lobe of width α is below 1e-19.
const HIGH: f64 = 6.5;

/// G1/cotθ as piecewise polynomials in cotθ.
///
/// # Derivation
///
/// Λ of a Beckmann lobe is a function of cotθ/α alone, analytic within a quarter turn around the
/// positive axis: an [`OctaveTable`] leaves less than 1e-8 of G1. Below the narrowest lobe's width
/// one piece reaches the horizon; beyond the widest, G1 = 1.
#[derive(Clone, Debug, PartialEq)]
pub struct G1Table(OctaveTable);

impl G1Table {
    /// The table of a mixture's G1.
    #[must_use]
    pub fn of(mixture: &BeckmannMixture) -> Self {
        // Between the two widths G1/cotθ has structure, and nowhere else.
        let [narrowest, widest] = mixture.widths();
        let range = [LOW * narrowest, HIGH * widest];
        Self(OctaveTable::new(range, |cot| mixture.g1(cot) / cot))
    }

    /// G1 at cotθ ≥ 0.
    #[inline]
    #[must_use]
    pub fn g1(&self, cot_theta: f64) -> f64 {
        // Beyond the widest lobe nothing masks; just before, rounding may pass 1.
        self.0.value(cot_theta).map_or(1.0, |ratio| (ratio * cot_theta).min(1.0))
    }
}

/// Pieces of a [`SingleG1Table`].
const PIECES: usize = 2048;

/// The exact masking in f32, as piecewise cubics of G1/t in t = cosθ/(cosθ + sinθ).
///
/// G1/t is smooth and positive from the horizon (t = 0) to the zenith (t = 1), on every scale
/// that a mixture of lobes has. Pieces divide each octave of t evenly, so that the leading bits of
/// t are the piece's index and the rest the place in it. Finer pieces cover fewer octaves; below
/// the last, G1/t is constant.
#[derive(Clone, Debug, PartialEq)]
pub struct SingleG1Table {
    pieces: Box<[[f32; 4]; PIECES]>,
    /// log₂ of the pieces per octave.
    fineness: u32,
}

impl SingleG1Table {
    /// The relative error of G1 at which a coarser table is good enough.
    pub const ACCURACY: f64 = 1e-6;

    /// The coarsest table whose measured error keeps [`Self::ACCURACY`], or else the finest.
    #[must_use]
    pub fn new(exact: &impl Distribution) -> Self {
        // Fineness 5, 6 and 7 cover 64, 32 and 16 octaves.
        let coarse = (5..7).map(|fineness| Self::with_fineness(exact, fineness));
        coarse
            .into_iter()
            .find(|table| table.error(exact) <= Self::ACCURACY)
            .unwrap_or_else(|| Self::with_fineness(exact, 7))
    }

    fn with_fineness(exact: &impl Distribution, fineness: u32) -> Self {
        let coefficients = interpolation::<4>();
        let mut pieces = Box::new([[0.0; 4]; PIECES]);
        for (index, piece) in pieces.iter_mut().enumerate() {
            let (start, width) = Self::interval(index, fineness);
            let values = nodes::<4>().map(|v| ratio(exact, start + width * 0.5 * (v + 1.0)));
            *piece = (coefficients * SVector::from(values)).map(|c| c as f32).into();
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

    /// The largest relative error of G1 seen at the quarters and ends of every piece, and below the
    /// first.
    #[must_use]
    pub fn error(&self, exact: &impl Distribution) -> f64 {
        let lowest = Self::interval(0, self.fineness).0;
        let inside = (0..PIECES).flat_map(|index| {
            let (start, width) = Self::interval(index, self.fineness);
            [0.001, 0.25, 0.5, 0.75, 0.999].map(|v| start + width * v)
        });
        // Below the first piece the table is constant, so the exact ratio has to be.
        let below = [lowest * 1e-9, lowest * 0.5];
        inside
            .chain(below)
            .map(|t| {
                let table = f64::from(self.ratio(t as f32));
                (table / ratio(exact, t) - 1.0).abs()
            })
            .fold(0.0, f64::max)
    }

    /// G1/t, t = cosθ/(cosθ + sinθ).
    #[inline(always)]
    #[must_use]
    pub fn ratio(&self, t: f32) -> f32 {
        /// The last f32 below 1, where the pieces end.
        const LARGEST: f32 = 1.0 - f32::EPSILON / 2.0;
        let shift = 23 - self.fineness;
        // The bits of 2^−octaves, where the first piece starts.
        let first = (127 - (PIECES as u32 >> self.fineness)) << 23;
        // Signed, so that everything below the first piece stays there.
        let clamped = max(min(t, LARGEST), 0.0);
        let offset = (clamped.to_bits().cast_signed() - first.cast_signed()).max(0).cast_unsigned();
        // In range anyway; the `min` spares the loop a bounds check.
        let [c0, c1, c2, c3] = self.pieces[((offset >> shift) as usize).min(PIECES - 1)];
        // The bits below the index, scaled by 2^−shift to [0, 1) and then to [−1, 1).
        let within = (offset & ((1 << shift) - 1)).cast_signed() as f32;
        let v = 2.0 * (within * f32::from_bits((127 - shift) << 23)) - 1.0;
        c0 + v * (c1 + v * (c2 + v * c3))
    }
}

/// G1/t of the exact masking at t = cosθ/(cosθ + sinθ).
fn ratio(exact: &impl Distribution, t: f64) -> f64 {
    exact.g1(t / (1.0 - t)) / t
}

#[cfg(test)]
mod tests {
    use super::SingleG1Table;
    use crate::material::catalog;
    use crate::microfacet::{Accuracy, Distribution, Sgd};

    #[test]
    fn every_published_lobe_and_odd_ones_keep_the_stated_accuracy() {
        let published = catalog().iter().flat_map(|entry| entry.channels);
        let shapes =
            published.map(|c| (c.alpha, c.p)).chain([(1e-8, 4.0), (50.0, 0.1), (0.3, 0.0)]);
        let mut worst: f64 = 0.0;
        for (alpha, p) in shapes {
            let exact = Sgd::new(alpha, p, Accuracy::Table);
            let table = exact.clone().tabulated();
            for k in 0..400 {
                let cot = 10_f64.powf(f64::from(k) / 25.0 - 12.0);
                worst = worst.max((table.g1(cot) / exact.g1(cot) - 1.0).abs());
            }
        }
        assert!(worst < 1e-8, "{worst:e}");
    }

    #[test]
    fn the_ends_are_exact() {
        let table = Sgd::new(0.1, 0.5, Accuracy::Table).tabulated();
        assert_eq!(table.g1(0.0), 0.0);
        assert_eq!(table.g1(f64::INFINITY), 1.0);
    }

    #[test]
    fn single_precision_keeps_its_accuracy_from_the_sharpest_to_the_roughest() {
        for (alpha, p) in
            [(1.6e-5, 0.9), (0.015, 0.46), (0.85, 0.3), (0.05, 1.78), (1e-8, 4.0), (50.0, 0.1)]
        {
            let exact = Sgd::new(alpha, p, Accuracy::Table);
            let table = SingleG1Table::new(&exact);
            let error = table.error(&exact);
            assert!(
                error <= SingleG1Table::ACCURACY,
                "{alpha} {p}: {error:e} at {}",
                table.fineness
            );
        }
    }
}
