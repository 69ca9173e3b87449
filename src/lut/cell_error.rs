//! Cell errors: for every cell between two texels, the largest error of the value decoded there.

use rayon::prelude::*;

use crate::lut::axis::Warp;
use crate::lut::quantity::Encoding;
use crate::lut::row::Rows;
use crate::lut::table::Table;
use crate::lut::term::Term;

/// Where a cell is examined, from its left texel (0) to its right one (1).
const WITHIN_CELL: [f32; 3] = [1.0 / 6.0, 0.5, 5.0 / 6.0];

/// How far a texture unit's 8-bit weight lies off the true one, at most.
const WEIGHT_ERROR: f32 = 1.0 / 512.0;

/// The errors of a table, cell by cell, for exact and for 8-bit filter weights.
///
/// Linear interpolation errs most in the middle of a cell, so that a smooth quantity's error
/// anywhere is bounded by that of its cell. Relative for `exp_times`, absolute for `identity`.
#[derive(Clone, Debug, PartialEq)]
pub struct CellErrors {
    cells_per_row: usize,
    errors: Vec<[f32; 3]>,
}

impl CellErrors {
    /// The cell errors of the table of a factor.
    #[must_use]
    pub fn new(term: Term, table: &Table, rows: &Rows) -> Self {
        let cells_per_row = table.size[0] - 1;
        let warp = term.warp(rows);
        let errors = (0..term.row_count(rows) * cells_per_row)
            .into_par_iter()
            .map(|i| cell_error(term, table, rows, &warp, [i / cells_per_row, i % cells_per_row]))
            .collect();
        Self { cells_per_row, errors }
    }

    /// The error bound per texel channel at coordinate `u` of a row.
    #[must_use]
    pub fn at(&self, row: usize, u: f32) -> [f64; 3] {
        let cell = ((u * self.cells_per_row as f32) as usize).min(self.cells_per_row - 1);
        self.errors[row * self.cells_per_row + cell].map(f64::from)
    }
}

fn cell_error(
    term: Term,
    table: &Table,
    rows: &Rows,
    warp: &Warp,
    [row, cell]: [usize; 2],
) -> [f32; 3] {
    let cells = table.size[0] - 1;
    let [a, b] = [cell, cell + 1].map(|i| table.texels.get(row * table.size[0] + i));
    let exact = WITHIN_CELL
        .map(|t| term.texel(rows, row, warp, (cell as f64 + f64::from(t)) / cells as f64));
    std::array::from_fn(|c| {
        // How far a decoded texel lies below and above the exact one.
        let (mut below, mut above): (f64, f64) = (0.0, 0.0);
        for (within, exact) in WITHIN_CELL.into_iter().zip(exact) {
            let Some(exact) = exact[c] else { return 0.0 };
            for shift in [-WEIGHT_ERROR, 0.0, WEIGHT_ERROR] {
                let off = f64::from(a[c] + (b[c] - a[c]) * (within + shift)) - exact;
                (below, above) = (below.min(off), above.max(off));
            }
        }
        let error = match table.encoding {
            Encoding::Identity | Encoding::Times { .. } => above.max(-below),
            Encoding::ExpTimes { .. } => above.exp_m1().max(-below.exp_m1()),
        };
        error as f32
    })
}
