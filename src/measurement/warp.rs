//! Tables over the unit square for a series of angles: linear interpolation, and the map that
//! turns a density into a uniform one.
//!
//! x is the column, which varies fastest, y the row; nodes lie on the edges of the square.

use glam::DVec2;

/// The two angles of a series around an angle, and the share of the upper one.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    lower: usize,
    upper: usize,
    share: f64,
}

impl Place {
    /// The place of `angle` in an ascending series; its ends hold beyond them.
    #[must_use]
    pub fn of(angle: f64, series: &[f32]) -> Self {
        // Beyond the last angle the share is clamped to 1; a series of one has both in one.
        let upper = series.partition_point(|a| f64::from(*a) <= angle).min(series.len() - 1);
        let lower = upper.saturating_sub(1);
        let [a, b] = [lower, upper].map(|i| f64::from(series[i]));
        let share = if b > a { ((angle - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 };
        Self { lower, upper, share }
    }

    /// The value at index `i` of tables of `stride` values each.
    fn mix(self, values: &[f32], stride: usize, i: usize) -> f64 {
        let [a, b] = [self.lower, self.upper].map(|slice| f64::from(values[slice * stride + i]));
        a + self.share * (b - a)
    }

    /// The only table of a series of one.
    pub const ONLY: Self = Self { lower: 0, upper: 0, share: 0.0 };
}

/// Values at the nodes of a grid over the unit square, for each of a series.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Columns and rows, at least 2 each.
    pub size: [usize; 2],
    /// Rows of one table after another.
    pub values: Vec<f32>,
}

impl Grid {
    /// Values in one table.
    fn stride(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// The value at a point of the square, linear along x, y and the series.
    #[must_use]
    pub fn eval(&self, at: DVec2, place: Place) -> f64 {
        self.layer(at, place, 0, 1)
    }

    /// As [`Self::eval`], of one of `layers` tables that each member of the series has.
    #[must_use]
    pub fn layer(&self, at: DVec2, place: Place, layer: usize, layers: usize) -> f64 {
        let cell = Cell::of(at, self.size);
        let first = layer * self.stride();
        let corners = cell.corners(self.size);
        cell.bilinear(corners.map(|i| place.mix(&self.values, layers * self.stride(), first + i)))
    }

    /// The node at a column and row, as a point of the square.
    #[must_use]
    pub fn node(&self, column: usize, row: usize) -> DVec2 {
        node(self.size, column, row)
    }
}

/// The point of the square at a column and row of a grid.
#[must_use]
pub fn node(size: [usize; 2], column: usize, row: usize) -> DVec2 {
    DVec2::new(column as f64 / (size[0] - 1) as f64, row as f64 / (size[1] - 1) as f64)
}

/// A patch of a grid and the place in it.
#[derive(Clone, Copy)]
struct Cell {
    column: usize,
    row: usize,
    x: f64,
    y: f64,
}

impl Cell {
    fn of(at: DVec2, size: [usize; 2]) -> Self {
        let scaled = [at.x, at.y].map(|t| t.clamp(0.0, 1.0));
        let [x, y] = [0, 1].map(|axis| scaled[axis] * (size[axis] - 1) as f64);
        // The far edge belongs to the last cell, at 1.
        let [column, row] = [(x, size[0]), (y, size[1])].map(|(t, n)| (t as usize).min(n - 2));
        Self { column, row, x: x - column as f64, y: y - row as f64 }
    }

    /// Indices of (0, 0), (1, 0), (0, 1), (1, 1).
    fn corners(self, size: [usize; 2]) -> [usize; 4] {
        let first = self.row * size[0] + self.column;
        [first, first + 1, first + size[0], first + size[0] + 1]
    }

