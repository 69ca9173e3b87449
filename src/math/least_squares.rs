//! Nonlinear least squares inside a box.

use nalgebra::{DMatrix, DVector};

use crate::math::arithmetic::sum_in_pairs;

/// The normal equations of Σ r²/2 at one point: its value, gradient and Gauss–Newton Hessian.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalEquations {
    /// Σ r².
    pub squares: f64,
    /// Jᵀr.
    pub gradient: DVector<f64>,
    /// JᵀJ; its lower triangle is read.
    pub hessian: DMatrix<f64>,
}

/// Residuals that are summed side by side. The number is the same on every machine, whatever the
/// width of its vectors, and so are the bits of the sums.
pub const LANES: usize = 32;
/// A number of each.
pub type Lanes = [f64; LANES];

/// Sums up [`NormalEquations`] of N unknowns on the stack, lane by lane.
#[derive(Clone, Debug)]
pub struct LaneSums<const N: usize> {
    squares: Lanes,
    gradient: [Lanes; N],
    hessian: [[Lanes; N]; N],
}

/// Weighted residuals r(v), one value v in each lane: what their sum of squares needs to know of
/// them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LaneResiduals {
    /// Σ weight·r².
    pub squares: Lanes,
    /// Σ weight·r·dr/dv.
    pub slope: Lanes,
    /// Σ weight·(dr/dv)².
    pub curvature: Lanes,
}

impl LaneResiduals {
    /// Adds a residual of a lane with its derivative by the lane's value.
    #[inline(always)]
    pub fn add(&mut self, lane: usize, weight: f64, residual: f64, slope: f64) {
        self.squares[lane] += weight * residual * residual;
        self.slope[lane] += weight * residual * slope;
        self.curvature[lane] += weight * slope * slope;
    }
}

impl<const N: usize> LaneSums<N> {
    /// No residuals yet.
    #[must_use]
    pub fn none() -> Self {
        Self { squares: [0.0; LANES], gradient: [[0.0; LANES]; N], hessian: [[[0.0; LANES]; N]; N] }
    }

    /// Adds the residuals that depend on values with ∂value/∂x = `row`.
    #[inline(always)]
    pub fn add(&mut self, terms: &LaneResiduals, row: &[Lanes; N]) {
        for l in 0..LANES {
            self.squares[l] += terms.squares[l];
        }
        for (i, by_i) in row.iter().enumerate() {
            for (l, by) in by_i.iter().enumerate() {
                self.gradient[i][l] += terms.slope[l] * by;
            }
            // The lower triangle; [`NormalEquations::add`] mirrors it.
            for (j, by_j) in row[..=i].iter().enumerate() {
                for (l, by) in by_i.iter().enumerate() {
                    self.hessian[i][j][l] += terms.curvature[l] * by * by_j[l];
                }
            }
        }
    }
}

impl NormalEquations {
    /// No residuals of `n` unknowns yet.
    #[must_use]
    pub fn zero(n: usize) -> Self {
        Self { squares: 0.0, gradient: DVector::zeros(n), hessian: DMatrix::zeros(n, n) }
    }

    /// Adds residuals that depend on the unknowns at `places`, which may name an unknown twice.
    pub fn add<const N: usize>(&mut self, residuals: &LaneSums<N>, places: [usize; N]) {
        self.squares += sum_in_pairs(residuals.squares);
        for i in 0..N {
            self.gradient[places[i]] += sum_in_pairs(residuals.gradient[i]);
            // Both orders: where a pair names one unknown twice, its mixed term counts twice.
            for j in 0..N {
                self.hessian[(places[i], places[j])] +=
                    sum_in_pairs(residuals.hessian[i.max(j)][i.min(j)]);
            }
        }
    }
}

impl<const N: usize> From<LaneSums<N>> for NormalEquations {
    fn from(residuals: LaneSums<N>) -> Self {
        let mut equations = Self::zero(N);
        equations.add(&residuals, std::array::from_fn(|i| i));
        equations
    }
}

/// lower ≤ x ≤ upper, componentwise; infinities leave a side open.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    /// Lower bounds.
    pub lower: DVector<f64>,
    /// Upper bounds.
    pub upper: DVector<f64>,
}

impl Bounds {
    /// x ≥ 0 for `n` unknowns.
    #[must_use]
    pub fn non_negative(n: usize) -> Self {
        Self { lower: DVector::zeros(n), upper: DVector::repeat(n, f64::INFINITY) }
    }

    /// The range \[lower, upper\] of each unknown.
    #[must_use]
    pub fn of_ranges(ranges: &[[f64; 2]]) -> Self {
        let [lower, upper] =
            [0, 1].map(|end| DVector::from_fn(ranges.len(), |i, _| ranges[i][end]));
        Self { lower, upper }
    }

    /// The nearest point of the box.
    #[must_use]
    pub fn clamp(&self, x: &DVector<f64>) -> DVector<f64> {
        x.sup(&self.lower).inf(&self.upper)
    }

