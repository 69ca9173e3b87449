//! The widths and weights of a few Beckmann distributions as unknowns, and the least sum of a power
//! of their errors.

use nalgebra::{DMatrix, DVector};

use crate::material::{LobeParams, Material};
use crate::math::least_squares::{
    Bounds, Minimum, NormalEquations, box_quadratic, damped, minimise, minimise_in,
};
use crate::microfacet::{Beckmann, Distribution as _, SharedMixture};

/// Relative decrease of the sum of squares at which the search ends.
const TOLERANCE: f64 = 1e-5;
/// Starts of a fit to a picture that are followed.
const DESCENTS: usize = 3;

/// The weight of the condition Σ_j w_j = 1 next to one sample's relative error.
const SUM_WEIGHT: f64 = 1e2;

/// D times its scale, and the scale, at each angle, per lobe.
pub type Goals = Vec<Vec<(f64, f64)>>;

/// The sum over angles of the errors e that is made least: Σ |e/unit|^exponent.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Norm {
    exponent: i32,
    unit: f64,
}

impl Norm {
    const SQUARES: Self = Self { exponent: 2, unit: 1.0 };

    /// |e/unit|^exponent.
    fn term(self, error: f64) -> f64 {
        (error / self.unit).abs().powi(self.exponent)
    }

    /// Half the term's second derivative over exponent − 1, which is half its first over e.
    fn weight(self, error: f64) -> f64 {
        let half = f64::from(self.exponent / 2) / (self.unit * self.unit);
        half * (error / self.unit).abs().powi(self.exponent - 2)
    }
}

/// The unknowns are n values of ln α, then n weights for each lobe.
#[derive(Clone, Debug)]
pub struct Problem {
    count: usize,
    tan2_theta: Vec<f64>,
    goals: Goals,
    /// The range of ln α in which starts lie.
    range: [f64; 2],
    /// The distance that a solution may lie below it.
    below: f64,
    norm: Norm,
}

impl Problem {
    /// The problem of `count` components, with the goals that `goals` gives at `samples` angles.
    #[must_use]
    pub fn new(
        material: &Material,
        count: usize,
        goals: impl Fn(&Material, &[f64]) -> Goals,
        samples: usize,
    ) -> Self {
        let lobes = material.lobes();
        let tan2_theta = angles(lobes, samples);
        let goals = goals(material, &tan2_theta);
        let narrowest = lobes.iter().map(core_tan2).fold(f64::INFINITY, f64::min);
        let widest = lobes.iter().map(LobeParams::alpha).fold(0.0, f64::max);
        // A Beckmann component of SGD has α_b² = α/(1 + s) ≤ α; the narrow end is a tenth of the
        // tan²θ at which D bends.
        let range = [0.5 * (0.1 * narrowest).ln(), 0.5 * widest.ln() + 0.1];
        Self { count, tan2_theta, goals, range, below: 0.0, norm: Norm::SQUARES }
    }

    /// The same with solutions whose ln α may lie so far below the range of the starts.
    #[must_use]
    pub fn with_room_below(self, below: f64) -> Self {
        Self { below, ..self }
    }

    /// The number of unknowns.
    fn unknowns(&self) -> usize {
        (1 + self.goals.len()) * self.count
    }

    /// Widths spaced evenly in ln α from a given share of the range up; equal weights.
    fn even_widths(&self, from: f64) -> DVector<f64> {
        let [low, high] = self.range;
        let low = low + from * (high - low);
        DVector::from_fn(self.unknowns(), |i, _| match self.count {
            // A single width has no spacing: it stands in the middle.
            1 => {
                if i == 0 {
                    0.5 * (low + high)
                } else {
                    1.0
                }
            }
            n if i < n => low + (high - low) * i as f64 / (n - 1) as f64,
            n => 1.0 / n as f64,
        })
    }

    /// The mixture of the best of several descents.
    #[must_use]
    pub fn solve(&self) -> SharedMixture {
        let starts = self.even_starts(DESCENTS);
        let ends = starts
            .iter()
            .map(|start| minimise(|x| self.equations(x), &start.x, &self.bounds(), TOLERANCE));
        let best = ends.min_by(|a, b| a.squares.total_cmp(&b.squares));
        best.map_or_else(SharedMixture::default, |best| self.mixture(&best.x))
    }

