//! The 3D table: the whole specular term of one material in Rusinkiewicz's angles.
//!
//! # Derivation
//!
//! An isotropic reciprocal reflectance depends on θh, θd and |cosφd| alone. The table holds, per
//! colour, B = Σ_lobes (ρs/Σρs)·F·D·(G1(wi)/cosθi)·(G1(wo)/cosθo), finite down to the horizon;
//! f = ρd/π + Σρs/π·B. Texels are B/q with q = Σ_lobes (ρs/Σρs)·4 D(0) v² max|F|/65504 (more where
//! D is largest off the normal) and v the largest G1/cosθ: the largest texel stays below what a half
//! float holds. With tanθh = √x,
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

use crate::brdf::{Lobe, SgdBrdf};
use crate::lut::attack::{attack, scatter};
use crate::lut::axis::{Axis, Variable, Warp};
use crate::lut::memory;
use crate::lut::probe::Probe;
use crate::lut::quantity::{Encoding, Quantity};
use crate::lut::range::VOLUME_WIDTHS;
use crate::lut::row::Row;
use crate::lut::search::Sizable;
use crate::lut::table::{Depth, ErrorNote, Filter, Table, Texels};
use crate::lut::term::{masking_scale, ndf_scale};
use crate::lut::visibility::Visibility;
use crate::lut::volume_lines::{ColourMatrix, HalfVectors, Line, Lines};
use crate::math::instruction_set::InstructionSet;
use crate::microfacet::Sgd;

/// Texels that a 3D table may have: 400 MB as half floats.
pub const MAX_TEXELS: usize = 1 << 26;
/// tan²θh/α at the end of the axis, where D is e^{−30} of its peak.
const END: f64 = 30.0;
/// Beyond so many times the expected size it is rounding, not size, that limits the error.
const MAX_GROWTH: f64 = 4.0;
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
    let max = row.visible().map(|lobe| END * lobe.distribution.alpha()).fold(0.0, f64::max);
    let half = Warp::Log1p { scale: vec![ndf_scale(row)], max: vec![max] };
    let difference = Warp::Log1p { scale: vec![masking_scale(row)], max: vec![1.0] };
    vec![
        Axis { variable: Variable::Tan2ThetaH, warp: Some(half) },
        Axis { variable: Variable::CosThetaD, warp: Some(difference) },
        Axis { variable: Variable::AbsCosPhiD, warp: Some(Warp::Identity) },
    ]
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
    let [tan2, cos_d, cos_phi] = [0, 1, 2].map(|axis| nodes(&axes[axis], size[axis]));
    let scales = row.lobes.each_ref().map(|lobe| lobe.as_ref().map_or(1.0, lobe_scale));
    let shares = [0, 1, 2].map(|c| row.shares(c));
    let factor: [f64; 3] = std::array::from_fn(|c| colour_factor(row, c, &shares[c]));
    // D/q of each lobe, with a q of its own, stays in the range of f32; the weights turn it into a
    // share of the colour's q.
    let weights = [0, 1, 2].map(|j| [0, 1, 2].map(|c| shares[c][j] * (scales[j] / factor[c])));
    let colours: Vec<ColourMatrix> =
        cos_d.iter().map(|cos| ColourMatrix::new(fresnel_columns(row, weights, *cos))).collect();
    let lines = Lines {
        half: HalfVectors::blocks(row, scales, &tan2),
        visibility: Visibility::new(row, masking_accuracy(depth)),
    };
    let texels = fill(size, depth, &|line, out: &mut [[f32; 3]]| {
        // Lines run along θh; then θd varies, and |cosφd| last.
        let (d, phi) = (line % size[1], line / size[1]);
        let sin_d = (1.0 - cos_d[d] * cos_d[d]).max(0.0).sqrt();
        let line = Line {
            cos_theta_d: cos_d[d] as f32,
            swing: (sin_d * cos_phi[phi]) as f32,
            colours: colours[d],
        };
        lines.fill_on(set.or_widest(), line, out);
    });
    Table {
        quantity: Quantity::Brdf3d,
        axes,
        size: size.to_vec(),
        encoding: Encoding::Times { factor },
        texels,
        rows: vec![row.name.clone()],
        row: Some(index),
        error: ErrorNote::default(),
    }
}

/// The variable of an axis at each of `count` texels.
fn nodes(axis: &Axis, count: usize) -> Vec<f64> {
    let warp = axis.warp.as_ref();
    let last = (count - 1) as f64;
    (0..count).map(|i| warp.map_or(0.0, |warp| warp.variable(0, i as f64 / last))).collect()
}