    fn shifted(&self, x: &DVector<f64>) -> Self {
        Self { lower: &self.lower - x, upper: &self.upper - x }
    }
}

/// Where the sum of squares is smallest.
#[derive(Clone, Debug, PartialEq)]
pub struct Minimum {
    /// The point.
    pub x: DVector<f64>,
    /// Σ r² there.
    pub squares: f64,
}

/// Steps tried; each costs one evaluation.
const MAX_STEPS: usize = 60;

/// The local minimum of Σ r² in the box that Levenberg–Marquardt reaches from `start`; it ends when
/// a step lowers Σ r² by less than `tolerance` of it.
///
/// Each step solves the damped normal equations inside the box exactly ([`box_quadratic`]), so a
/// bound that is active at the solution costs nothing.
pub fn minimise(
    equations: impl FnMut(&DVector<f64>) -> NormalEquations,
    start: &DVector<f64>,
    bounds: &Bounds,
    tolerance: f64,
) -> Minimum {
    minimise_in(MAX_STEPS, equations, start, bounds, tolerance)
}

/// [`minimise`] in at most `steps` steps.
pub fn minimise_in(
    steps: usize,
    mut equations: impl FnMut(&DVector<f64>) -> NormalEquations,
    start: &DVector<f64>,
    bounds: &Bounds,
    tolerance: f64,
) -> Minimum {
    let mut x = bounds.clamp(start);
    let mut at = equations(&x);
    let mut damping = 1e-4;
    for _ in 0..steps {
        let step = box_quadratic(&damped(&at.hessian, damping), &at.gradient, &bounds.shifted(&x));
        // The step ends in the box but for rounding.
        let next_x = bounds.clamp(&(&x + step));
        let next = equations(&next_x);
        // A NaN fails the comparison and counts as a rise.
        if next.squares <= at.squares {
            let gain = at.squares - next.squares;
            (x, at) = (next_x, next);
            damping = (damping * 0.1).max(1e-12);
            if gain <= tolerance * at.squares {
                break;
            }
        } else if damping > 1e8 {
            // Not even so short a step lowers the sum: x is its minimum to rounding.
            break;
        } else {
            damping *= 10.0;
        }
    }
    Minimum { x, squares: at.squares }
}

/// H + damping·diag(H), with a floor that keeps unseen unknowns where they are.
#[must_use]
pub fn damped(hessian: &DMatrix<f64>, damping: f64) -> DMatrix<f64> {
    // 1e-290 keeps a Hessian of zeros positive definite.
    let floor = 1e-14 * hessian.diagonal().max().max(1e-290);
    let mut damped = hessian.clone();
    for i in 0..hessian.nrows() {
        damped[(i, i)] += damping * hessian[(i, i)] + floor;
    }
    damped
}

/// The minimum of ½ xᵀHx + gᵀx in a box that contains 0, H positive definite (its lower triangle
/// is read).
///
/// Primal active set: solve for the free unknowns; walk there until the first bound, which then
/// holds its unknown; once there, release the bound whose multiplier has the wrong sign most.
#[must_use]
pub fn box_quadratic(
    hessian: &DMatrix<f64>,
    gradient: &DVector<f64>,
    bounds: &Bounds,
) -> DVector<f64> {
    let n = gradient.len();
    let mut x = bounds.clamp(&DVector::zeros(n));
    let mut free: Vec<bool> = (0..n)
        .map(|i| {
            // Held from the start is what lies on a bound and is pushed outwards.
            let at_lower = x[i] <= bounds.lower[i] && gradient[i] >= 0.0;
            let at_upper = x[i] >= bounds.upper[i] && gradient[i] <= 0.0;
            bounds.lower[i] < bounds.upper[i] && !at_lower && !at_upper
        })
        .collect();
    // Each pass holds or releases one unknown; it ends by itself but for rounding.
    for _ in 0..8 * n {
        let Some(step) = newton_step(hessian, &slope(hessian, gradient, &x), &free) else { break };
        let (length, blocking) = feasible_length(&x, &step, bounds);
        x = bounds.clamp(&(&x + &step * length));
        if let Some(i) = blocking {
            free[i] = false;
            // On the bound to the last bit, so that the comparisons with it hold.
            x[i] = if step[i] > 0.0 { bounds.upper[i] } else { bounds.lower[i] };
            continue;
        }
        match wrong_multiplier(&slope(hessian, gradient, &x), &x, &free, bounds) {
            Some(i) => free[i] = true,
            None => break,
        }
    }
    x
}

/// Hx + g.
fn slope(hessian: &DMatrix<f64>, gradient: &DVector<f64>, x: &DVector<f64>) -> DVector<f64> {
    let mut slope = gradient.clone();
    slope.sygemv(1.0, hessian, x, 1.0);
    slope
}

