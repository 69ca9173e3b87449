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
//! A cell at the horizon has corners where cosθi < 0; there G1/cosθ continues along the tangent
//! of its logarithm, so that interpolation stays smooth up to the horizon.

use glam::{Vec3, Vec4};
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

/// Texels along an axis.
pub const AXIS: std::ops::RangeInclusive<usize> = 2..=512;
/// Texels that a 3D table may have: 400 MB as half floats.
pub const MOST_TEXELS: usize = 1 << 26;
/// tan²θh/α at the end of the axis, where D is e^{−30} of its peak.
const END: f64 = 30.0;
/// Below the horizon G1/cosθ continues as far as this many scales.
const BELOW_HORIZON: f32 = 2.0;
/// Texels of a line whose places are worked out together, in vector instructions.
const BLOCK: usize = 64;
/// What a search aims at: cells are many, so probes miss the worst by more than in 2D.
const SEARCH_SHARE: f64 = 0.8;
/// Nodes of the masking table from the horizon to the zenith.
const NODES: usize = 1024;
/// The sizes of the tables, one axis coarse each, that tell how fast an axis converges.
const REFERENCE: [[usize; 3]; 3] = [[33, 129, 65], [129, 33, 65], [129, 129, 17]];

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

/// v = G1/cosθ of the three channels in single precision.
///
/// # Formula
///
/// With c = cosθ and s the masking's scale, v·(c + s) is smooth in u = c/(c + s) from the horizon
/// to the zenith and is tabulated over even steps of u. Below the horizon u = c/s, and v·s
/// continues along the tangent of its logarithm. No fused or approximate operation takes part: the
/// bits are those of every instruction set.
struct Visibility {
    scale: f32,
    /// Nodes per unit of u.
    density: f32,
    /// Where the horizon's node stands.
    horizon: f32,
    /// The least cosθ that the table reaches.
    lowest: f32,
    /// v·(c + s) from u = −[`BELOW_HORIZON`] up, and its rise to the next node.
    nodes: Vec<[Vec4; 2]>,
}

impl Visibility {
    fn new(row: &Row) -> Self {
        let scale = masking_scale(row);
        // The last node stands at the zenith, u = 1/(1 + s).
        let density = (NODES - 1) as f64 * (1.0 + scale);
        // One more node below keeps every position above ½.
        let below = (f64::from(BELOW_HORIZON) * density).ceil() as usize + 1;
        let of_channel = |lobe: &Option<ChannelBrdf>| {
            let ratio = |u: f64| lobe.as_ref().map_or(0.0, |lobe| ratio(lobe, scale, u));
            let above: Vec<f64> = (0..NODES).map(|k| ratio(k as f64 / density)).collect();
            let slope = (above[1] / above[0] - 1.0).max(-1.0) * density - 1.0;
            let tangent = |k: usize| above[0] * (-slope * k as f64 / density).exp();
            (1..=below).rev().map(tangent).chain(above.iter().copied()).collect::<Vec<f64>>()
        };
        let channels: Vec<Vec<f64>> = row.lobes.par_iter().map(of_channel).collect();
        let node = |k: usize| packed(std::array::from_fn(|c| channels[c][k]));
        let last = below + NODES - 1;
        Self {
            scale: scale as f32,
            density: density as f32,
            horizon: below as f32,
            lowest: -BELOW_HORIZON * scale as f32,
            nodes: (0..=last).map(|k| [node(k), node((k + 1).min(last)) - node(k)]).collect(),
        }
    }