    /// At most `most` starts of evenly spaced widths, by what their best weights alone reach, best
    /// first; none for a material without lobes.
    #[must_use]
    pub fn even_starts(&self, most: usize) -> Vec<Minimum> {
        // Without goals the squares of every start are 0, and nothing tells them apart.
        if self.goals.is_empty() {
            return Vec::new();
        }
        const FROM: [f64; 9] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
        let mut weighed = FROM.map(|from| self.weigh(self.even_widths(from))).to_vec();
        weighed.sort_by(|a, b| a.squares.total_cmp(&b.squares));
        weighed.truncate(most);
        weighed
    }

    /// The starts that `x`, of one component fewer, gives with a component between two neighbouring
    /// widths or beyond the last, best first. Its weights are solved for from 0.
    #[must_use]
    pub fn grown(&self, x: &DVector<f64>) -> Vec<Minimum> {
        let n = self.count;
        let mut widths: Vec<f64> = x.rows(0, n - 1).iter().copied().collect();
        widths.sort_by(f64::total_cmp);
        let [low, high] = self.range;
        // With the ends of the range, so that the new one may be the narrowest or the widest.
        let ends = [&[low][..], &widths, &[high]].concat();
        let between = ends.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        let mut weighed: Vec<Minimum> =
            between.map(|width| self.weigh(self.with_width(x, width))).collect();
        weighed.sort_by(|a, b| a.squares.total_cmp(&b.squares));
        weighed
    }

    /// `x`, of one component fewer, with an idle component of its first width: the same mixture.
    #[must_use]
    pub fn split(&self, x: &DVector<f64>) -> DVector<f64> {
        self.with_width(x, x[0])
    }

    /// `x`, of one component fewer, with a component of this ln α and weight 0.
    fn with_width(&self, x: &DVector<f64>, width: f64) -> DVector<f64> {
        let n = self.count;
        DVector::from_fn(self.unknowns(), |i, _| match (i / n, i % n) {
            (0, j) if j == n - 1 => width,
            (_, j) if j == n - 1 => 0.0,
            (row, j) => x[row * (n - 1) + j],
        })
    }

    /// The solution of least squares that so many steps reach from `start`.
    #[must_use]
    pub fn descend(&self, start: &DVector<f64>, steps: usize, tolerance: f64) -> DVector<f64> {
        minimise_in(steps, |x| self.equations(x), start, &self.bounds(), tolerance).x
    }

    /// The solution of least Σ |e|^p for one even p after another, each from the one before: as p
    /// grows, of the least largest error.
    #[must_use]
    pub fn level(&self, start: &DVector<f64>, exponents: &[i32]) -> DVector<f64> {
        const STEPS: usize = 40;
        /// Relative decrease of the norm at which a power's search ends.
        const TOLERANCE: f64 = 1e-4;
        /// The largest error of a solution that is exact.
        const ROUNDING: f64 = 1e-14;
        let mut problem = self.clone();
        let mut x = start.clone();
        for exponent in exponents {
            // In units of the largest error no power of an error overflows.
            let unit = self.largest_error(&x);
            if unit < ROUNDING {
                break;
            }
            problem.norm = Norm { exponent: *exponent, unit };
            // The sum of powers changes p times as much, relative, as the error itself.
            let end = TOLERANCE * f64::from(*exponent);
            x = problem.descend(&x, STEPS, end);
        }
        x
    }

    /// The largest |e| of all angles.
    fn largest_error(&self, x: &DVector<f64>) -> f64 {
        let [density, _] = self.basis(&x.rows(0, self.count).map(f64::exp));
        let errors = (0..self.goals.len()).map(|lobe| self.errors(lobe, x, &density).amax());
        errors.fold(0.0, f64::max)
    }

