//! The albedo table: what share of the light a surface's specular term reflects, in three terms
//! from which any Fresnel curve's share follows.
//!
//! # Formula
//!
//! ```text
//! moment_φ(θo) = ∫ φ(cosθd) D G1(wi) G1(wo)/(4 cosθi cosθo) cosθi dωi,  φ = 1, (1−cosθd)⁵, cosθd
//! ∫ f_specular cosθi dωi = 4ρs/π · [f0·one + (1−f0)·schlick − f1·cosine]
//! ```
//!
//! A material takes three rows of the texture, 3·row + 0, 1, 2 for one, schlick, cosine.

use rayon::prelude::*;

use crate::brdf::batch::albedo::AlbedoBatch;
use crate::brdf::{ChannelBrdf, FresnelMoments};
use crate::lut::axis::{Axis, Variable, Warp};
use crate::lut::bake::{BakeError, Depths, WIDTHS};
use crate::lut::budget::least;
use crate::lut::quantity::{Encoding, Quantity};
use crate::lut::row::Row;
use crate::lut::table::{Depth, ErrorNote, Filter, Table, Texels};
use crate::lut::term::masking_scale;

/// Rows per material.
pub const TERMS: usize = 3;
/// Points per row at which a table is held against quadrature.
const CHECKS: usize = 64;
/// cosθo of the first texel: the moments are 0 at the horizon itself, their limit is not.
const GRAZING: f64 = 1e-6;

/// Quadrature values of all rows along u, which no size changes.
pub struct Checks {
    u: Vec<f64>,
    moments: Vec<Vec<[[f64; 3]; TERMS]>>,
}

impl Checks {
    /// The moments at points that are no texel centres of any small table.
    #[must_use]
    pub fn new(rows: &[Row]) -> Self {
        let u: Vec<f64> =
            (0..CHECKS).map(|k| (k as f64 + 0.618_033_988_75) / (CHECKS + 1) as f64).collect();
        let axis = axis(rows);
        let moments = (0..rows.len())
            .into_par_iter()
            .map(|row| moments(&rows[row], &cosines(&axis, row, u.iter().copied()), Rule::Exact))
            .collect();
        Self { u, moments }
    }

    /// The largest difference of a decoded moment, for both ways to filter.
    #[must_use]
    pub fn measure(&self, table: &Table) -> f64 {
        let mut worst: f64 = 0.0;
        for (row, exact) in self.moments.iter().enumerate() {
            for (u, exact) in self.u.iter().zip(exact) {
                for (term, exact) in exact.iter().enumerate() {
                    for filter in [Filter::Fetched, Filter::Hardware] {
                        let texel = table.fetch(TERMS * row + term, *u as f32, filter);
                        for c in 0..3 {
                            worst = worst.max((f64::from(texel[c]) - exact[c]).abs());
                        }
                    }
                }
            }
        }
        worst
    }
}

/// The smallest albedo table whose moments are within `tolerance` of quadrature.
///
/// # Errors
///
/// [`BakeError::NotReached`] with the best error, where the widest table is not.
pub fn smallest(
    rows: &[Row],
    checks: &Checks,
    tolerance: f64,
    depths: Depths,
) -> Result<Table, BakeError> {
    const REFERENCE_WIDTH: usize = 33;
    let reference = checks.measure(&filled(rows, REFERENCE_WIDTH, Depth::Float, Rule::Quick));
    let expected = 1.0 + (REFERENCE_WIDTH - 1) as f64 * (reference / tolerance).sqrt();
    let mut best = f64::INFINITY;
    for depth in depths.candidates() {
        let mut keeps = |growth: f64| {
            let width = ((expected * growth).ceil() as usize).clamp(*WIDTHS.start(), *WIDTHS.end());
            let table = tabulate(rows, width, *depth);
            let error = checks.measure(&table);
            best = best.min(error);
            (error <= 0.9 * tolerance).then_some(table)
        };
        if let Some(table) = least(8.0, &mut keeps) {
            return Ok(table);
        }
    }
    Err(BakeError::NotReached { tolerance, best })
}

