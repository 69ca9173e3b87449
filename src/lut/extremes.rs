//! Extremes of cell errors: the largest and the least over any run of cells, without a look at each.

use crate::lut::cell_error::CellErrors;
use crate::lut::interval::{Interval, hull};

/// The largest and least cell errors over any run of cells of a row.
pub struct Extremes {
    /// Of every cell, then of pairs of them, of fours, …; row by row.
    levels: Vec<Vec<[Interval; 3]>>,
    cells_per_row: usize,
}

impl Extremes {
    /// The extremes of a table's cell errors in `rows` rows.
    #[must_use]
    pub fn new(errors: &CellErrors, rows: usize) -> Self {
        let cells_per_row = errors.cells_per_row();
        let cells = (0..rows).flat_map(|row| (0..cells_per_row).map(move |cell| (row, cell)));
        let mut levels: Vec<Vec<[Interval; 3]>> =
            vec![cells.map(|(row, cell)| *errors.of_cell(row, cell)).collect()];
        let mut per_row = cells_per_row;
        while per_row > 1 {
            // Row by row, so that no pair spans two rows; of an odd row the last stays alone.
            let below = &levels[levels.len() - 1];
            let level = below
                .chunks_exact(per_row)
                .flat_map(|row| row.chunks(2).map(hull_of_pair))
                .collect();
            levels.push(level);
            per_row = per_row.div_ceil(2);
        }
        Self { levels, cells_per_row }
    }

    /// The extremes over `u` in an interval.
    #[must_use]
    pub fn over(&self, row: usize, u: Interval) -> [Interval; 3] {
        let last = self.cells_per_row - 1;
        // The cells as `CellErrors::at` counts them, the last one included.
        let [mut first, mut end] = u.map(|u| ((u * (last + 1) as f64) as usize).min(last));
        end += 1;
        let mut extremes = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        let mut per_row = self.cells_per_row;
        // From the finest level up: a first or last cell that is half of a pair is taken by itself;
        // the rest are whole pairs, single entries of the next level.
        for level in &self.levels {
            let start = row * per_row;
            if first >= end {
                break;
            }
            if first % 2 == 1 {
                extremes = hulls(extremes, level[start + first]);
                first += 1;
            }
            if end % 2 == 1 && first < end {
                end -= 1;
                extremes = hulls(extremes, level[start + end]);
            }
            (first, end) = (first / 2, end / 2);
            per_row = per_row.div_ceil(2);
        }
        extremes
    }
}

/// The extremes of two neighbours, or of the one that is left over.
fn hull_of_pair(cells: &[[Interval; 3]]) -> [Interval; 3] {
    cells[1..].iter().fold(cells[0], |extremes, cell| hulls(extremes, *cell))
}

/// The intervals that hold both, of each texel channel.
fn hulls(a: [Interval; 3], b: [Interval; 3]) -> [Interval; 3] {
    std::array::from_fn(|c| hull(a[c], b[c]))
}