    /// Where v(wi)·v(wo) is found for cosθi, cosθo = middle ∓ reach.
    #[inline(always)]
    fn places(&self, middle: &Lanes, reach: &Lanes) -> Places {
        let mut places = Places::default();
        for k in 0..BLOCK {
            let (cos_i, cos_o) = (middle[k] - reach[k], middle[k] + reach[k]);
            let cos_i = if cos_i > self.lowest { cos_i } else { self.lowest };
            let above = if cos_i > 0.0 { cos_i } else { 0.0 };
            let (length_i, length_o) = (above + self.scale, cos_o + self.scale);
            places.inverse[k] = 1.0 / (length_i * length_o);
            let u = [cos_i * length_o, cos_o * length_i].map(|u| u * places.inverse[k]);
            for (direction, u) in u.into_iter().enumerate() {
                let position = u * self.density + self.horizon;
                let rounded = (position - 0.5) + ROUNDER;
                places.left[direction][k] = rounded.to_bits().wrapping_sub(ROUNDER.to_bits());
                places.weight[direction][k] = position - (rounded - ROUNDER);
            }
        }
        places
    }

    /// v(wi)·v(wo) at a place.
    #[inline(always)]
    fn product(&self, places: &Places, k: usize) -> Vec4 {
        let ratio = |direction: usize| {
            let left = places.left[direction][k] as usize;
            let [value, rise] = self.nodes[left.min(self.nodes.len() - 1)];
            value + rise * places.weight[direction][k]
        };
        ratio(0) * ratio(1) * places.inverse[k]
    }
}

/// Adding 2²³ rounds to an integer, which then stands in the low bits.
const ROUNDER: f32 = 8_388_608.0;

type Lanes = [f32; BLOCK];

/// Where a block of texels is found in the masking table: for both directions the node to the left
/// and the weight of the right one, and 1/((cosθi + s)(cosθo + s)).
struct Places {
    left: [[u32; BLOCK]; 2],
    weight: [Lanes; 2],
    inverse: Lanes,
}

impl Default for Places {
    fn default() -> Self {
        let empty = [0.0; BLOCK];
        Self { left: [[0; BLOCK]; 2], weight: [empty; 2], inverse: empty }
    }
}

/// v·(c + s) of a channel at u = c/(c + s), as far as the zenith.
fn ratio(lobe: &ChannelBrdf, s: f64, u: f64) -> f64 {
    const GRAZING: f64 = 1e-12;
    let c = (s * u / (1.0 - u).max(f64::MIN_POSITIVE)).clamp(GRAZING * s, 1.0);
    let sin = ((1.0 - c) * (1.0 + c)).sqrt();
    lobe.masking.g1(c / sin) * (c + s) / c
}

/// The three channels in the lanes of one vector.
fn packed(rgb: [f64; 3]) -> Vec4 {
    Vec3::from(rgb.map(|x| x as f32)).extend(0.0)
}

/// What the texels at each step of the first axis share.
struct HalfVectors {
    /// cosθh and sinθh, in full blocks.
    cos: Vec<Lanes>,
    sin: Vec<Lanes>,
    /// D/q.
    ndf: Vec<Vec4>,
}

impl HalfVectors {
    fn new(row: &Row, factor: [f64; 3], tan2: &[f64]) -> Self {
        let blocks = |of: &dyn Fn(f64) -> f64| -> Vec<Lanes> {
            let lanes = |block: &[f64]| -> Lanes {
                std::array::from_fn(|k| block.get(k).map_or(0.0, |x| of(*x) as f32))
            };
            tan2.chunks(BLOCK).map(lanes).collect()
        };
        // The last texel closes the table with an exact 0.
        let (_, inner) = tan2.split_last().unwrap_or((&0.0, &[]));
        let ndf = |x: &f64| packed(per_channel(row, |c, lobe| lobe.ndf.eval(*x) / factor[c]));
        Self {
            cos: blocks(&|x| 1.0 / (1.0 + x).sqrt()),
            sin: blocks(&|x| (x / (1.0 + x)).sqrt()),
            ndf: inner.iter().map(ndf).chain([Vec4::ZERO]).collect(),
        }
    }
}

/// A value of each stored lobe, 0 for a channel without one.
fn per_channel(row: &Row, value: impl Fn(usize, &ChannelBrdf) -> f64) -> [f64; 3] {
    std::array::from_fn(|c| row.lobes[c].as_ref().map_or(0.0, |lobe| value(c, lobe)))
}

