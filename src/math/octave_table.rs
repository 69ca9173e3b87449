//! A function of x ≥ 0 as polynomials on quarter octaves, in f64.

use nalgebra::SVector;

use crate::math::chebyshev::{interpolation, nodes};

/// Coefficients of a piece.
const ORDER: usize = 8;
/// log₂ of the pieces per octave of x.
const FINENESS: u32 = 2;
/// Bits of an f64 below those that number a piece.
const PLACE_BITS: u32 = f64::MANTISSA_DIGITS - 1 - FINENESS;

/// A smooth function between two scales of x: one piece from 0 to the smaller, quarter octaves from
/// there to the larger, unknown beyond.
///
/// A function that is analytic within a quarter turn around the positive axis, on each scale that
/// it has, gains a factor of at least 15 with each coefficient.
#[derive(Clone, Debug, PartialEq)]
pub struct OctaveTable {
    /// The number of the first quarter octave, as the leading bits of its x.
    first: u64,
    /// Where it starts; the first piece lies below.
    start: f64,
    pieces: Vec<[f64; ORDER]>,
}

/// The number of the quarter octave that x lies in: its leading bits.
fn number(x: f64) -> u64 {
    // The bits of x ≥ 0 are ordered as x is, so neighbouring pieces have consecutive numbers.
    x.to_bits() >> PLACE_BITS
}

/// Where a quarter octave starts.
fn border(number: u64) -> f64 {
    f64::from_bits(number << PLACE_BITS)
}

impl OctaveTable {
    /// The table of `function`, which changes smoothly below `low` and is asked for up to `high`.
    #[must_use]
    pub fn new([low, high]: [f64; 2], mut function: impl FnMut(f64) -> f64) -> Self {
        let first = number(low);
        // One octave piece at least, also where `high` is below `low`.
        let end = number(high).max(first) + 1;
        let start = border(first);
        let fit = interpolation::<ORDER>();
        let octaves = (first..end).map(|number| [border(number), border(number + 1)]);
        let pieces = std::iter::once([0.0, start]).chain(octaves).map(|[low, high]| {
            let x = nodes().map(|v| 0.5 * ((high + low) + (high - low) * v));
            (fit * SVector::from(x.map(&mut function))).into()
        });
        Self { first, start, pieces: pieces.collect() }
    }

    /// The function at x ≥ 0; `None` beyond the last piece.
    #[inline]
    #[must_use]
    pub fn value(&self, x: f64) -> Option<f64> {
        let bits = x.to_bits();
        let (piece, v) = if x < self.start {
            (0, 2.0 * x / self.start - 1.0)
        } else {
            // The bits below the piece's number, as those of a number in [1, 2).
            // Shifted out are the sign, the eleven bits of the exponent and those of the piece.
            let place = (bits << (FINENESS + 12)) >> 12 | 1.0_f64.to_bits();
            ((bits >> PLACE_BITS) - self.first + 1, 2.0 * f64::from_bits(place) - 3.0)
        };
        // A NaN or infinite x has larger bits than any piece: `None`.
        let coefficients = self.pieces.get(piece as usize)?;
        Some(coefficients.iter().rev().fold(0.0, |sum, c| sum * v + c))
    }
}