/// F of each lobe at cosθd, per colour, times its weight.
fn fresnel_columns(row: &Row, weights: [[f64; 3]; 3], cos_d: f64) -> [[f32; 3]; 3] {
    std::array::from_fn(|j| match &row.lobes[j] {
        Some(lobe) => [0, 1, 2].map(|c| (weights[j][c] * lobe.fresnel[c].eval(cos_d)) as f32),
        None => [0.0; 3],
    })
}

/// All texels, line by line in parallel, written once where they stay.
fn fill(size: [usize; 3], depth: Depth, line: &(impl Fn(usize, &mut [[f32; 3]]) + Sync)) -> Texels {
    let count = size.iter().product();
    match depth {
        // A request for 16-bit integers has been refused: this quantity does not fit a range.
        Depth::Float | Depth::Unorm16 => {
            let mut texels = vec![[0.0; 3]; count];
            let lines = texels.par_chunks_mut(size[0]).enumerate();
            lines.for_each(|(i, out)| line(i, out));
            Texels::Float(texels)
        }
        Depth::Half => {
            // The system hands out zeroed pages as the threads first write them.
            let mut texels: Vec<[f16; 3]> = bytemuck::zeroed_vec(count);
            let lines = texels.par_chunks_mut(size[0]).enumerate();
            lines.for_each_init(
                || vec![[0.0; 3]; size[0]],
                |single, (i, out)| {
                    line(i, single);
                    // Vector instructions convert a whole line at a time.
                    out.as_flattened_mut().convert_from_f32_slice(single.as_flattened());
                },
            );
            Texels::Half(texels)
        }
    }
}

/// 4 D(0) v² max|F|/65504 of a lobe, over the colours that it reflects.
fn lobe_scale(lobe: &Lobe<Sgd>) -> f64 {
    let colours = (0..3).filter(|c| lobe.rho_s[*c] > 0.0);
    let fresnel = colours.map(|c| lobe.fresnel[c].max_magnitude()).fold(0.0, f64::max);
    // A lobe without any Fresnel term must not be divided by 0.
    largest_product(lobe) * if fresnel > 0.0 { fresnel } else { 1.0 }
}

/// 4 D(0) v²/65504 with v the largest G1/cosθ, its limit at grazing or, of very rough lobes, its 1
/// at the normal; 3 times the largest D where that is more.
fn largest_product(lobe: &Lobe<Sgd>) -> f64 {
    const GRAZING: f64 = 1e-12;
    let visibility = f64::max(lobe.g1(GRAZING) / GRAZING, 1.0);
    let room = f64::max(4.0, 3.0 * largest_density(lobe.distribution.alpha()));
    room * lobe.distribution.peak() * visibility * visibility / 65504.0
}

/// D/D(0) at most: the power law falls, and e^{−x/α} (1+x)² is largest at x = 2α − 1.
fn largest_density(alpha: f64) -> f64 {
    if alpha > 0.5 { 4.0 * alpha * alpha * (1.0 / alpha - 2.0).exp() } else { 1.0 }
}

/// q of a colour: the value that a texel of 1 stands for.
fn colour_factor(row: &Row, c: usize, shares: &[f64; 3]) -> f64 {
    let lobes =
        row.lobes.iter().zip(shares).filter_map(|(lobe, share)| Some((lobe.as_ref()?, share)));
    let products = lobes
        .map(|(lobe, share)| share * (largest_product(lobe) * lobe.fresnel[c].max_magnitude()));
    let factor: f64 = products.sum();
    if factor > 0.0 { factor } else { 1.0 }
}

/// The largest error of f decoded from a 3D table at the probes of its materials, for both ways
/// to filter.
#[must_use]
pub fn measure(table: &Table, probes: &[Probe]) -> f64 {
    let Encoding::Times { factor } = table.encoding else { return f64::INFINITY };
    probes.par_iter().map(|probe| probe_error(table, factor, probe)).reduce(|| 0.0, f64::max)
}

fn probe_error(table: &Table, factor: [f64; 3], probe: &Probe) -> f64 {
    let angles = &probe.angles;
    let u = [
        table.coordinate(0, 0, angles.tan2_h),
        table.coordinate(1, 0, angles.cos_d),
        table.coordinate(2, 0, probe.abs_cos_phi_d),
    ];
    // Σρs/(π cosθo) per colour.
    let scale = [0, 1, 2].map(|c| probe.lobes.iter().map(|lobe| lobe.scale[c]).sum::<f64>());
    // f cosθi = Σρs/π · B · cosθi, and `scale` is over cosθo.
    let mut largest: f64 = 0.0;
    for filter in Filter::COVERED {
        let texel = table.fetch_3d(u, filter);
        for (c, exact) in probe.colours.iter().enumerate() {
            let brdf = factor[c] * f64::from(texel[c]);
            largest = largest.max(exact.error(scale[c] * angles.cos[0] * angles.cos[1] * brdf));
        }
    }
    largest
}