    fn bilinear(self, [v00, v10, v01, v11]: [f64; 4]) -> f64 {
        let [lower, upper] = [lerp(v00, v10, self.x), lerp(v01, v11, self.x)];
        lerp(lower, upper, self.y)
    }
}

/// Densities over the unit square, and their cumulative distributions: first along y of whole
/// rows, then along x of the row there.
#[derive(Clone, Debug, PartialEq)]
pub struct Warp {
    /// The densities as given, not normalised.
    pub density: Grid,
    /// ∫ of each row up to each column, in patches, over the integral of the table.
    conditional: Vec<f32>,
    /// ∫ of all rows up to each row, over the integral of the table.
    marginal: Vec<f32>,
    /// 1 over the integral of each table, in patches.
    scale: Vec<f32>,
}

impl Warp {
    /// The map of densities ≥ 0; `None` where a table is 0 everywhere.
    #[must_use]
    pub fn new(density: Grid) -> Option<Self> {
        let [columns, rows] = density.size;
        let tables = density.values.len() / density.stride();
        let mut warp = Self {
            conditional: Vec::with_capacity(density.values.len()),
            marginal: Vec::with_capacity(tables * rows),
            scale: Vec::with_capacity(tables),
            density,
        };
        for table in warp.density.values.chunks_exact(columns * rows) {
            // Sums in f64, stored in f32: half of the memory, and the file has no more digits.
            let conditional: Vec<f64> = table.chunks_exact(columns).flat_map(cumulated).collect();
            let whole_rows = conditional.chunks_exact(columns).map(|row| row[columns - 1] as f32);
            let marginal: Vec<f64> = cumulated(&whole_rows.collect::<Vec<f32>>()).collect();
            let scale = marginal[rows - 1].recip();
            // A black table has no density to normalise; its reciprocal is infinite.
            if !(scale.is_finite() && scale > 0.0) {
                return None;
            }
            warp.conditional.extend(conditional.iter().map(|sum| (sum * scale) as f32));
            warp.marginal.extend(marginal.iter().map(|sum| (sum * scale) as f32));
            warp.scale.push(scale as f32);
        }
        Some(warp)
    }

    /// The uniform point that is mapped to `at`, and the density there.
    #[must_use]
    pub fn invert(&self, at: DVec2, place: Place) -> (DVec2, f64) {
        let cell = Cell::of(at, self.density.size);
        let [c0, c1] = self.columns_density(cell, place);
        let [r0, r1] = self.rows_integral(cell.row, self.density.size[0] - 1, place);
        // ∫ of a linear density from the patch's edge, plus that of all patches before.
        let x = cell.x * (c0 + 0.5 * cell.x * (c1 - c0))
            + self.integral(cell.row, cell.y, cell.column, place);
        let y = cell.y * (r0 + 0.5 * cell.y * (r1 - r0))
            + place.mix(&self.marginal, self.density.size[1], cell.row);
        // The integral of the whole row at this height; a black row is mapped to its start.
        let length = lerp(r0, r1, cell.y);
        let x = if length > 0.0 { x / length } else { 0.0 };
        (DVec2::new(x, y), lerp(c0, c1, cell.x) * self.patches())
    }

    /// The point that a uniform point is mapped to, and the density there.
    #[must_use]
    pub fn sample(&self, uniform: DVec2, place: Place) -> (DVec2, f64) {
        let [columns, rows] = self.density.size;
        let row = interval(rows, |row| place.mix(&self.marginal, rows, row) < uniform.y);
        let [r0, r1] = self.rows_integral(row, columns - 1, place);
        // First y, whose density is linear between the integrals of two rows, then x there.
        let y = invert_linear(uniform.y - place.mix(&self.marginal, rows, row), r0, r1);
        // Unnormalised along the row, as `conditional` is.
        let target = uniform.x * lerp(r0, r1, y);
        let column = interval(columns, |column| self.integral(row, y, column, place) < target);
        let cell = Cell { column, row, x: 0.0, y };
        let [c0, c1] = self.columns_density(cell, place);
        let x = invert_linear(target - self.integral(row, y, column, place), c0, c1);
        let at = DVec2::new(
            (column as f64 + x) / (columns - 1) as f64,
            (row as f64 + y) / (rows - 1) as f64,
        );
        (at, lerp(c0, c1, x) * self.patches())
    }

    /// The density, in patches, at a patch's left and right edge at the height of `cell`.
    fn columns_density(&self, cell: Cell, place: Place) -> [f64; 2] {
        let [v00, v10, v01, v11] = cell.corners(self.density.size).map(|i| {
            let [a, b] = [place.lower, place.upper].map(|table| self.normalised(table, i));
            lerp(a, b, place.share)
        });
        [lerp(v00, v01, cell.y), lerp(v10, v11, cell.y)]
    }