    /// The best weights for the widths of `x`: one quadratic problem per lobe.
    fn weigh(&self, mut x: DVector<f64>) -> Minimum {
        let n = self.count;
        let NormalEquations { mut squares, gradient, hessian } = self.equations(&x);
        for lobe in 0..self.goals.len() {
            let first = (1 + lobe) * n;
            let bounds = Bounds {
                // The step's bounds: weights stay ≥ 0.
                lower: -x.rows(first, n).into_owned(),
                upper: DVector::repeat(n, f64::INFINITY),
            };
            // At fixed widths the lobes have no unknown in common: each has its own block. Damping
            // 0 leaves the floor alone, which keeps the block of nearly equal widths definite.
            let hessian = damped(&hessian.view((first, first), (n, n)).into_owned(), 0.0);
            let gradient = gradient.rows(first, n).into_owned();
            let step = box_quadratic(&hessian, &gradient, &bounds);
            x.rows_mut(first, n).zip_apply(&step, |x, step| *x = (*x + step).max(0.0));
            // Linear in the weights: the quadratic model is exact.
            let mut curved = DVector::zeros(n);
            curved.sygemv(1.0, &hessian, &step, 0.0);
            squares += 2.0 * gradient.dot(&step) + step.dot(&curved);
        }
        Minimum { squares, x }
    }

    /// Widths in their range, weights ≥ 0.
    fn bounds(&self) -> Bounds {
        let n = self.count;
        let [low, high] = self.range;
        let mut bounds = Bounds::non_negative(self.unknowns());
        bounds.lower.rows_mut(0, n).fill(low - self.below);
        bounds.upper.rows_mut(0, n).fill(high);
        bounds
    }

    fn equations(&self, x: &DVector<f64>) -> NormalEquations {
        let n = self.count;
        let basis = self.basis(&x.rows(0, n).map(f64::exp));
        let mut equations = NormalEquations::zero(self.unknowns());
        for lobe in 0..self.goals.len() {
            self.add_lobe(&mut equations, lobe, x, &basis);
        }
        equations
    }

    /// D of each lobe at each angle (columns), and ∂D/∂lnα = 2 (x/α² − 1) D.
    fn basis(&self, alpha: &DVector<f64>) -> [DMatrix<f64>; 2] {
        let density = DMatrix::from_fn(self.tan2_theta.len(), self.count, |i, j| {
            Beckmann { alpha: alpha[j] }.ndf(self.tan2_theta[i])
        });
        let slope = DMatrix::from_fn(self.tan2_theta.len(), self.count, |i, j| {
            2.0 * (self.tan2_theta[i] / (alpha[j] * alpha[j]) - 1.0) * density[(i, j)]
        });
        [density, slope]
    }

    /// D_fit − D times its scale at each angle of a lobe.
    fn errors(&self, lobe: usize, x: &DVector<f64>, density: &DMatrix<f64>) -> DVector<f64> {
        let fitted = density * x.rows((1 + lobe) * self.count, self.count);
        let goals = &self.goals[lobe];
        DVector::from_fn(goals.len(), |i, _| goals[i].1 * fitted[i] - goals[i].0)
    }

    /// Adds the terms of a lobe's errors and the condition on its weights' sum.
    fn add_lobe(
        &self,
        equations: &mut NormalEquations,
        lobe: usize,
        x: &DVector<f64>,
        basis: &[DMatrix<f64>; 2],
    ) {
        let n = self.count;
        let errors = self.errors(lobe, x, &basis[0]);
        let (jacobian, residual) = self.rows(lobe, x, &errors, basis);
        equations.squares += errors.iter().map(|error| self.norm.term(*error)).sum::<f64>();
        equations.squares += residual[residual.len() - 1].powi(2);
        let gradient = jacobian.tr_mul(&residual);
        // The unknowns of this lobe: the n widths, then its own n weights.
        let first = (1 + lobe) * n;
        let places: Vec<usize> = (0..n).chain(first..first + n).collect();
        for i in 0..2 * n {
            equations.gradient[places[i]] += gradient[i];
            // Only the lower triangle is read.
            for j in 0..=i {
                let product = jacobian.column(i).dot(&jacobian.column(j));
                equations.hessian[(places[i], places[j])] += product;
            }
        }
    }