/// The albedo table of all rows, `width` texels along cosθo.
#[must_use]
pub fn tabulate(rows: &[Row], width: usize, depth: Depth) -> Table {
    filled(rows, width, depth, Rule::of(depth))
}

fn filled(rows: &[Row], width: usize, depth: Depth, rule: Rule) -> Table {
    let axis = axis(rows);
    let columns = || (0..width).map(|i| i as f64 / (width - 1) as f64);
    let lines = |(index, row)| {
        let columns = moments(row, &cosines(&axis, index, columns()), rule);
        (0..TERMS).flat_map(move |term| columns.clone().into_iter().map(move |c| c[term]))
    };
    let texels: Vec<[f64; 3]> = rows.par_iter().enumerate().flat_map_iter(lines).collect();
    let thrice = |scale: &Vec<f64>| scale.iter().flat_map(|s| [*s; TERMS]).collect();
    let warp = match &axis {
        Warp::Log1p { scale, max } => Warp::Log1p { scale: thrice(scale), max: thrice(max) },
        other => other.clone(),
    };
    Table {
        quantity: Quantity::Albedo,
        axes: vec![Axis { variable: Variable::CosThetaO, warp: Some(warp) }, Axis::ROW],
        size: vec![width, TERMS * rows.len()],
        encoding: Encoding::Identity,
        texels: Texels::rounded(depth, &texels),
        rows: rows.iter().flat_map(|row| std::iter::repeat_n(row.name.clone(), TERMS)).collect(),
        row: None,
        error: ErrorNote::default(),
    }
}

/// cosθo against its logarithm from where masking sets in.
fn axis(rows: &[Row]) -> Warp {
    Warp::Log1p { scale: rows.iter().map(masking_scale).collect(), max: vec![1.0; rows.len()] }
}

/// How the moments of a texel are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rule {
    /// [`FresnelMoments`].
    Exact,
    /// [`AlbedoBatch`], for half floats: its error is below their rounding.
    Quick,
}

impl Rule {
    fn of(depth: Depth) -> Self {
        match depth {
            Depth::Half => Self::Quick,
            Depth::Unorm16 | Depth::Float => Self::Exact,
        }
    }

    /// The moments of a lobe at each cosθo.
    fn moments(self, lobe: &ChannelBrdf, cosines: &[f64]) -> Vec<FresnelMoments> {
        let exact = |cos: &f64| FresnelMoments::new(&lobe.ndf, &lobe.masking, *cos);
        match self {
            Self::Exact => cosines.par_iter().map(exact).collect(),
            Self::Quick => AlbedoBatch::new(&lobe.ndf, &lobe.masking).moments(cosines),
        }
    }
}

/// cosθo at coordinates of a row.
fn cosines(axis: &Warp, row: usize, u: impl Iterator<Item = f64>) -> Vec<f64> {
    u.map(|u| axis.variable(row, u).clamp(GRAZING, 1.0)).collect()
}

/// The three moments of a row at each cosθo, per channel.
fn moments(row: &Row, cosines: &[f64], rule: Rule) -> Vec<[[f64; 3]; TERMS]> {
    let absent = || vec![FresnelMoments::default(); cosines.len()];
    let of_lobe = |lobe: &Option<ChannelBrdf>| {
        lobe.as_ref().map_or_else(absent, |lobe| rule.moments(lobe, cosines))
    };
    let channels: Vec<Vec<FresnelMoments>> = row.lobes.par_iter().map(of_lobe).collect();
    let at = |i: usize| {
        let moments: [FresnelMoments; 3] = std::array::from_fn(|c| channels[c][i]);
        [moments.map(|m| m.one), moments.map(|m| m.schlick), moments.map(|m| m.cosine)]
    };
    (0..cosines.len()).map(at).collect()
}
