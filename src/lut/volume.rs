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

use half::f16;
use rayon::prelude::*;

use crate::brdf::ChannelBrdf;
use crate::lut::axis::{Axis, Variable, Warp};
use crate::lut::bake::{BakeError, Depths};
use crate::lut::budget::least;
use crate::lut::probe::Probe;
use crate::lut::quantity::{Encoding, Quantity};
use crate::lut::row::Row;
use crate::lut::table::{Depth, ErrorNote, Filter, Table, Texels};
use crate::lut::term::{Term, masking_scale, ndf_scale};

/// Texels along an axis.
pub const AXIS: std::ops::RangeInclusive<usize> = 2..=512;
/// Texels that a 3D table may have: 400 MB as half floats.
pub const MOST_TEXELS: usize = 1 << 26;
/// tan²θh/α at the end of the axis, where D is e^{−30} of its peak.
const END: f64 = 30.0;
/// Below the horizon G1/cosθ continues as far as this many scales.
const BELOW_HORIZON: f32 = 2.0;
/// What a search aims at: cells are many, so probes miss the worst by more than in 2D.
const SEARCH_SHARE: f64 = 0.8;
/// Nodes of the hoisted masking table.
const NODES: usize = 4096;
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

/// A channel with what its texels share worked out beforehand.
struct Hoisted {
    /// D/q along the first axis.
    ndf: Vec<f32>,
    /// F along the second.
    fresnel: Vec<f32>,
    visibility: Visibility,
}

/// v(θ) = G1/cosθ in single precision, from G1/u at even steps of u = cosθ/(cosθ + s sinθ).
struct Visibility {
    scale: f32,
    ratios: Vec<f32>,
    /// d ln v/d cosθ at the horizon.
    slope: f32,
}

impl Visibility {
    fn new(lobe: &ChannelBrdf, scale: f64) -> Self {
        let warp = Warp::Rational { scale: vec![scale] };
        let ratio = |i: usize| {
            let u = i as f64 / (NODES - 1) as f64;
            Term::Masking.texel(lobe, &warp, 0, u).exp() as f32
        };
        let ratios: Vec<f32> = (0..NODES).map(ratio).collect();
        let rise = (ratios[1] / ratios[0] - 1.0) * (NODES - 1) as f32;
        let scale = scale as f32;
        Self { slope: (rise - 1.0) / scale, scale, ratios }
    }

    /// G1/cosθ, continued below the horizon.
    fn at(&self, cos_theta: f32) -> f32 {
        if cos_theta <= 0.0 {
            let below = cos_theta.max(-BELOW_HORIZON * self.scale);
            return self.ratios[0] / self.scale * (self.slope * below).exp();
        }
        let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
        let inv = 1.0 / (cos_theta + self.scale * sin_theta);
        let position = cos_theta * inv * (NODES - 1) as f32;
        let left = (position as usize).min(NODES - 2);
        let weight = position - left as f32;
        inv * (self.ratios[left] + (self.ratios[left + 1] - self.ratios[left]) * weight)
    }
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
    let hoisted: [Option<Hoisted>; 3] = std::array::from_fn(|c| {
        row.lobes[c].as_ref().map(|lobe| hoist(lobe, masking_scale(row), factor[c], &tan2, &cos_d))
    });
    let half_vectors: Vec<(f32, f32)> = tan2
        .iter()
        .map(|x| ((1.0 / (1.0 + x).sqrt()) as f32, (x / (1.0 + x)).sqrt() as f32))
        .collect();
    let line = |line: usize, texel: &mut dyn FnMut(usize, [f32; 3])| {
        let (d, phi) = (line % size[1], line / size[1]);
        let cos_theta_d = cos_d[d] as f32;
        let swing = ((1.0 - cos_d[d] * cos_d[d]).max(0.0).sqrt() * cos_phi[phi]) as f32;
        for (h, (cos_h, sin_h)) in half_vectors.iter().enumerate() {
            let (middle, reach) = (cos_h * cos_theta_d, sin_h * swing);
            texel(
                h,
                hoisted.each_ref().map(|channel| {
                    channel.as_ref().map_or(0.0, |channel| {
                        let v = channel.visibility.at(middle - reach)
                            * channel.visibility.at(middle + reach);
                        channel.ndf[h] * channel.fresnel[d] * v
                    })
                }),
            );
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
fn fill(
    size: [usize; 3],
    depth: Depth,
    line: &(impl Fn(usize, &mut dyn FnMut(usize, [f32; 3])) + Sync),
) -> Texels {
    let count = size.iter().product();
    match depth {
        Depth::Float | Depth::Unorm16 => {
            let mut texels = vec![[0.0; 3]; count];
            let lines = texels.par_chunks_mut(size[0]).enumerate();
            lines.for_each(|(i, out)| line(i, &mut |h, rgb| out[h] = rgb));
            Texels::Float(texels)
        }
        Depth::Half => {
            let mut texels = vec![[f16::ZERO; 3]; count];
            let lines = texels.par_chunks_mut(size[0]).enumerate();
            lines.for_each(|(i, out)| line(i, &mut |h, rgb| out[h] = rgb.map(f16::from_f32)));
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

fn hoist(lobe: &ChannelBrdf, scale: f64, factor: f64, tan2: &[f64], cos_d: &[f64]) -> Hoisted {
    let last = tan2.len() - 1;
    // The last texel closes the table with an exact 0.
    let ndf = |(i, x): (usize, &f64)| if i == last { 0.0 } else { lobe.ndf.eval(*x) / factor };
    Hoisted {
        ndf: tan2.iter().enumerate().map(|x| ndf(x) as f32).collect(),
        fresnel: cos_d.iter().map(|c| lobe.fresnel.eval(*c) as f32).collect(),
        visibility: Visibility::new(lobe, scale),
    }
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
