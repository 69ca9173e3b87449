//! The 3D table: the whole specular term of one material in Rusinkiewicz's angles.
//!
//! # Derivation
//!
//! An isotropic reciprocal reflectance depends on θh, θd and |cosφd| alone. The table holds
//! B = F·D·(G1(wi)/cosθi)·(G1(wo)/cosθo), finite down to the horizon; f = ρd/π + ρs/π·B. Texels
//! are B/q with q = 4 D(0) v² max|F|/65504 and v the largest G1/cosθ: the largest texel stays
//! below what a half float holds. With tanθh = √x,
//!
//! ```text
//! cosθi, cosθo = cosθh cosθd ∓ sinθh sinθd |cosφd|
//! ```
//!
//! A cell at the horizon has corners where cosθi < 0; there G1/cosθ continues smoothly
//! ([`Visibility`]), so that interpolation stays smooth up to the horizon.

use half::f16;
use half::slice::HalfFloatSliceExt as _;
use rayon::prelude::*;

use crate::brdf::ChannelBrdf;
use crate::lut::axis::{Axis, Variable, Warp};
use crate::lut::bake::{BakeError, Depths};
use crate::lut::budget::least;
use crate::lut::probe::Probe;
use crate::lut::quantity::{Encoding, Quantity};
use crate::lut::row::Row;
use crate::lut::table::{Depth, ErrorNote, Filter, Table, Texels};
use crate::lut::term::{masking_scale, ndf_scale};
use crate::lut::visibility::{BLOCK, Lanes, Visibility};
use crate::math::arithmetic::{Arithmetic, Fused};
use crate::math::instruction_set::{InstructionSet, per_instruction_set};

/// Texels along an axis.
pub const AXIS: std::ops::RangeInclusive<usize> = 2..=512;
/// Texels that a 3D table may have: 400 MB as half floats.
pub const MOST_TEXELS: usize = 1 << 26;
/// tan²θh/α at the end of the axis, where D is e^{−30} of its peak.
const END: f64 = 30.0;
/// D/q below which nothing is stored: half floats end far above, and denormal f32 are slow.
const FAINTEST: f64 = 1e-30;
/// Beyond so many times the expected size it is rounding, not size, that limits the error.
const MOST_GROWTH: f64 = 4.0;
/// What a search aims at: cells are many, so probes miss the worst by more than in 2D.
const SEARCH_SHARE: f64 = 0.8;
/// The sizes of the tables, one axis coarse each, that tell how fast an axis converges.
const REFERENCE: [[usize; 3]; 3] = [[33, 129, 65], [129, 33, 65], [129, 129, 17]];

/// How far masking may be off, relatively: little, next to the rounding of its texels.
fn masking_accuracy(depth: Depth) -> f64 {
    match depth {
        Depth::Half => 5e-5,
        Depth::Unorm16 | Depth::Float => 2e-6,
    }
}

/// The axes of a row's 3D table.
#[must_use]
pub fn axes(row: &Row) -> Vec<Axis> {
    let max = row.visible().map(|lobe| END * lobe.ndf.alpha()).fold(0.0, f64::max);
    let half = Warp::Log1p { scale: vec![ndf_scale(row)], max: vec![max] };
    let difference = Warp::Log1p { scale: vec![masking_scale(row)], max: vec![1.0] };
    vec![
        Axis { variable: Variable::Tan2ThetaH, warp: Some(half) },
        Axis { variable: Variable::CosThetaD, warp: Some(difference) },
        Axis { variable: Variable::AbsCosPhiD, warp: Some(Warp::Identity) },
    ]
}

/// What a block of texels along the first axis shares with those of every other line.
struct HalfVectors {
    /// cosθh and sinθh.
    cos: Lanes,
    sin: Lanes,
    /// D/q of each channel.
    ndf: [Lanes; 3],
}

impl HalfVectors {
    /// The blocks that cover the steps of the first axis, at tan²θh.
    fn blocks(row: &Row, factor: [f64; 3], tan2: &[f64]) -> Vec<Self> {
        // The last texel closes the table with an exact 0.
        let last = tan2.len().saturating_sub(1);
        let block = |start: usize| {
            let lanes = |of: &dyn Fn(usize) -> f64| -> Lanes {
                let at = |k: usize| if start + k < tan2.len() { of(start + k) } else { 0.0 };
                std::array::from_fn(|k| at(k) as f32)
            };
            let ndf = |c: usize, i: usize| match &row.lobes[c] {
                Some(lobe) if i < last => {
                    let texel = lobe.ndf.eval(tan2[i]) / factor[c];
                    if texel < FAINTEST { 0.0 } else { texel }
                }
                _ => 0.0,
            };
            Self {
                cos: lanes(&|i| 1.0 / (1.0 + tan2[i]).sqrt()),
                sin: lanes(&|i| (tan2[i] / (1.0 + tan2[i])).sqrt()),
                ndf: std::array::from_fn(|c| lanes(&|i| ndf(c, i))),
            }
        };
        (0..tan2.len()).step_by(BLOCK).map(block).collect()
    }
}

