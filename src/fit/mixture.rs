//! The best mixture of a few Beckmann distributions, their widths shared by the lobes of a material.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::brdf::Brdf;
use crate::fit::picture;
use crate::fit::reason::{self, Reason};
use crate::fit::target::{Residuals, Target};
use crate::material::{LobeParams, Material};
use crate::math::least_squares::{
    Bounds, Minimum, NormalEquations, box_quadratic, damped, minimise, minimise_in,
};
use crate::microfacet::{Beckmann, Distribution as _, SgdNdf, SharedMixture};

/// The best mixture of a given number of components.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MixtureFit {
    /// Widths and weights.
    #[serde(flatten)]
    pub mixture: SharedMixture,
    /// max |D_fit − D|/(D(0) + D) over all angles, per lobe.
    pub ndf_error: Vec<f64>,
    /// How far the reflectance through the mixture is from the material.
    pub residuals: Residuals,
    /// Oddities of the material.
    pub reasons: Vec<Reason>,
}

/// The most components that are of use: SGD is resolved to rounding with fewer.
pub const MAX_COMPONENTS: usize = 32;

/// Angles at which the distributions are compared while fitting, and when the fit is judged.
const SAMPLES: usize = 40;
const JUDGED_SAMPLES: usize = 400;

/// Relative decrease of the sum of squares at which the search ends.
const TOLERANCE: f64 = 1e-5;
/// Starts of a fit to a picture that are followed.
const DESCENTS: usize = 3;
/// The same of the fit to the distributions, whose valleys are long.
const FINE_TOLERANCE: f64 = 1e-7;
const FINE_STEPS: usize = 80;
/// Angles of the fit to the distributions.
const FINE_SAMPLES: usize = 48;

/// The weight of the condition Σ_j w_j = 1 next to one sample's relative error.
const SUM_WEIGHT: f64 = 1e2;

/// The mixture of the fewest components, from seven to ten, whose picture is within half a percent
/// of a material's.
///
/// [`best_picture`] of each count in turn, judged by `picture::error`; ten where none is.
#[must_use]
pub fn for_picture(material: &Material) -> SharedMixture {
    const FEWER: std::ops::Range<usize> = 7..10;
    const TOLERANCE: f64 = 5e-3;
    let close = |mixture: &SharedMixture| picture::error(material, mixture) <= TOLERANCE;
    let mut few = FEWER.map(|count| best_picture(material, count));
    few.find(close).unwrap_or_else(|| best_picture(material, FEWER.end))
}

/// The mixture of `count` Beckmann distributions that looks most like a material.
///
/// Least squares of D_fit − D, weighted as in a picture (`picture::goals`), over angles spaced by
/// the lobe's own logarithm, in all log widths and non-negative weights at once. Widths start
/// spaced evenly in ln α over the ranges whose weights alone do best. `count` is taken into
/// [1, [`MAX_COMPONENTS`]].
#[must_use]
pub fn best_picture(material: &Material, count: usize) -> SharedMixture {
    Problem::new(material, count.clamp(1, MAX_COMPONENTS), picture::goals).solve()
}

/// The mixture of `count` Beckmann distributions that is closest to a material's lobes.
///
/// As [`best_picture`], with the relative error (D_fit − D)/(D(0) + D) of every lobe in place of
/// the picture's: no lobe is given up for being dark, no angle for being small.
///
/// # Example
///
/// ```
/// use sgdbake::{fit_mixture, named};
///
/// let fit = fit_mixture(named("gold-paint")?, 2);
/// assert_eq!(fit.mixture.alpha.len(), 2);
/// println!("largest error of D, relative: {:.3?}", fit.ndf_error);
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
#[must_use]
pub fn fit(material: &Material, count: usize) -> MixtureFit {
    fit_target(&Target::new(material), count, Objective::default())
}

/// The norm of a mixture's errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Objective {
    /// The sum of their squares.
    #[default]
    LeastSquares,
    /// The largest of them.
    Minimax,
}