/// The probes at which climbs from the worst few of `probes` end.
#[must_use]
pub fn attacked<'a>(
    table: &Table,
    brdf: &SgdBrdf,
    probes: impl Iterator<Item = &'a Probe>,
) -> Vec<Probe> {
    const CLIMBS: usize = 8;
    const MOVES: u32 = 600;
    let mut starts: Vec<(f64, &Probe)> =
        probes.map(|probe| (error_at(table, probe), probe)).collect();
    // A stable sort: equal errors keep their order, and the table its bytes.
    starts.sort_by(|a, b| b.0.total_cmp(&a.0));
    starts.truncate(CLIMBS);
    let climbs = starts.into_par_iter().map(|(_, start)| {
        let (_, probe) = attack(brdf, start, |probe| error_at(table, probe));
        scatter(brdf, None, &probe, MOVES, |probe| error_at(table, probe)).1
    });
    climbs.collect()
}

/// The largest error at one probe.
fn error_at(table: &Table, probe: &Probe) -> f64 {
    measure(table, std::slice::from_ref(probe))
}

/// The 3D table of a row, in search of its size.
pub struct Volume<'a> {
    row: &'a Row,
    index: usize,
    /// The sizes at which interpolation alone would keep the aim.
    expected: [f64; 3],
}

impl<'a> Volume<'a> {
    /// The table of a row, of a size about right for `tolerance` at the probes.
    ///
    /// # Derivation
    ///
    /// Along each axis linear interpolation errs by c/n², c measured with that axis coarse and the
    /// others fine. The product of the sizes under Σ c/n² = e is least where each axis takes e/3.
    #[must_use]
    pub fn new(row: &'a Row, index: usize, probes: &[Probe], tolerance: f64) -> Self {
        let aim = Self::AIMS[0] * tolerance;
        let expected = std::array::from_fn(|axis| {
            // Floats, so that c is of interpolation alone.
            let error = measure(&tabulate(row, index, REFERENCE[axis], Depth::Float), probes);
            let cells = (REFERENCE[axis][axis] - 1) as f64;
            1.0 + cells * (3.0 * error / aim).sqrt()
        });
        Self { row, index, expected }
    }

    fn grown(&self, growth: f64) -> [usize; 3] {
        let [low, high] = [*VOLUME_WIDTHS.start(), *VOLUME_WIDTHS.end()].map(|n| n as f64);
        self.expected.map(|n| (n * growth).ceil().clamp(low, high) as usize)
    }
}

impl Sizable for Volume<'_> {
    type Tables = Table;
    type Probe = Probe;
    // Cells are many, so probes miss the worst by more than in 2D. Where the first aim is out of
    // reach the tolerance may not be: the verification tells.
    const AIMS: &'static [f64] = &[0.8, 1.0];

    fn largest_growth(&self) -> Option<f64> {
        // Downwards in steps of 5 % to the first that fits.
        let mut growths = (0..200).map(|k| MAX_GROWTH * 0.95_f64.powi(k));
        growths.find(|growth| self.grown(*growth).iter().product::<usize>() <= MAX_TEXELS)
    }

    fn bytes(&self, growth: f64, depth: Depth) -> usize {
        memory::of_texture(&self.grown(growth), depth)
    }

    fn build(&self, growth: f64, depth: Depth) -> Table {
        tabulate(self.row, self.index, self.grown(growth), depth)
    }

    fn measure(&self, table: &Table, probes: &[Probe]) -> f64 {
        measure(table, probes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::MaskingKind;
    use crate::lut::row::Rows;
    use crate::material::catalog;
    use crate::microfacet::Accuracy;

    #[test]
    fn every_instruction_set_gives_the_same_texels() {
        for entry in catalog().iter().step_by(9) {
            let kind = MaskingKind::Exact;
            let brdf = SgdBrdf::with_accuracy(&entry.material, kind, Accuracy::Table).tabulated();
            let mut rows = Rows::default();
            rows.push("", &brdf, [true, true, false]);
            let sets = std::iter::once(InstructionSet::Baseline).chain(InstructionSet::available());
            let texels: Vec<Texels> = sets
                .map(|set| tabulate_on(set, &rows.lobes[0], 0, [70, 9, 5], Depth::Float).texels)
                .collect();
            assert!(texels.windows(2).all(|pair| pair[0] == pair[1]), "{}", entry.material.name);
        }
    }
}
