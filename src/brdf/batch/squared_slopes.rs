//! The lengths of slopes drawn from P22, in f32.

use nalgebra::SVector;

use crate::material::MAX_LOBES;
use crate::math::chebyshev::{interpolation, nodes};
use crate::microfacet::VisibleNormals;

/// Pieces of a lobe's table.
const PIECES: usize = 256;
/// log₂ of the pieces per octave.
const FINENESS: u32 = 3;
/// log₂ of the least e with a piece of its own: half of what a uniform f32 tells from 0.
const LOWEST: i32 = -25;
/// Bits of an f32 below those that number a piece.
const PLACE_BITS: u32 = f32::MANTISSA_DIGITS - 1 - FINENESS;

/// The squared length x of a slope against e = −ln of the share of longer slopes, for each lobe: x/e
/// as cubics, eight an octave of e. Zeros follow the lobes', for a technique that is no lobe.
#[derive(Clone, Debug, PartialEq)]
pub struct SquaredSlopes(Box<[[f32; 4]; (MAX_LOBES + 1) * PIECES]>);

impl SquaredSlopes {
    /// Of the lobes' visible normals.
    #[must_use]
    pub fn new(normals: &[VisibleNormals]) -> Self {
        let mut table = Box::new([[0.0; 4]; (MAX_LOBES + 1) * PIECES]);
        for (normals, pieces) in normals.iter().zip(table.chunks_exact_mut(PIECES)) {
            for (index, piece) in pieces.iter_mut().enumerate() {
                *piece = cubic(normals, index);
            }
        }
        Self(table)
    }

    /// x of the lobe of index `technique` at e ≥ 0; 0 where that is no lobe.
    #[inline(always)]
    pub fn at(&self, technique: u32, e: f32) -> f32 {
        const FIRST: i32 = (f32::MAX_EXP - 1 + LOWEST) << (f32::MANTISSA_DIGITS - 1);
        const UNIT: f32 = 1.0 / (1 << PLACE_BITS) as f32;
        let offset = (e.to_bits().cast_signed() - FIRST).max(0).cast_unsigned();
        let piece = (offset >> PLACE_BITS).min(PIECES as u32 - 1);
        let lobe = technique.min(MAX_LOBES as u32);
        let [c0, c1, c2, c3] = self.0[(lobe * PIECES as u32 + piece) as usize];
        let within = (offset & ((1 << PLACE_BITS) - 1)).cast_signed() as f32;
        let v = 2.0 * (within * UNIT) - 1.0;
        e * (c0 + v * (c1 + v * (c2 + v * c3)))
    }
}

/// x/e over piece `index`, whose e is mapped to [−1, 1].
fn cubic(normals: &VisibleNormals, index: usize) -> [f32; 4] {
    /// Beyond −ln of the last share that a uniform number has.
    const FARTHEST: f64 = 36.0;
    let octave = f64::from(LOWEST + (index >> FINENESS) as i32).exp2();
    let width = octave / f64::from(1 << FINENESS);
    let start = octave + width * (index & ((1 << FINENESS) - 1)) as f64;
    let e = nodes::<4>().map(|v| (start + 0.5 * width * (v + 1.0)).min(FARTHEST));
    let ratios = e.map(|e| normals.squared_slope(e) / e);
    (interpolation::<4>() * SVector::from(ratios)).map(|c| c as f32).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::find;
    use crate::microfacet::{Accuracy, Sgd};

    #[test]
    fn lengths_are_those_of_the_f64_table() {
        for name in ["chrome", "gold-paint", "pink-fabric", "specular-orange-phenolic"] {
            let lobes = find(name).expect("in the catalogue").material.lobes().iter();
            let normals: Vec<VisibleNormals> = lobes
                .map(|lobe| Sgd::new(lobe.alpha(), lobe.p(), Accuracy::Picture))
                .map(|sgd| VisibleNormals::new(sgd.mixture()))
                .collect();
            let table = SquaredSlopes::new(&normals);
            for (lobe, normals) in (0..).zip(&normals) {
                // From the least number above 0 to the last below 1.
                for e in (0..2000).map(|k| 16.6 * (-f64::from(k) / 95.0).exp2() as f32) {
                    let expected = normals.squared_slope(e.into());
                    let error = (f64::from(table.at(lobe, e)) / expected - 1.0).abs();
                    assert!(error < 2e-5, "{name} at {e:e}: {error:e}");
                }
            }
            assert_eq!(table.at(MAX_LOBES as u32, 1.0), 0.0);
        }
    }
}
