//! G1 as a table: polynomials on every scale that a mixture of Beckmann distributions has.

use nalgebra::SVector;

use crate::math::chebyshev::{interpolation, nodes};
use crate::microfacet::{BeckmannMixture, Distribution};

/// Coefficients of a piece.
const ORDER: usize = 8;
/// log₂ of the pieces per octave of cotθ.
const FINENESS: u32 = 2;
/// Bits of an f64 below those that number a piece.
const PLACE_BITS: u32 = f64::MANTISSA_DIGITS - 1 - FINENESS;
/// A lobe of width α no longer changes for cotθ below α/8, but for a smooth series.
const LOW: f64 = 0.125;
/// At cotθ = 6.5 α, Λ of a lobe of width α is below 1e-19.
const HIGH: f64 = 6.5;

/// G1/cotθ as piecewise polynomials in cotθ.
///
/// # Derivation
///
/// Λ of a Beckmann lobe is a function of cotθ/α alone, analytic within a quarter turn around the
/// positive axis. On a quarter octave the Chebyshev series of such a function gains a factor of
/// at least 15 with each term; eight terms leave less than 1e-8 of G1. Below the narrowest lobe's
/// width one piece reaches the horizon; beyond the widest, G1 = 1.
#[derive(Clone, Debug, PartialEq)]
pub struct G1Table {
    /// The number of the first quarter octave, as the leading bits of its cotθ.
    first: u64,
    /// Where it starts; the first piece lies below.
    start: f64,
    pieces: Vec<[f64; ORDER]>,
}

impl G1Table {
    /// The table of a mixture's G1.
    #[must_use]
    pub fn of(mixture: &BeckmannMixture) -> Self {
        let [narrowest, widest] = mixture.widths();
        let number = |cot: f64| cot.to_bits() >> PLACE_BITS;
        let first = number(LOW * narrowest);
        let end = number(HIGH * widest).max(first) + 1;
        let border = |number: u64| f64::from_bits(number << PLACE_BITS);
        let start = border(first);
        let fit = interpolation::<ORDER>();
        let piece = |low: f64, high: f64| -> [f64; ORDER] {
            let value = |v: f64| {
                let cot = 0.5 * ((high + low) + (high - low) * v);
                mixture.g1(cot) / cot
            };
            (fit * SVector::from(nodes().map(value))).into()
        };
        let octaves = (first..end).map(|number| piece(border(number), border(number + 1)));
        Self { first, start, pieces: std::iter::once(piece(0.0, start)).chain(octaves).collect() }
    }

    /// G1 at cotθ ≥ 0.
    #[must_use]
    pub fn g1(&self, cot_theta: f64) -> f64 {
        let bits = cot_theta.to_bits();
        let (piece, v) = if cot_theta < self.start {
            (0, 2.0 * cot_theta / self.start - 1.0)
        } else {
            // The bits below the piece's number, as those of a number in [1, 2).
            let place = (bits << (FINENESS + 12)) >> 12 | 1.0_f64.to_bits();
            ((bits >> PLACE_BITS) - self.first + 1, 2.0 * f64::from_bits(place) - 3.0)
        };
        let Some(coefficients) = self.pieces.get(piece as usize) else { return 1.0 };
        let ratio = coefficients.iter().rev().fold(0.0, |sum, c| sum * v + c);
        (ratio * cot_theta).min(1.0)
    }
}

#[cfg(test)]
mod tests {
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
}