    /// The rows of a lobe's errors, and last the row of the condition on its weights' sum: their
    /// derivatives by the widths and the lobe's weights, and their values.
    ///
    /// Newton's equations of Σ |e/u|^p are those of least squares with rows times √(ω (p − 1)) and
    /// errors times √(ω/(p − 1)), ω = [`Norm::weight`].
    fn rows(
        &self,
        lobe: usize,
        x: &DVector<f64>,
        errors: &DVector<f64>,
        [density, slope]: &[DMatrix<f64>; 2],
    ) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.count;
        let order = f64::from(self.norm.exponent - 1);
        // A high power sees few of the angles.
        let weights = errors.map(|error| self.norm.weight(error));
        // What the sum would lose to rounding: with p = 256 errors below 0.88 of the largest.
        let seen = 1e-14 * weights.max();
        let seen: Vec<usize> = (0..errors.len()).filter(|i| weights[*i] >= seen).collect();
        let mut jacobian = DMatrix::zeros(seen.len() + 1, 2 * n);
        let mut residual = DVector::zeros(seen.len() + 1);
        for (row, i) in seen.iter().copied().enumerate() {
            let root = (weights[i] * order).sqrt();
            residual[row] = errors[i] * root / order;
            let scale = self.goals[lobe][i].1 * root;
            for j in 0..n {
                jacobian[(row, j)] = scale * x[(1 + lobe) * n + j] * slope[(i, j)];
                jacobian[(row, n + j)] = scale * density[(i, j)];
            }
        }
        // In the norm's own units: an error of one unit has the weight p/2, over unit².
        let sum_weight = SUM_WEIGHT * f64::from(self.norm.exponent / 2).sqrt() / self.norm.unit;
        jacobian.view_mut((seen.len(), n), (1, n)).fill(sum_weight);
        residual[seen.len()] = sum_weight * (x.rows((1 + lobe) * n, n).sum() - 1.0);
        (jacobian, residual)
    }

    /// The mixture of a solution, weights scaled to sum exactly to 1, widths ascending.
    #[must_use]
    pub fn mixture(&self, x: &DVector<f64>) -> SharedMixture {
        let n = self.count;
        let lobes = 0..self.goals.len();
        // The condition holds the sums near 1 but not at it.
        let sums: Vec<f64> = lobes.map(|lobe| x.rows((1 + lobe) * n, n).sum()).collect();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| x[*a].total_cmp(&x[*b]));
        let weights = order.iter().map(|j| {
            let lobes = sums.iter().enumerate();
            lobes.map(|(lobe, sum)| x[(1 + lobe) * n + j] / sum).collect()
        });
        SharedMixture {
            alpha: order.iter().map(|j| x[*j].exp()).collect(),
            weights: weights.collect(),
        }
    }
}

/// tan²θ from 0 to where every lobe's D has vanished, spaced by ln(1 + x/s).
#[must_use]
pub fn angles(lobes: &[LobeParams], count: usize) -> Vec<f64> {
    let scale = lobes.iter().map(core_tan2).fold(f64::INFINITY, f64::min) * 0.1;
    // e^(−20) of the peak is left at the end: x/α = 20.
    let largest = lobes.iter().map(LobeParams::alpha).fold(0.0, f64::max) * 20.0;
    let length = (largest / scale).ln_1p();
    (0..count).map(|i| scale * (length * i as f64 / (count - 1) as f64).exp_m1()).collect()
}

/// tan²θ at which a lobe's distribution starts to bend.
fn core_tan2(lobe: &LobeParams) -> f64 {
    // −1/(d ln P22/dx) at x = 0, with P22 ∝ e⁻ᵗ t⁻ᵖ and t = α + x/α.
    lobe.alpha() / (1.0 + lobe.p() / lobe.alpha())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::picture;

    /// A start's sum of squares, taken from the quadratic model, is the one at its weights, to
    /// the rounding of what it was taken down from.
    #[test]
    fn weighed_starts_know_their_squares() {
        for name in ["chrome", "pink-fabric", "gold-metallic-paint2"] {
            let material = &crate::material::find(name).expect("in the catalogue").material;
            let problem = Problem::new(material, 7, picture::goals, 40);
            for from in [0.0, 0.4, 0.8] {
                let even = problem.even_widths(from);
                let before = problem.equations(&even).squares;
                let start = problem.weigh(even);
                let squares = problem.equations(&start.x).squares;
                assert!((start.squares - squares).abs() < 1e-10 * before, "{name} {from}");
            }
        }
    }
}