/// [`fit`] for a target's material, by an objective.
#[must_use]
pub fn fit_target(target: &Target, count: usize, objective: Objective) -> MixtureFit {
    let material = &target.material;
    let count = count.clamp(1, MAX_COMPONENTS);
    let mixture = closest(material, count, objective);
    let lobes = material.lobes().iter().enumerate();
    MixtureFit {
        ndf_error: lobes.map(|(j, lobe)| ndf_error(&mixture, j, lobe)).collect(),
        residuals: target.residuals(&Brdf::of_mixture(material, &mixture)),
        reasons: reason::of_material(material),
        mixture,
    }
}

/// The mixture whose distributions are closest: for one component after another, from the best so
/// far with a component more and from widths spaced evenly, so that the largest error never rises
/// with the count.
fn closest(material: &Material, count: usize, objective: Objective) -> SharedMixture {
    let largest_error = |mixture: &SharedMixture| {
        let lobes = material.lobes().iter().enumerate();
        lobes.map(|(j, lobe)| ndf_error(mixture, j, lobe)).fold(0.0, f64::max)
    };
    let mut best: Option<(f64, SharedMixture, DVector<f64>)> = None;
    for n in 1..=count {
        let problem = Problem::with_samples(material, n, distribution_goals, FINE_SAMPLES);
        let grown = best.as_ref().map(|(_, _, x)| problem.grown(x));
        let starts = problem.best(1).into_iter().map(|even| even.x).chain(grown);
        let mut ends: Vec<DVector<f64>> = starts.map(|start| problem.descend(&start).x).collect();
        if n == count && objective == Objective::Minimax {
            let levelled = ends.iter().map(|x| problem.clone().level(x.clone()));
            ends = levelled.collect();
        }
        let judged = ends.into_iter().map(|x| {
            let mixture = problem.mixture(&x);
            (largest_error(&mixture), mixture, x)
        });
        let found = judged.min_by(|a, b| a.0.total_cmp(&b.0));
        best = match (best, found) {
            (Some(before), Some(found)) if before.0 < found.0 => {
                let (error, mixture, x) = before;
                Some((error, mixture, problem.split(&x)))
            }
            (_, found) => found,
        };
    }
    best.map_or_else(SharedMixture::default, |(_, mixture, _)| mixture)
}

/// (D, 1) at each angle over D(0) + D, per lobe.
fn distribution_goals(material: &Material, tan2_theta: &[f64]) -> Goals {
    let of_lobe = |lobe: &LobeParams| {
        let ndf = SgdNdf::new(lobe.alpha(), lobe.p());
        let at = |x: &f64| {
            let d = ndf.ndf(*x);
            (d / (ndf.peak() + d), 1.0 / (ndf.peak() + d))
        };
        tan2_theta.iter().map(at).collect()
    };
    material.lobes().iter().map(of_lobe).collect()
}

/// max |D_fit − D|/(D(0) + D) of one lobe.
#[must_use]
pub fn ndf_error(mixture: &SharedMixture, index: usize, lobe: &LobeParams) -> f64 {
    let exact = SgdNdf::new(lobe.alpha(), lobe.p());
    let mixture = mixture.of_lobe(index);
    let error = |x: &f64| {
        let d = exact.ndf(*x);
        (mixture.ndf(*x) - d).abs() / (exact.peak() + d)
    };
    angles(std::slice::from_ref(lobe), JUDGED_SAMPLES).iter().map(error).fold(0.0, f64::max)
}

/// tan²θ from 0 to where every lobe's D has vanished, spaced by ln(1 + x/s).
fn angles(lobes: &[LobeParams], count: usize) -> Vec<f64> {
    let scale = lobes.iter().map(core_tan2).fold(f64::INFINITY, f64::min) * 0.1;
    let largest = lobes.iter().map(LobeParams::alpha).fold(0.0, f64::max) * 20.0;
    let length = (largest / scale).ln_1p();
    (0..count).map(|i| scale * (length * i as f64 / (count - 1) as f64).exp_m1()).collect()
}