/// −H⁻¹·slope over the free unknowns, 0 for the others.
fn newton_step(
    hessian: &DMatrix<f64>,
    slope: &DVector<f64>,
    free: &[bool],
) -> Option<DVector<f64>> {
    let free: Vec<usize> = (0..free.len()).filter(|i| free[*i]).collect();
    let reduced = DMatrix::from_fn(free.len(), free.len(), |i, j| hessian[(free[i], free[j])]);
    let right = DVector::from_fn(free.len(), |i, _| -slope[free[i]]);
    // `None` where rounding has left the block indefinite; the caller keeps its x.
    let solution = reduced.cholesky()?.solve(&right);
    let mut step = DVector::zeros(slope.len());
    for (i, value) in free.iter().zip(solution.iter()) {
        step[*i] = *value;
    }
    Some(step)
}

/// The share of `step` that stays inside, at most 1, and the unknown that stops it.
fn feasible_length(x: &DVector<f64>, step: &DVector<f64>, bounds: &Bounds) -> (f64, Option<usize>) {
    let mut shortest = (1.0, None);
    for i in 0..x.len() {
        let room = if step[i] > 0.0 { bounds.upper[i] - x[i] } else { bounds.lower[i] - x[i] };
        // An open side has infinite room and never blocks.
        if step[i] != 0.0 && room / step[i] < shortest.0 {
            shortest = (room / step[i], Some(i));
        }
    }
    shortest
}

/// The held unknown that most wants to move inwards.
fn wrong_multiplier(
    slope: &DVector<f64>,
    x: &DVector<f64>,
    free: &[bool],
    bounds: &Bounds,
) -> Option<usize> {
    let held = (0..x.len()).filter(|i| !free[*i] && bounds.lower[*i] < bounds.upper[*i]);
    // At a minimum the sum rises inwards: slope ≥ 0 at a lower bound, ≤ 0 at an upper one.
    let pulls = held.map(|i| (i, if x[i] <= bounds.lower[i] { -slope[i] } else { slope[i] }));
    let pulled = pulls.filter(|(_, pull)| *pull > 0.0);
    pulled.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The minimum over a box by trying every set of active bounds.
    fn by_enumeration(h: &DMatrix<f64>, g: &DVector<f64>, bounds: &Bounds) -> f64 {
        let minima = (0..27).map(|code| {
            let state = [code % 3, code / 3 % 3, code / 9];
            let x = DVector::from_fn(3, |i, _| [0.0, bounds.lower[i], bounds.upper[i]][state[i]]);
            let step = newton_step(h, &slope(h, g, &x), &state.map(|s| s == 0));
            x + step.expect("positive definite")
        });
        let inside = minima.filter(|x| (bounds.clamp(x) - x).norm() < 1e-9);
        inside.map(|x| 0.5 * x.dot(&(h * &x)) + g.dot(&x)).fold(f64::INFINITY, f64::min)
    }

    fn random(seed: usize, k: usize) -> f64 {
        ((seed * 37 + k) as f64 * 12.9898).sin() * 3.0
    }

    #[test]
    fn box_quadratic_is_the_best_of_all_active_sets() {
        let bounds = Bounds {
            lower: DVector::from_vec(vec![-1.0, 0.0, -0.5]),
            upper: DVector::from_vec(vec![0.5, 2.0, 0.0]),
        };
        for seed in 0..200 {
            let a = DMatrix::from_fn(3, 3, |i, j| random(seed, 3 * i + j));
            let h = &a * a.transpose() + DMatrix::identity(3, 3) * 0.1;
            let g = DVector::from_fn(3, |i, _| random(seed, 20 + i) * 2.0);
            let x = box_quadratic(&h, &g, &bounds);
            let value = 0.5 * x.dot(&(&h * &x)) + g.dot(&x);
            assert!(value <= by_enumeration(&h, &g, &bounds) + 1e-9, "seed {seed}");
            assert_eq!(bounds.clamp(&x), x);
        }
    }

    /// a and b of a e^{−b t}.
    const EXPONENTIAL: [f64; 2] = [3.0, 0.7];

    /// The equations of a e^{−b t} at 96 places.
    fn exponential(x: &DVector<f64>) -> NormalEquations {
        let mut sums = LaneSums::none();
        for block in 0..3 {
            let t: Lanes = std::array::from_fn(|l| (block * LANES + l) as f64 * 0.2);
            let decay = t.map(|t| (-x[1] * t).exp());
            let exact = t.map(|t| EXPONENTIAL[0] * (-EXPONENTIAL[1] * t).exp());
            let mut terms = LaneResiduals::default();
            for l in 0..LANES {
                terms.add(l, 1.0, x[0] * decay[l] - exact[l], 1.0);
            }
            let row = [decay, std::array::from_fn(|l| -x[0] * t[l] * decay[l])];
            sums.add(&terms, &row);
        }
        sums.into()
    }

    #[test]
    fn recovers_an_exponential() {
        let start = DVector::from_vec(vec![0.1, 5.0]);
        let found = minimise(exponential, &start, &Bounds::non_negative(2), 1e-12);
        for (found, truth) in found.x.iter().zip(EXPONENTIAL) {
            assert!((found - truth).abs() < 1e-6, "{found} {truth}");
        }
    }
}