/// What the texels of a line along the first axis share.
#[derive(Clone, Copy)]
struct Line {
    cos_theta_d: f32,
    /// sinθd |cosφd|.
    swing: f32,
    fresnel: [f32; 3],
}

/// The lines of a table.
struct Lines {
    half: Vec<HalfVectors>,
    visibility: Visibility,
}

impl Lines {
    /// B/q of a line.
    #[inline(always)]
    fn fill<A: Arithmetic>(&self, line: Line, out: &mut [[f32; 3]]) {
        for (half, out) in self.half.iter().zip(out.chunks_mut(BLOCK)) {
            let (mut middle, mut reach) = (half.cos, half.sin);
            for k in 0..BLOCK {
                middle[k] *= line.cos_theta_d;
                reach[k] *= line.swing;
            }
            let mut brdf = self.visibility.products::<A>(&middle, &reach);
            for ((brdf, ndf), fresnel) in brdf.iter_mut().zip(&half.ndf).zip(line.fresnel) {
                for (brdf, ndf) in brdf.iter_mut().zip(ndf) {
                    *brdf *= ndf * fresnel;
                }
            }
            for (k, texel) in out.iter_mut().enumerate() {
                *texel = [brdf[0][k], brdf[1][k], brdf[2][k]];
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

/// The 3D table of a row with the given texels along each axis.
#[must_use]
pub fn tabulate(row: &Row, index: usize, size: [usize; 3], depth: Depth) -> Table {
    tabulate_on(InstructionSet::widest(), row, index, size, depth)
}

/// [`tabulate`] on a chosen instruction set, or the widest where this machine lacks it; the texels
/// are the same.
#[must_use]
pub fn tabulate_on(
    set: InstructionSet,
    row: &Row,
    index: usize,
    size: [usize; 3],
    depth: Depth,
) -> Table {
    let axes = axes(row);
    let along = |axis: usize| -> Vec<f64> {
        let warp = axes[axis].warp.as_ref();
        let last = (size[axis] - 1) as f64;
        (0..size[axis]).map(|i| warp.map_or(0.0, |w| w.variable(0, i as f64 / last))).collect()
    };
    let [tan2, cos_d, cos_phi] = [0, 1, 2].map(along);
    let factor = row.lobes.each_ref().map(|lobe| lobe.as_ref().map_or(1.0, factor));
    let fresnel = |cos: &f64| {
        row.lobes.each_ref().map(|lobe| lobe.as_ref().map_or(0.0, |l| l.fresnel.eval(*cos)) as f32)
    };
    let fresnel: Vec<[f32; 3]> = cos_d.iter().map(fresnel).collect();
    let lines = Lines {
        half: HalfVectors::blocks(row, factor, &tan2),
        visibility: Visibility::new(row, masking_accuracy(depth)),
    };
    let fill_line = |line: usize, out: &mut [[f32; 3]]| {
        let (d, phi) = (line % size[1], line / size[1]);
        let sin_d = (1.0 - cos_d[d] * cos_d[d]).max(0.0).sqrt();
        let line = Line {
            cos_theta_d: cos_d[d] as f32,
            swing: (sin_d * cos_phi[phi]) as f32,
            fresnel: fresnel[d],
        };
        dispatch::fill(set.or_widest(), &lines, line, out);
    };
    Table {
        quantity: Quantity::Brdf3d,
        axes,
        size: size.to_vec(),
        encoding: Encoding::Times { factor },
        texels: fill(size, depth, &fill_line),
        rows: vec![row.name.clone()],
        row: Some(index),
        error: ErrorNote::default(),
    }
}

/// All texels, line by line in parallel, written once where they stay.
fn fill(size: [usize; 3], depth: Depth, line: &(impl Fn(usize, &mut [[f32; 3]]) + Sync)) -> Texels {
    let count = size.iter().product();
    match depth {
        Depth::Float | Depth::Unorm16 => {
            let mut texels = vec![[0.0; 3]; count];
            let lines = texels.par_chunks_mut(size[0]).enumerate();
            lines.for_each(|(i, out)| line(i, out));
            Texels::Float(texels)
        }
        Depth::Half => {
            let mut texels: Vec<[f16; 3]> = bytemuck::zeroed_vec(count);
            let lines = texels.par_chunks_mut(size[0]).enumerate();
            lines.for_each_init(
                || vec![[0.0; 3]; size[0]],
                |single, (i, out)| {
                    line(i, single);
                    out.as_flattened_mut().convert_from_f32_slice(single.as_flattened());
                },
            );
            Texels::Half(texels)
        }
    }
}

/// q: what a texel of 1 stands for.
fn factor(lobe: &ChannelBrdf) -> f64 {
    const GRAZING: f64 = 1e-12;
    let visibility = lobe.masking.g1(GRAZING) / GRAZING;
    let fresnel =
        (0..=64).map(|i| lobe.fresnel.eval(f64::from(i) / 64.0).abs()).fold(0.0, f64::max);
    4.0 * lobe.ndf.peak() * visibility * visibility * fresnel / 65504.0
}

/// The largest error of f decoded from a 3D table at the probes of its materials, for both ways
/// to filter.
#[must_use]
pub fn measure(table: &Table, probes: &[Probe]) -> f64 {
    let Encoding::Times { factor } = table.encoding else { return f64::INFINITY };
    let error = |probe: &Probe| {
        let u = [
            table.coordinate(0, 0, probe.tan2_theta_h),
            table.coordinate(1, 0, probe.cos_theta_d),
            table.coordinate(2, 0, probe.abs_cos_phi_d()),
        ];
        let of = |filter: Filter| {
            let texel = table.fetch_3d(u, filter);
            let decoded = |c: usize| {
                let exact = &probe.exact[c];
                let brdf = factor[c] * f64::from(texel[c]);
                exact.error(exact.scale * probe.cos_theta[0] * probe.cos_theta[1] * brdf)
            };
            (0..3).map(decoded).fold(0.0, f64::max)
        };
        of(Filter::Fetched).max(of(Filter::Hardware))
    };
    probes.par_iter().map(error).reduce(|| 0.0, f64::max)
}

/// The smallest 3D table of a row that keeps `tolerance` at the probes.
///
/// # Derivation
///
/// Along each axis linear interpolation errs by c/n², c measured with that axis coarse and the
/// others fine. The product of the sizes under Σ c/n² = e is least where each axis takes e/3.
///
/// # Errors
///
/// [`BakeError::NotReached`] with the best error, where the largest table does not keep it.
pub fn smallest(
    row: &Row,
    index: usize,
    probes: &[Probe],
    tolerance: f64,
    depths: Depths,
) -> Result<Table, BakeError> {
    let aim = SEARCH_SHARE * tolerance;
    let expected: [f64; 3] = std::array::from_fn(|axis| {
        let error = measure(&tabulate(row, index, REFERENCE[axis], Depth::Float), probes);
        let cells = (REFERENCE[axis][axis] - 1) as f64;
        1.0 + cells * (3.0 * error / aim).sqrt()
    });
    let grown = |growth: f64| -> [usize; 3] {
        let end = |n: f64| n.ceil().clamp(*AXIS.start() as f64, *AXIS.end() as f64) as usize;
        expected.map(|n| end(n * growth))
    };
    let fits = |growth: &f64| grown(*growth).iter().product::<usize>() <= MOST_TEXELS;
    let mut growths = (0..200).map(|k| MOST_GROWTH * 0.95_f64.powi(k));
    let Some(largest) = growths.find(fits) else {
        return Err(BakeError::NotReached { tolerance, best: f64::INFINITY });
    };
    let mut best = f64::INFINITY;
    // Where the aim is out of reach the tolerance may not be: the verification will tell.
    let limits = [aim, tolerance].into_iter();
    for (limit, depth) in limits.flat_map(|e| depths.candidates().iter().map(move |d| (e, *d))) {
        let mut keeps = |growth: f64| {
            let table = tabulate(row, index, grown(growth), depth);
            let error = measure(&table, probes);
            best = best.min(error);
            (error <= limit).then_some(table)
        };
        if let Some(table) = least(largest, &mut keeps) {
            return Ok(table);
        }
    }
    Err(BakeError::NotReached { tolerance, best })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::catalog;
    use crate::microfacet::masking::MaskingKind;

    #[test]
    fn every_instruction_set_gives_the_same_texels() {
        for entry in catalog().iter().step_by(9) {
            let evaluator = |c| ChannelBrdf::with_accuracy(c, MaskingKind::Exact, 1e-8).tabulated();
            let channels = entry.material.channels.each_ref().map(evaluator);
            let row = Row::new("", &channels, [true, true, false]);
            let on = |set| tabulate_on(set, &row, 0, [70, 9, 5], Depth::Float).texels;
            let baseline = on(InstructionSet::Baseline);
            for set in InstructionSet::available() {
                assert!(on(set) == baseline, "{} on {}", entry.material.name, set.name());
            }
        }
    }
}