/// tan²θ at which a lobe's distribution starts to bend.
fn core_tan2(lobe: &LobeParams) -> f64 {
    lobe.alpha() / (1.0 + lobe.p() / lobe.alpha())
}

/// D times its scale, and the scale, at each angle, per lobe.
type Goals = Vec<Vec<(f64, f64)>>;

/// The unknowns are n values of ln α, then n weights for each lobe.
#[derive(Clone)]
struct Problem {
    count: usize,
    tan2_theta: Vec<f64>,
    goals: Goals,
    /// The range of ln α.
    range: [f64; 2],
}

impl Problem {
    fn new(material: &Material, count: usize, goals: impl Fn(&Material, &[f64]) -> Goals) -> Self {
        Self::with_samples(material, count, goals, SAMPLES)
    }

    fn with_samples(
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
        let range = [0.5 * (0.1 * narrowest).ln(), 0.5 * widest.ln() + 0.1];
        Self { count, tan2_theta, goals, range }
    }

    /// How many unknowns there are.
    fn unknowns(&self) -> usize {
        (1 + self.goals.len()) * self.count
    }

    /// Widths spaced evenly in ln α from a given share of the range up; equal weights.
    fn even_widths(&self, from: f64) -> DVector<f64> {
        let [low, high] = self.range;
        let low = low + from * (high - low);
        DVector::from_fn(self.unknowns(), |i, _| match self.count {
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
    fn solve(&self) -> SharedMixture {
        let best = self.best(DESCENTS);
        best.map_or_else(SharedMixture::default, |best| self.mixture(&best.x))
    }

    /// A solution of one component fewer with one more, where that helps most: its weight is 0
    /// before the weights are solved for.
    fn grown(&self, x: &DVector<f64>) -> DVector<f64> {
        let n = self.count;
        let mut widths: Vec<f64> = x.rows(0, n - 1).iter().copied().collect();
        widths.sort_by(f64::total_cmp);
        let [low, high] = self.range;
        let ends = [&[low][..], &widths, &[high]].concat();
        let between = ends.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        let weighed = between.map(|width| self.weigh(self.with_width(x, width)));
        let best = weighed.min_by(|a, b| a.squares.total_cmp(&b.squares));
        best.map_or_else(|| self.split(x), |best| best.x)
    }

    /// The same solution with its first component counted twice.
    fn split(&self, x: &DVector<f64>) -> DVector<f64> {
        self.with_width(x, x[0])
    }

    /// A solution of one component fewer with one more of this ln α, of weight 0.
    fn with_width(&self, x: &DVector<f64>, width: f64) -> DVector<f64> {
        let n = self.count;
        DVector::from_fn(self.unknowns(), |i, _| match (i / n, i % n) {
            (0, j) if j == n - 1 => width,
            (_, j) if j == n - 1 => 0.0,
            (block, j) => x[block * (n - 1) + j],
        })
    }

    /// The minimum that a fine descent from `start` reaches.
    fn descend(&self, start: &DVector<f64>) -> Minimum {
        minimise_in(FINE_STEPS, |x| self.equations(x), start, &self.bounds(), FINE_TOLERANCE)
    }

    /// The solution whose largest error is least, by Lawson's algorithm: each angle counts in
    /// proportion to its error, again and again.
    fn level(&mut self, start: DVector<f64>) -> DVector<f64> {
        const ROUNDS: usize = 12;
        const STEPS: usize = 12;
        let plain = self.goals.clone();
        let (mut x, mut best) = (start.clone(), (self.largest_error(&plain, &start), start));
        let mut shares: Vec<Vec<f64>> = plain.iter().map(|lobe| vec![1.0; lobe.len()]).collect();
        for _ in 0..ROUNDS {
            for (lobe, (shares, goals)) in shares.iter_mut().zip(&plain).enumerate() {
                let errors = self.errors(lobe, goals, &x);
                let largest = errors.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
                for (share, error) in shares.iter_mut().zip(errors) {
                    *share *= 0.1 + error / largest;
                }
                let mean = shares.iter().sum::<f64>() / shares.len() as f64;
                shares.iter_mut().for_each(|share| *share /= mean);
                self.goals[lobe] = goals
                    .iter()
                    .zip(shares.iter())
                    .map(|((goal, scale), share)| (goal * share.sqrt(), scale * share.sqrt()))
                    .collect();
            }
            x = minimise_in(STEPS, |x| self.equations(x), &x, &self.bounds(), TOLERANCE).x;
            let largest = self.largest_error(&plain, &x);
            if largest < best.0 {
                best = (largest, x.clone());
            }
        }
        best.1
    }

    /// |D_fit − D| times its scale at each angle of a lobe.
    fn errors(&self, lobe: usize, goals: &[(f64, f64)], x: &DVector<f64>) -> Vec<f64> {
        let n = self.count;
        let [density, _] = self.basis(&x.rows(0, n).map(f64::exp));
        let weights = x.rows((1 + lobe) * n, n);
        let fitted = density * (weights / weights.sum());
        goals.iter().zip(fitted.iter()).map(|((goal, scale), d)| (scale * d - goal).abs()).collect()
    }

    fn largest_error(&self, goals: &Goals, x: &DVector<f64>) -> f64 {
        let errors = goals.iter().enumerate().flat_map(|(lobe, goals)| self.errors(lobe, goals, x));
        errors.fold(0.0, f64::max)
    }

    /// From the starts whose weights alone do best, so many, the best end; none of a material
    /// without lobes.
    fn best(&self, descents: usize) -> Option<Minimum> {
        if self.goals.is_empty() {
            return None;
        }
        const FROM: [f64; 9] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
        let mut weighed = FROM.map(|from| self.weigh(self.even_widths(from)));
        weighed.sort_by(|a, b| a.squares.total_cmp(&b.squares));
        let ends = weighed[..descents]
            .iter()
            .map(|start| minimise(|x| self.equations(x), &start.x, &self.bounds(), TOLERANCE));
        ends.min_by(|a, b| a.squares.total_cmp(&b.squares))
    }

    /// The best weights for the widths of `x`: one quadratic problem per lobe.
    fn weigh(&self, mut x: DVector<f64>) -> Minimum {
        let n = self.count;
        let NormalEquations { mut squares, gradient, hessian } = self.equations(&x);
        for lobe in 0..self.goals.len() {
            let first = (1 + lobe) * n;
            let bounds = Bounds {
                lower: -x.rows(first, n).into_owned(),
                upper: DVector::repeat(n, f64::INFINITY),
            };
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
        let side =
            |i: usize, of_widths: f64, of_weights: f64| if i < n { of_widths } else { of_weights };
        let [low, high] = self.range;
        Bounds {
            lower: DVector::from_fn(self.unknowns(), |i, _| side(i, low, 0.0)),
            upper: DVector::from_fn(self.unknowns(), |i, _| side(i, high, f64::INFINITY)),
        }
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
        let density = |i: usize, j: usize| Beckmann { alpha: alpha[j] }.ndf(self.tan2_theta[i]);
        let density = DMatrix::from_fn(self.tan2_theta.len(), self.count, density);
        let slope = DMatrix::from_fn(self.tan2_theta.len(), self.count, |i, j| {
            2.0 * (self.tan2_theta[i] / (alpha[j] * alpha[j]) - 1.0) * density[(i, j)]
        });
        [density, slope]
    }

    /// Adds a lobe's relative errors and the condition on its weights' sum.
    fn add_lobe(
        &self,
        equations: &mut NormalEquations,
        lobe: usize,
        x: &DVector<f64>,
        [density, slope]: &[DMatrix<f64>; 2],
    ) {
        let n = self.count;
        let samples = self.tan2_theta.len();
        let weights = x.rows((1 + lobe) * n, n);
        let mut jacobian = DMatrix::zeros(samples + 1, 2 * n);
        let mut residual = DVector::zeros(samples + 1);
        for (i, (goal, scale)) in self.goals[lobe].iter().enumerate() {
            for j in 0..n {
                jacobian[(i, j)] = scale * weights[j] * slope[(i, j)];
                jacobian[(i, n + j)] = scale * density[(i, j)];
                residual[i] += scale * weights[j] * density[(i, j)];
            }
            residual[i] -= goal;
        }
        jacobian.view_mut((samples, n), (1, n)).fill(SUM_WEIGHT);
        residual[samples] = SUM_WEIGHT * (weights.sum() - 1.0);
        equations.squares += residual.norm_squared();
        let gradient = jacobian.tr_mul(&residual);
        // Unknown j of this lobe: the n widths, then its own n weights.
        let place = |j: usize| if j < n { j } else { j + lobe * n };
        for i in 0..2 * n {
            equations.gradient[place(i)] += gradient[i];
            // Only the lower triangle is read.
            for j in 0..=i {
                let product = jacobian.column(i).dot(&jacobian.column(j));
                equations.hessian[(place(i), place(j))] += product;
            }
        }
    }

    /// The mixture of a solution, weights scaled to sum exactly to 1, widths ascending.
    fn mixture(&self, x: &DVector<f64>) -> SharedMixture {
        let n = self.count;
        let lobes = 0..self.goals.len();
        let sums: Vec<f64> = lobes.clone().map(|lobe| x.rows((1 + lobe) * n, n).sum()).collect();
        let weights = |j: usize| -> Vec<f64> {
            lobes.clone().map(|lobe| x[(1 + lobe) * n + j] / sums[lobe]).collect()
        };
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| x[*a].total_cmp(&x[*b]));
        SharedMixture {
            alpha: order.iter().map(|j| x[*j].exp()).collect(),
            weights: order.iter().map(|j| weights(*j)).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::catalog;

    /// A start's sum of squares, taken from the quadratic model, is the one at its weights, to
    /// the rounding of what it was taken down from.
    #[test]
    fn weighed_starts_know_their_squares() {
        for name in ["chrome", "pink-fabric", "gold-metallic-paint2"] {
            let material = &crate::material::find(name).expect("in the catalogue").material;
            let problem = Problem::new(material, 7, picture::goals);
            for from in [0.0, 0.4, 0.8] {
                let even = problem.even_widths(from);
                let before = problem.equations(&even).squares;
                let start = problem.weigh(even);
                let squares = problem.equations(&start.x).squares;
                assert!((start.squares - squares).abs() < 1e-10 * before, "{name} {from}");
            }
        }
    }

    #[test]
    fn a_picture_takes_more_components_where_seven_are_too_few() {
        for entry in catalog().iter().step_by(3) {
            let mixture = for_picture(&entry.material);
            let error = picture::error(&entry.material, &mixture);
            assert!(error <= 5e-3, "{}: {} {error}", entry.material.name, mixture.alpha.len());
        }
        let count = |name| {
            for_picture(&crate::material::find(name).expect("in the catalogue").material)
                .alpha
                .len()
        };
        assert_eq!([count("gold-paint"), count("green-plastic"), count("steel")], [7, 8, 9]);
    }

    #[test]
    fn the_weights_of_a_lobe_sum_to_one() {
        for entry in catalog().iter().step_by(7) {
            let mixture = best_picture(&entry.material, 8);
            for lobe in 0..3 {
                let sum: f64 = mixture.weights.iter().map(|w| w[lobe]).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{} lobe {lobe}: {sum}", entry.material.name);
            }
        }
    }
}
