//! The lines of a 3D table along its first axis, filled in f32 vectors.

use crate::lut::row::Row;
use crate::lut::visibility::{BLOCK, PerDirection, Visibility};
use crate::math::arithmetic::{Arithmetic, Fused};
use crate::math::instruction_set::{InstructionSet, per_instruction_set};
use crate::microfacet::Distribution as _;

/// D/q below which nothing is stored: half floats end far above, and denormal f32 are slow.
const MIN_TEXEL: f64 = 1e-30;

/// A block of texels along the first axis: the part that every line shares.
pub(super) struct HalfVectors {
    /// cosθh and sinθh.
    cos: PerDirection,
    sin: PerDirection,
    /// D/q of each lobe, q its own.
    ndf: [PerDirection; 3],
}

impl HalfVectors {
    /// The blocks that cover the steps of the first axis, at tan²θh.
    pub(super) fn blocks(row: &Row, scales: [f64; 3], tan2: &[f64]) -> Vec<Self> {
        // The last texel closes the table with an exact 0.
        let inner = &tan2[..tan2.len().saturating_sub(1)];
        let starts = (0..tan2.len()).step_by(BLOCK);
        let blocks = starts.map(|start| {
            let block = &tan2[start..];
            let stored = inner.get(start..).unwrap_or(&[]);
            Self {
                cos: lanes(block, |x| 1.0 / (1.0 + x).sqrt()),
                sin: lanes(block, |x| (x / (1.0 + x)).sqrt()),
                ndf: std::array::from_fn(|j| {
                    let lobe = row.lobes[j].as_ref();
                    lobe.map_or([0.0; BLOCK], |lobe| {
                        lanes(stored, |x| vanishing(lobe.distribution.ndf(x) / scales[j]))
                    })
                }),
            }
        });
        blocks.collect()
    }
}

/// A number at each of the first values; 0 after the last of them.
fn lanes(values: &[f64], number: impl Fn(f64) -> f64) -> PerDirection {
    let mut lanes = [0.0; BLOCK];
    for (lane, value) in lanes.iter_mut().zip(values) {
        *lane = number(*value) as f32;
    }
    lanes
}

/// A texel, 0 where it is too small to be stored.
fn vanishing(texel: f64) -> f64 {
    if texel < MIN_TEXEL { 0.0 } else { texel }
}

/// The numbers that the texels of a line along the first axis share.
#[derive(Clone, Copy)]
pub(super) struct Line {
    pub(super) cos_theta_d: f32,
    /// sinθd |cosφd|.
    pub(super) swing: f32,
    pub(super) colours: ColourMatrix,
}

/// From the lobes' D v v to the colours: (ρs/Σρs) F of each lobe and colour.
#[derive(Clone, Copy)]
pub(super) enum ColourMatrix {
    /// Lobe j colours channel j alone.
    Diagonal([f32; 3]),
    /// A column for each lobe.
    Full([[f32; 3]; 3]),
}

impl ColourMatrix {
    pub(super) fn new(columns: [[f32; 3]; 3]) -> Self {
        // A published fit, whose lobes colour one channel each: three products in place of nine.
        if (0..3).all(|j| (0..3).all(|c| c == j || columns[j][c] == 0.0)) {
            Self::Diagonal([0, 1, 2].map(|c| columns[c][c]))
        } else {
            Self::Full(columns)
        }
    }
}

/// The lines of a table.
pub(super) struct Lines {
    pub(super) half: Vec<HalfVectors>,
    pub(super) visibility: Visibility,
}

impl Lines {
    /// B/q of a line, with the same bits on every instruction set.
    pub(super) fn fill_on(&self, set: InstructionSet, line: Line, out: &mut [[f32; 3]]) {
        dispatch::fill(set, self, line, out);
    }

    #[inline(always)]
    fn fill<A: Arithmetic>(&self, line: Line, out: &mut [[f32; 3]]) {
        for (half, out) in self.half.iter().zip(out.chunks_mut(BLOCK)) {
            // cosθi, cosθo = cosθh cosθd ∓ sinθh sinθd |cosφd|.
            let (mut middle, mut reach) = (half.cos, half.sin);
            for k in 0..BLOCK {
                middle[k] *= line.cos_theta_d;
                reach[k] *= line.swing;
            }
            let mut lobes = self.visibility.products::<A>(&middle, &reach);
            match line.colours {
                ColourMatrix::Diagonal(fresnel) => {
                    for ((lobe, ndf), fresnel) in lobes.iter_mut().zip(&half.ndf).zip(fresnel) {
                        for (lobe, ndf) in lobe.iter_mut().zip(ndf) {
                            *lobe *= ndf * fresnel;
                        }
                    }
                    // PerDirection become texels only here: the loops above run over whole vectors.
                    for (k, texel) in out.iter_mut().enumerate() {
                        *texel = [lobes[0][k], lobes[1][k], lobes[2][k]];
                    }
                }
                ColourMatrix::Full(columns) => {
                    for (lobe, ndf) in lobes.iter_mut().zip(&half.ndf) {
                        for (lobe, ndf) in lobe.iter_mut().zip(ndf) {
                            *lobe *= ndf;
                        }
                    }
                    for (k, texel) in out.iter_mut().enumerate() {
                        let mut sums = [0.0; 3];
                        for (lobe, column) in lobes.iter().zip(&columns) {
                            for (sum, fresnel) in sums.iter_mut().zip(column) {
                                // Lobe by lobe in a fixed order, for equal bits.
                                *sum = A::mul_add(lobe[k], *fresnel, *sum);
                            }
                        }
                        *texel = sums;
                    }
                }
            }
        }
    }
}

/// The kernel once per instruction set, each with the same bits.
mod dispatch {
    use super::*;

    per_instruction_set!(fill<A: Fused, baseline Fused>
        (lines: &Lines, line: Line, out: &mut [[f32; 3]]) -> () { lines.fill::<A>(line, out) });
}
