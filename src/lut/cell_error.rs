//! Cell errors: for every cell between two texels, how far the decoded value may be off.

use rayon::prelude::*;

use crate::lut::axis::Warp;
use crate::lut::bend::Bends;
use crate::lut::interval::Interval;
use crate::lut::quantity::Encoding;
use crate::lut::row::Rows;
use crate::lut::slope::SlopeBounds;
use crate::lut::table::Table;
use crate::lut::term::Term;

/// How far a texture unit's weight of the right texel lies off the true one: rounded to 1/256 on
/// both sides.
pub const ROUNDED_WEIGHTS: Interval = [-1.0 / 512.0, 1.0 / 512.0];

/// Relative rounding of a coordinate and of its product with the width in f32, twice over.
const COORDINATE_ROUNDING: f64 = 4.0 / 16_777_216.0;
/// Relative rounding of a texel mixed in f32, and of its exponential.
const MIX_ROUNDING: f64 = 3.0 / 16_777_216.0;

/// A texel of `ndf` below which D, less than 1e-60 of its peak, counts as vanished.
const VANISHED: f64 = -140.0;

/// The errors of a table, cell by cell.
///
/// # Formula
///
/// With r the rounding of the stored texels, k bounds on d²t/du² times the square of a cell and w
/// in \[0, 1\] the place within it,
///
/// ```text
/// t_lut − t = (1−w) r_left + w r_right + ½ k w (1−w) + (t_right − t_left)·δw
/// ```
///
/// Relative for `exp_times` (e^{t_lut−t} − 1), absolute for `identity`.
#[derive(Clone, Debug, PartialEq)]
pub struct CellErrors {
    cells_per_row: usize,
    /// Least and largest error of each texel channel.
    errors: Vec<[Interval; 3]>,
}

impl CellErrors {
    /// The cell errors of the table of a factor, for mixing in f32 and by weights that are off by
    /// `weights`.
    #[must_use]
    pub fn new(term: Term, table: &Table, rows: &Rows, bends: &Bends, weights: Interval) -> Self {
        let cells_per_row = table.size[0] - 1;
        let warp = term.warp(rows);
        // flat_map_iter keeps the order: `of_cell` counts on rows one after another.
        let rows_of_cells = (0..term.row_count(rows)).into_par_iter().map(|row| {
            let warp = &warp;
            Cells { term, table, rows, bends, weights, warp, row }
        });
        Self {
            cells_per_row,
            errors: rows_of_cells.flat_map_iter(|cells| cells.errors()).collect(),
        }
    }

    /// How many cells a row has.
    #[must_use]
    pub fn cells_per_row(&self) -> usize {
        self.cells_per_row
    }

    /// The errors of one cell.
    #[must_use]
    pub fn of_cell(&self, row: usize, cell: usize) -> &[Interval; 3] {
        &self.errors[row * self.cells_per_row + cell]
    }

    /// The errors per texel channel at coordinate `u` of a row.
    #[must_use]
    pub fn at(&self, row: usize, u: f64) -> &[Interval; 3] {
        // u = 1 belongs to the last cell.
        let cell = ((u * self.cells_per_row as f64) as usize).min(self.cells_per_row - 1);
        self.of_cell(row, cell)
    }
}

/// g = (1+δ_D)(1+δ_i)(1+δ_o), the factor by which D G1(wi) G1(wo) grows, from relative errors δ.
#[must_use]
pub fn growth([d, g1_i, g1_o]: [Interval; 3]) -> Interval {
    // No δ is below −1, so the factors are not negative and the ends multiply.
    [0, 1].map(|end| (1.0 + d[end]) * (1.0 + g1_i[end]) * (1.0 + g1_o[end]))
}

/// The cells of one row.
struct Cells<'a> {
    term: Term,
    table: &'a Table,
    rows: &'a Rows,
    bends: &'a Bends,
    weights: Interval,
    warp: &'a Warp,
    row: usize,
}

