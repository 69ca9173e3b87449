//! The best few Beckmann lobes, their widths shared by the three channels.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::brdf::LobesBrdf;
use crate::brdf::lobes::Lobes;
use crate::fit::picture;
use crate::fit::reason::{self, Reason};
use crate::fit::target::{Residuals, Target};
use crate::material::{ChannelParams, Material};
use crate::math::box_least_squares::{
    Bounds, Minimum, NormalEquations, box_quadratic, damped, minimise,
};
use crate::microfacet::{BeckmannNdf, SgdNdf};

/// The best mixture of a given number of lobes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LobesFit {
    /// Widths and weights.
    #[serde(flatten)]
    pub lobes: Lobes,
    /// max |D_fit − D|/(D(0) + D) over all angles, per channel.
    pub ndf_error: [f64; 3],
    /// How far the reflectance through these lobes is from the material.
    pub residuals: Residuals,
    /// What is odd about the material.
    pub reasons: Vec<Reason>,
}

/// The most lobes that are of use: SGD's mixture is resolved to rounding with fewer.
pub const MOST_LOBES: usize = 32;

/// Angles at which the distributions are compared while fitting, and when the fit is judged.
const SAMPLES: usize = 40;
const JUDGED_SAMPLES: usize = 400;

/// Relative decrease of the sum of squares at which the search ends.
const TOLERANCE: f64 = 1e-5;

/// The weight of the condition Σ_j w_j = 1 next to one sample's relative error.
const SUM_WEIGHT: f64 = 1e2;

/// The fewest lobes, from seven to ten, whose picture is within half a percent of a material's.
///
/// [`lobes`] of each count in turn, judged by [`picture::error`]; ten where none is.
#[must_use]
pub fn for_picture(material: &Material) -> Lobes {
    const FEWER: std::ops::Range<usize> = 7..10;
    const TOLERANCE: f64 = 5e-3;
    let close = |lobes: &Lobes| picture::error(&material.channels, lobes) <= TOLERANCE;
    let mut few = FEWER.map(|count| lobes(material, count));
    few.find(close).unwrap_or_else(|| lobes(material, FEWER.end))
}

/// The mixture of `count` Beckmann lobes that looks most like a material.
///
/// Least squares of D_fit − D, weighted as in a picture ([`picture::goals`]), over angles spaced by
/// the lobe's own logarithm, in all log widths and non-negative weights at once. Widths start
/// spaced evenly in ln α over the ranges whose weights alone do best. `count` is taken into
/// [1, [`MOST_LOBES`]].
#[must_use]
pub fn lobes(material: &Material, count: usize) -> Lobes {
    Problem::new(material, count.clamp(1, MOST_LOBES), picture::goals).solve()
}

/// The mixture of `count` Beckmann lobes whose distribution is closest to a material's.
///
/// As [`lobes`], with the relative error (D_fit − D)/(D(0) + D) of every channel in place of the
/// picture's: no channel is given up for being dark, no angle for being small.
#[must_use]
pub fn fit(material: &Material, count: usize) -> LobesFit {
    fit_target(&Target::new(material), count)
}

/// [`fit`] for a target's material.
#[must_use]
pub fn fit_target(target: &Target, count: usize) -> LobesFit {
    let material = &target.material;
    let count = count.clamp(1, MOST_LOBES);
    let lobes = Problem::new(material, count, distribution_goals).solve();
    LobesFit {
        ndf_error: std::array::from_fn(|c| ndf_error(&lobes, c, &material.channels[c])),
        residuals: target.residuals(&LobesBrdf::new(material, &lobes)),
        reasons: reason::of_material(material),
        lobes,
    }
}

/// (D, 1) at each angle over D(0) + D, per channel.
fn distribution_goals(channels: &[ChannelParams; 3], tan2_theta: &[f64]) -> Goals {
    channels.each_ref().map(|c| {
        let ndf = SgdNdf::new(c.alpha, c.p);
        let at = |x: &f64| {
            let d = ndf.eval(*x);
            (d / (ndf.peak() + d), 1.0 / (ndf.peak() + d))
        };
        tan2_theta.iter().map(at).collect()
    })
}

/// max |D_fit − D|/(D(0) + D) of one channel.
#[must_use]
pub fn ndf_error(lobes: &Lobes, channel: usize, params: &ChannelParams) -> f64 {
    let exact = SgdNdf::new(params.alpha, params.p);
    let mixture = lobes.channel(channel);
    let error = |x: &f64| {
        let d = exact.eval(*x);
        (mixture.ndf(*x) - d).abs() / (exact.peak() + d)
    };
    angles(std::slice::from_ref(params), JUDGED_SAMPLES).iter().map(error).fold(0.0, f64::max)
}

/// tan²θ from 0 to where every channel's D has vanished, spaced by ln(1 + x/s).
fn angles(channels: &[ChannelParams], count: usize) -> Vec<f64> {
    let scale = channels.iter().map(core_tan2).fold(f64::INFINITY, f64::min) * 0.1;
    let largest = channels.iter().map(|c| c.alpha).fold(0.0, f64::max) * 20.0;
    let length = (largest / scale).ln_1p();
    (0..count).map(|i| scale * (length * i as f64 / (count - 1) as f64).exp_m1()).collect()
}

/// tan²θ at which a channel's distribution starts to bend.
fn core_tan2(c: &ChannelParams) -> f64 {
    c.alpha / (1.0 + c.p / c.alpha)
}

/// D times its scale, and the scale, at each angle, per channel.
type Goals = [Vec<(f64, f64)>; 3];