/// The 3D table of a row with the given texels along each axis.
#[must_use]
pub fn tabulate(row: &Row, index: usize, size: [usize; 3], depth: Depth) -> Table {
    let axes = axes(row);
    let along = |axis: usize| -> Vec<f64> {
        let warp = axes[axis].warp.as_ref();
        let last = (size[axis] - 1) as f64;
        (0..size[axis]).map(|i| warp.map_or(0.0, |w| w.variable(0, i as f64 / last))).collect()
    };
    let [tan2, cos_d, cos_phi] = [0, 1, 2].map(along);
    let factor = row.lobes.each_ref().map(|lobe| lobe.as_ref().map_or(1.0, factor));
    let half = HalfVectors::new(row, factor, &tan2);
    let fresnel = |cos: &f64| packed(per_channel(row, |_, lobe| lobe.fresnel.eval(*cos)));
    let fresnel: Vec<Vec4> = cos_d.iter().map(fresnel).collect();
    let visibility = Visibility::new(row);
    let line = |line: usize, out: &mut [[f32; 3]]| {
        let (d, phi) = (line % size[1], line / size[1]);
        let cos_theta_d = cos_d[d] as f32;
        let swing = ((1.0 - cos_d[d] * cos_d[d]).max(0.0).sqrt() * cos_phi[phi]) as f32;
        let fresnel = fresnel[d];
        for (block, (cos, sin)) in half.cos.iter().zip(&half.sin).enumerate() {
            let (middle, reach) = (cos.map(|c| c * cos_theta_d), sin.map(|s| s * swing));
            let places = visibility.places(&middle, &reach);
            let texels = out.iter_mut().zip(&half.ndf).skip(block * BLOCK).take(BLOCK);
            for (k, (texel, ndf)) in texels.enumerate() {
                let brdf = *ndf * fresnel * visibility.product(&places, k);
                *texel = brdf.truncate().to_array();
            }
        }
    };
    Table {
        quantity: Quantity::Brdf3d,
        axes,
        size: size.to_vec(),
        encoding: Encoding::Times { factor },
        texels: fill(size, depth, &line),
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
            let mut texels = vec![[f16::ZERO; 3]; count];
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
    let mut best = f64::INFINITY;
    for depth in depths.candidates() {
        let mut keeps = |growth: f64| {
            let size = expected.map(|n| {
                (n * growth).ceil().clamp(*AXIS.start() as f64, *AXIS.end() as f64) as usize
            });
            if size.iter().product::<usize>() > MOST_TEXELS {
                return None;
            }
            let table = tabulate(row, index, size, *depth);
            let error = measure(&table, probes);
            best = best.min(error);
            (error <= aim).then_some(table)
        };
        if let Some(table) = least(4.0, &mut keeps) {
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
    fn the_masking_table_errs_less_than_half_floats_round() {
        let mut worst: f64 = 0.0;
        for entry in catalog() {
            let evaluator = |c| ChannelBrdf::with_accuracy(c, MaskingKind::Exact, 1e-8).tabulated();
            let channels = entry.material.channels.each_ref().map(evaluator);
            let visibility = Visibility::new(&Row::new("", &channels, [true; 3]));
            let middle: Lanes = std::array::from_fn(|k| 0.5 * (-(k as f32) / 10.0).exp());
            let reach = middle.map(|m| m * (8.0 * std::f32::consts::PI * m).cos().abs());
            let places = visibility.places(&middle, &reach);
            for k in 0..BLOCK {
                let cos =
                    [middle[k] - reach[k], middle[k] + reach[k]].map(|c| f64::from(c).min(1.0));
                let table = visibility.product(&places, k).to_array();
                let v = |c: usize, cos: f64| {
                    let cos = cos.max(1e-12);
                    channels[c].masking.g1(cos / ((1.0 - cos) * (1.0 + cos)).sqrt()) / cos
                };
                let error = |c| f64::from(table[c]) / (v(c, cos[0]) * v(c, cos[1])) - 1.0;
                worst = (0..3).map(error).fold(worst, |worst, error| worst.max(error.abs()));
            }
        }
        assert!(worst < 2e-5, "{worst:e}");
    }
}