impl Cells<'_> {
    /// The errors of every cell.
    fn errors(&self) -> Vec<[Interval; 3]> {
        let width = self.table.size[0];
        let last = (width - 1) as f64;
        let exact: Vec<[Option<f64>; 3]> =
            (0..width).map(|i| self.exact(i as f64 / last)).collect();
        let stored: Vec<[f64; 3]> = (0..width)
            .map(|i| self.table.texels.get(self.row * width + i).map(f64::from))
            .collect();
        let cells = exact.windows(2).zip(stored.windows(2)).enumerate();
        cells.map(|(cell, (exact, stored))| self.cell_errors(cell, exact, stored)).collect()
    }

    /// The errors of a cell per texel channel, from the texels at both of its ends.
    fn cell_errors(
        &self,
        cell: usize,
        exact: &[[Option<f64>; 3]],
        stored: &[[f64; 3]],
    ) -> [Interval; 3] {
        std::array::from_fn(|c| match (exact[0][c], exact[1][c]) {
            (Some(left), Some(right)) => {
                self.error(cell, c, [left, right], [stored[0][c], stored[1][c]])
            }
            // Nothing is stored here: whoever bounds f counts the lobe as missing.
            _ => [0.0; 2],
        })
    }

    /// The exact texel, of `ndf` without the 0 that closes the table.
    fn exact(&self, u: f64) -> [Option<f64>; 3] {
        if self.term == Term::Ndf && u >= 1.0 {
            let x = self.warp.variable(self.row, 1.0);
            let lobes = self.rows.lobes[self.row].lobes.each_ref();
            return lobes.map(|l| l.as_ref().map(|l| l.distribution.closed_form().log_decay(x)));
        }
        self.term.texel(self.rows, self.row, self.warp, u)
    }

    /// The error of a texel channel in a cell, as the table's encoding measures it.
    fn error(&self, cell: usize, c: usize, exact: Interval, stored: Interval) -> Interval {
        let vanishing = self.term == Term::Ndf && (stored[1] < VANISHED || exact[1] < VANISHED);
        // Towards the end ln D falls without limit: D may be decoded as 0 there, e^{−∞} − 1 = −1.
        let off = if vanishing {
            // Next to the closing 0, D may decode to nothing at all: e^{−∞} − 1 is −100 %.
            [f64::NEG_INFINITY, self.closing_error(exact, stored)]
        } else {
            self.texel_error(cell, c, exact, stored)
        };
        match self.table.encoding {
            Encoding::Identity | Encoding::Times { .. } => off,
            Encoding::ExpTimes { .. } => off.map(f64::exp_m1),
        }
    }

    /// How far above the exact texel a cell may lie in which D vanishes, where its chord falls
    /// steeper than the exact texel; where D has vanished before, the most that D may be.
    fn closing_error(&self, exact: Interval, stored: Interval) -> f64 {
        if exact[0] < VANISHED {
            // +100 % of the 1e-60 of the peak that `ranges` counts as the least D.
            return std::f64::consts::LN_2;
        }
        let fall = (exact[0] - exact[1]).max(0.0) * (self.shift()[1] - self.shift()[0]);
        (stored[0] - exact[0]).max(0.0) + fall + MIX_ROUNDING * stored[0].abs()
    }

    /// How far the place within a cell may be off, in f32 and by a texture unit.
    fn shift(&self) -> Interval {
        let coordinate = COORDINATE_ROUNDING * (self.table.size[0] - 1) as f64;
        [self.weights[0] - coordinate, self.weights[1] + coordinate]
    }

    /// How far the mixed texel lies below and above the exact one, at most.
    fn texel_error(&self, cell: usize, c: usize, exact: Interval, stored: Interval) -> Interval {
        let cells = (self.table.size[0] - 1) as f64;
        let u = [cell as f64 / cells, (cell + 1) as f64 / cells];
        let rounding = [stored[0] - exact[0], stored[1] - exact[1]];
        // ½ k w (1−w) with k over a cell; the least error is minus the largest of the negated one.
        let smooth = match self.bends.over(self.row, c, u) {
            Some(bend) => {
                let [low, high] = bend.map(|bend| bend / (cells * cells));
                [
                    -largest_of_parabola(rounding.map(|r| -r), -low),
                    largest_of_parabola(rounding, high),
                ]
            }
            None => self.by_slope(c, u, stored),
        };
        // A weight that is off moves the mixed texel along the chord.
        let rise = stored[1] - stored[0];
        let [back, forth] = self.shift().map(|shift| rise * shift);
        // 1 for the exponential, |t| for the texel in its exponent.
        let mixing = MIX_ROUNDING * (1.0 + stored[0].abs().max(stored[1].abs()));
        [smooth[0] + back.min(forth) - mixing, smooth[1] + back.max(forth) + mixing]
    }

    /// The same of the published masking fit, whose slope has bounds and its bend none.
    fn by_slope(&self, c: usize, u: Interval, stored: Interval) -> Interval {
        let lobe = self.rows.lobes[self.row].lobes[c].as_ref();
        match (lobe.and_then(|lobe| lobe.fitted.as_ref()), self.warp) {
            (Some(masking), Warp::Rational { scale }) => {
                SlopeBounds::new(masking, scale[self.row]).chord_error(u, stored)
            }
            _ => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }
}

/// The largest of (1−w) a + w b + ½ k w (1−w) over w in \[0, 1\].
fn largest_of_parabola([a, b]: Interval, k: f64) -> f64 {
    // With k ≤ 0 the parabola hangs below its chord, and `top`, perhaps NaN, is not used.
    let ends = a.max(b);
    // Not a number at k = 0, where it is not asked for.
    let top = (0.5 + (b - a) / k).clamp(0.0, 1.0);
    if k > 0.0 { parabola(a, b, k, top).max(ends) } else { ends }
}

/// (1−w) a + w b + ½ k w (1−w).
fn parabola(a: f64, b: f64, k: f64, w: f64) -> f64 {
    (1.0 - w) * a + w * b + 0.5 * k * w * (1.0 - w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parabola_s_top_is_found() {
        for (a, b, k) in [(0.0, 0.0, 1.0), (1.0, -0.5, 2.0), (0.1, 0.2, -3.0), (0.0, 1.0, 0.5)] {
            let values = (0..=1000).map(|i| parabola(a, b, k, f64::from(i) * 1e-3));
            let seen = values.fold(f64::MIN, f64::max);
            let top = largest_of_parabola([a, b], k);
            assert!(seen <= top + 1e-12 && top - seen < 1e-6, "{a} {b} {k}: {seen} {top}");
        }
    }
}
