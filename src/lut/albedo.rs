//! The albedo table: the share of the light that a surface's specular term reflects, in three terms
//! from which the share of any Fresnel curve follows.
//!
//! # Formula
//!
//! ```text
//! moment_φ(θo) = ∫ φ(cosθd) D G1(wi) G1(wo)/(4 cosθi cosθo) cosθi dωi,  φ = 1, (1−cosθd)⁵, cosθd
//! ∫ f_specular cosθi dωi = Σ_lobes 4ρs/π · [f0·one + (1−f0)·schlick − f1·cosine]
//! ```
//!
//! A material takes three rows of the texture, 3·row + 0, 1, 2 for one, schlick, cosine.

use rayon::prelude::*;

use crate::brdf::batch::albedo::AlbedoBatch;
use crate::brdf::{FresnelMoments, Lobe};
use crate::lut::axis::{Axis, Variable, Warp};
use crate::lut::quantity::{Encoding, Quantity};
use crate::lut::range::WIDTHS;
use crate::lut::row::Row;
use crate::lut::search::Sizable;
use crate::lut::table::{Depth, ErrorNote, Filter, Table, Texels};
use crate::lut::term::masking_scale;
use crate::microfacet::Sgd;

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
    /// The moments at points that are not texel centres of any small table.
    #[must_use]
    pub fn new(rows: &[Row]) -> Self {
        // The golden ratio is irrational: no point is a fraction i/(n − 1), a texel centre.
        let u: Vec<f64> =
            (0..CHECKS).map(|k| (k as f64 + 0.618_033_988_75) / (CHECKS + 1) as f64).collect();
        let warp = warp(rows);
        let moments = (0..rows.len())
            .into_par_iter()
            // By quadrature, so that the quick rule's error counts in that of a half table.
            .map(|row| moments(&rows[row], &cosines(&warp, row, u.iter().copied()), Rule::Exact))
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

/// The albedo table of some rows, in search of its width.
pub struct Albedo<'a> {
    rows: &'a [Row],
    checks: &'a Checks,
    /// The width at which interpolation alone would keep the tolerance.
    width: f64,
}

impl<'a> Albedo<'a> {
    /// The table of `rows`, of a width about right for `tolerance`.
    #[must_use]
    pub fn new(rows: &'a [Row], checks: &'a Checks, tolerance: f64) -> Self {
        // Linear interpolation errs by c/(n − 1)²; c is measured in floats, free of rounding.
        const REFERENCE_WIDTH: usize = 33;
        let reference = checks.measure(&filled(rows, REFERENCE_WIDTH, Depth::Float, Rule::Quick));
        let width = 1.0 + (REFERENCE_WIDTH - 1) as f64 * (reference / tolerance).sqrt();
        Self { rows, checks, width }
    }
}

impl Sizable for Albedo<'_> {
    type Tables = Table;
    type Probe = ();
    // The rest is for the places between the checks, where the error may be a little larger.
    const AIMS: &'static [f64] = &[0.9];

    fn largest_growth(&self) -> Option<f64> {
        // Beyond that it is rounding, not width, that limits the error.
        Some(8.0)
    }

    fn build(&self, growth: f64, depth: Depth) -> Table {
        let width = (self.width * growth).ceil() as usize;
        tabulate(self.rows, width.clamp(*WIDTHS.start(), *WIDTHS.end()), depth)
    }

    fn measure(&self, table: &Table, _: &[()]) -> f64 {
        self.checks.measure(table)
    }
}

/// The albedo table of all rows, `width` texels along cosθo.
#[must_use]
pub fn tabulate(rows: &[Row], width: usize, depth: Depth) -> Table {
    filled(rows, width, depth, Rule::of(depth))
}

fn filled(rows: &[Row], width: usize, depth: Depth, rule: Rule) -> Table {
    let warp = warp(rows);
    let texels: Vec<[f64; 3]> = rows
        .par_iter()
        .enumerate()
        .flat_map_iter(|(index, row)| {
            // u = 0 and u = 1 are the centres of the first and the last texel.
            let u = (0..width).map(|i| i as f64 / (width - 1) as f64);
            term_by_term(moments(row, &cosines(&warp, index, u), rule))
        })
        .collect();
    Table {
        quantity: Quantity::Albedo,
        axes: vec![
            Axis { variable: Variable::CosThetaO, warp: Some(for_each_term(&warp)) },
            Axis::ROW,
        ],
        size: vec![width, TERMS * rows.len()],
        encoding: Encoding::Identity,
        texels: Texels::rounded(depth, &texels),
        rows: rows.iter().flat_map(|row| std::iter::repeat_n(row.name.clone(), TERMS)).collect(),
        row: None,
        error: ErrorNote::default(),
    }
}

/// The texels of a row's moments: every column of the first term, then of the second and third.
fn term_by_term(columns: Vec<[[f64; 3]; TERMS]>) -> impl Iterator<Item = [f64; 3]> {
    (0..TERMS).flat_map(move |term| columns.clone().into_iter().map(move |c| c[term]))
}

/// The warp of the rows of a texture that has a row for each term.
fn for_each_term(warp: &Warp) -> Warp {
    match warp {
        Warp::Log1p { scale, max } => Warp::Log1p { scale: thrice(scale), max: thrice(max) },
        other => other.clone(),
    }
}

/// Each number once for each term.
fn thrice(numbers: &[f64]) -> Vec<f64> {
    numbers.iter().flat_map(|x| [*x; TERMS]).collect()
}

/// cosθo against its logarithm from where masking sets in.
fn warp(rows: &[Row]) -> Warp {
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
    fn moments(self, lobe: &Lobe<Sgd>, cosines: &[f64]) -> Vec<FresnelMoments> {
        match self {
            Self::Exact => cosines.par_iter().map(|cos| FresnelMoments::new(lobe, *cos)).collect(),
            Self::Quick => AlbedoBatch::new(lobe).moments(cosines),
        }
    }
}

/// cosθo at coordinates of a row.
fn cosines(warp: &Warp, row: usize, u: impl Iterator<Item = f64>) -> Vec<f64> {
    // exp_m1 of the warp may round to a little above 1.
    u.map(|u| warp.variable(row, u).clamp(GRAZING, 1.0)).collect()
}

/// The three moments of a row at each cosθo, per lobe.
fn moments(row: &Row, cosines: &[f64], rule: Rule) -> Vec<[[f64; 3]; TERMS]> {
    let lobes: Vec<Option<Vec<FresnelMoments>>> = row
        .lobes
        .par_iter()
        .map(|lobe| lobe.as_ref().map(|lobe| rule.moments(lobe, cosines)))
        .collect();
    // A lobe that is not stored keeps moments of 0.
    let mut moments = vec![[[0.0; 3]; TERMS]; cosines.len()];
    for (j, of_lobe) in lobes.iter().enumerate() {
        for (moments, of_lobe) in moments.iter_mut().zip(of_lobe.iter().flatten()) {
            let FresnelMoments { one, schlick, cosine } = *of_lobe;
            [moments[0][j], moments[1][j], moments[2][j]] = [one, schlick, cosine];
        }
    }
    moments
}