    /// The density at node `i` of a table, in patches.
    fn normalised(&self, table: usize, i: usize) -> f64 {
        f64::from(self.density.values[table * self.density.stride() + i])
            * f64::from(self.scale[table])
    }

    /// ∫ of the density along x up to a column, along a patch's lower and upper edge.
    fn rows_integral(&self, row: usize, column: usize, place: Place) -> [f64; 2] {
        let columns = self.density.size[0];
        [row, row + 1]
            .map(|row| place.mix(&self.conditional, self.density.stride(), row * columns + column))
    }

    /// The same at height `y` of the patch.
    fn integral(&self, row: usize, y: f64, column: usize, place: Place) -> f64 {
        let [lower, upper] = self.rows_integral(row, column, place);
        lerp(lower, upper, y)
    }

    /// Patches of the grid.
    fn patches(&self) -> f64 {
        self.density.size.map(|n| (n - 1) as f64).iter().product()
    }
}

/// Trapezoid sums of a row, the first 0.
fn cumulated(row: &[f32]) -> impl Iterator<Item = f64> + '_ {
    let steps = row.windows(2).map(|pair| 0.5 * (f64::from(pair[0]) + f64::from(pair[1])));
    std::iter::once(0.0).chain(steps.scan(0.0, |sum, step| {
        *sum += step;
        Some(*sum)
    }))
}

/// The last interval whose lower end is before the place sought, of `size` − 1.
fn interval(size: usize, before: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, size - 1);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if before(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// t in \[0, 1\] with t (a + ½ t (b − a)) = `integral`.
fn invert_linear(integral: f64, a: f64, b: f64) -> f64 {
    // 2I/(a + √(a² + 2I(b − a))) has no cancellation where a = b.
    let root = (a * a + 2.0 * integral * (b - a)).max(0.0).sqrt();
    let t = 2.0 * integral / (a + root);
    // 0/0 where the density vanishes on the whole side: any t will do.
    if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 }
}

fn lerp(a: f64, b: f64, share: f64) -> f64 {
    a + share * (b - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warp() -> Warp {
        let size = [5, 4];
        let values = (0..40).map(|i| (((i * 7) % 11) as f32 + 0.25) * (1 + i / 20) as f32);
        Warp::new(Grid { size, values: values.collect() }).expect("not black")
    }

    #[test]
    fn sampling_and_inversion_are_inverse() {
        let warp = warp();
        let place = Place::of(0.3, &[0.0, 1.0]);
        for i in 0..100 {
            let uniform = DVec2::new(0.05 + 0.0093 * f64::from(i), (0.31 * f64::from(i)).fract());
            let (at, density) = warp.sample(uniform, place);
            let (again, same) = warp.invert(at, place);
            assert!((again - uniform).length() < 1e-6, "{uniform} {again}");
            assert!((density / same - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn the_density_integrates_to_one() {
        let warp = warp();
        let n = 200;
        for share in [0.0, 0.4, 1.0] {
            let place = Place::of(share, &[0.0, 1.0]);
            let sum: f64 = (0..n * n)
                .map(|i| {
                    let at = DVec2::new(f64::from(i % n) + 0.5, f64::from(i / n) + 0.5);
                    warp.invert(at / f64::from(n), place).1
                })
                .sum();
            assert!((sum / f64::from(n * n) - 1.0).abs() < 1e-3, "{sum}");
        }
    }

    #[test]
    fn a_series_is_interpolated_and_holds_beyond_its_ends() {
        let grid = Grid { size: [2, 2], values: vec![0.0, 1.0, 0.0, 1.0, 2.0, 3.0, 2.0, 3.0] };
        let at = DVec2::new(0.5, 0.25);
        let values =
            [0.0, 0.5, 1.0, 1.5, 9.0].map(|angle| grid.eval(at, Place::of(angle, &[0.5, 1.5])));
        assert_eq!(values, [0.5, 0.5, 1.5, 2.5, 2.5]);
        assert_eq!(Warp::new(Grid { size: [2, 2], values: vec![0.0; 4] }), None);
    }
}