/// The unknowns are n values of ln α, then n weights for each channel.
struct Problem {
    count: usize,
    tan2_theta: Vec<f64>,
    goals: Goals,
    /// The range of ln α.
    range: [f64; 2],
}

impl Problem {
    fn new(
        material: &Material,
        count: usize,
        goals: impl Fn(&[ChannelParams; 3], &[f64]) -> Goals,
    ) -> Self {
        let channels = &material.channels;
        let tan2_theta = angles(channels, SAMPLES);
        let goals = goals(channels, &tan2_theta);
        let narrowest = channels.iter().map(core_tan2).fold(f64::INFINITY, f64::min);
        let widest = channels.iter().map(|c| c.alpha).fold(0.0, f64::max);
        let range = [0.5 * (0.1 * narrowest).ln(), 0.5 * widest.ln() + 0.1];
        Self { count, tan2_theta, goals, range }
    }

    /// Widths spaced evenly in ln α from a given share of the range up; equal weights.
    fn even_widths(&self, from: f64) -> DVector<f64> {
        let [low, high] = self.range;
        let low = low + from * (high - low);
        DVector::from_fn(4 * self.count, |i, _| match self.count {
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

    /// From the starts whose weights alone do best, the best end.
    fn solve(&self) -> Lobes {
        const FROM: [f64; 9] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
        const DESCENTS: usize = 3;
        let mut weighed = FROM.map(|from| self.weigh(self.even_widths(from)));
        weighed.sort_by(|a, b| a.squares.total_cmp(&b.squares));
        let ends = weighed[..DESCENTS]
            .iter()
            .map(|start| minimise(|x| self.equations(x), &start.x, &self.bounds(), TOLERANCE));
        let best = ends.min_by(|a, b| a.squares.total_cmp(&b.squares));
        self.lobes(&best.expect("there are several descents").x)
    }

    /// The best weights for the widths of `x`: one quadratic problem per channel.
    fn weigh(&self, mut x: DVector<f64>) -> Minimum {
        let n = self.count;
        let NormalEquations { mut squares, gradient, hessian } = self.equations(&x);
        for c in 0..3 {
            let first = (1 + c) * n;
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
            lower: DVector::from_fn(4 * n, |i, _| side(i, low, 0.0)),
            upper: DVector::from_fn(4 * n, |i, _| side(i, high, f64::INFINITY)),
        }
    }

    fn equations(&self, x: &DVector<f64>) -> NormalEquations {
        let n = self.count;
        let basis = self.basis(&x.rows(0, n).map(f64::exp));
        let mut equations = NormalEquations::zero(4 * n);
        for c in 0..3 {
            self.add_channel(&mut equations, c, x, &basis);
        }
        equations
    }

    /// D of each lobe at each angle (columns), and ∂D/∂lnα = 2 (x/α² − 1) D.
    fn basis(&self, alpha: &DVector<f64>) -> [DMatrix<f64>; 2] {
        let density = |i: usize, j: usize| BeckmannNdf { alpha: alpha[j] }.eval(self.tan2_theta[i]);
        let density = DMatrix::from_fn(self.tan2_theta.len(), self.count, density);
        let slope = DMatrix::from_fn(self.tan2_theta.len(), self.count, |i, j| {
            2.0 * (self.tan2_theta[i] / (alpha[j] * alpha[j]) - 1.0) * density[(i, j)]
        });
        [density, slope]
    }

    /// Adds a channel's relative errors and the condition on its weights' sum.
    fn add_channel(
        &self,
        equations: &mut NormalEquations,
        c: usize,
        x: &DVector<f64>,
        [density, slope]: &[DMatrix<f64>; 2],
    ) {
        let n = self.count;
        let samples = self.tan2_theta.len();
        let weights = x.rows((1 + c) * n, n);
        let mut jacobian = DMatrix::zeros(samples + 1, 2 * n);
        let mut residual = DVector::zeros(samples + 1);
        for (i, (goal, scale)) in self.goals[c].iter().enumerate() {
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
        // Unknown j of this channel: the n widths, then its own n weights.
        let place = |j: usize| if j < n { j } else { j + c * n };
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
    fn lobes(&self, x: &DVector<f64>) -> Lobes {
        let n = self.count;
        let sums: [f64; 3] = std::array::from_fn(|c| x.rows((1 + c) * n, n).sum());
        let weight = |j: usize| std::array::from_fn(|c| x[(1 + c) * n + j] / sums[c]);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| x[*a].total_cmp(&x[*b]));
        Lobes {
            alpha: order.iter().map(|j| x[*j].exp()).collect(),
            weights: order.iter().map(|j| weight(*j)).collect(),
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
    fn a_picture_takes_more_lobes_where_seven_are_too_few() {
        for entry in catalog().iter().step_by(3) {
            let lobes = for_picture(&entry.material);
            let error = picture::error(&entry.material.channels, &lobes);
            assert!(error <= 5e-3, "{}: {} {error}", entry.material.name, lobes.alpha.len());
        }
        let count = |name| {
            for_picture(&crate::material::find(name).expect("in the catalogue").material)
                .alpha
                .len()
        };
        assert_eq!([count("gold-paint"), count("green-plastic"), count("steel")], [7, 8, 9]);
    }

    #[test]
    fn the_weights_of_a_channel_sum_to_one() {
        for entry in catalog().iter().step_by(7) {
            let lobes = lobes(&entry.material, 8);
            for c in 0..3 {
                let sum: f64 = lobes.weights.iter().map(|w| w[c]).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{} channel {c}: {sum}", entry.material.name);
            }
        }
    }
}
