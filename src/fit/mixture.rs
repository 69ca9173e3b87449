//! The best mixture of a few Beckmann distributions, whose widths the lobes of a material share.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use crate::brdf::Brdf;
use crate::fit::mixture_problem::{Goals, Problem, angles};
use crate::fit::picture;
use crate::fit::reason::{self, Reason};
use crate::fit::target::{Residuals, Target};
use crate::material::{LobeParams, Material};
use crate::math::least_squares::Minimum;
use crate::microfacet::{Distribution as _, SgdNdf, SharedMixture};

/// The best mixture of a given number of components.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MixtureFit {
    /// Widths and weights.
    #[serde(flatten)]
    pub mixture: SharedMixture,
    /// max |D_fit − D|/(D(0) + D) over all angles, per lobe.
    pub ndf_error: Vec<f64>,
    /// The distance of the reflectance through the mixture from the material.
    pub residuals: Residuals,
    /// Oddities of the material.
    pub reasons: Vec<Reason>,
}

/// The most components that are of use: SGD is resolved to rounding with fewer.
pub const MAX_COMPONENTS: usize = 32;

/// Angles at which the distributions are compared while fitting, and when the fit is judged.
const SAMPLES: usize = 40;
const JUDGED_SAMPLES: usize = 400;

/// Angles of the first and of the last steps of the fit to the distributions.
const ANGLES: [usize; 2] = [48, 120];

/// Starts of evenly spaced widths; all but the first are tried only where that leads nowhere.
const STARTS: usize = 6;

/// The distance that ln α may go below the range of the starts: the best of many components have
/// one that is three times narrower than the bend of the distribution.
const ROOM: f64 = 1.5;

/// The mixture of the fewest components, from seven to ten, whose picture is within half a percent
/// of a material's.
///
/// [`best_picture`] of each count in turn, judged by `picture::error`; ten where none is.
#[must_use]
pub fn for_picture(material: &Material) -> SharedMixture {
    const FEWER: std::ops::Range<usize> = 7..10;
    const TOLERANCE: f64 = 5e-3;
    // Lazy: the counts beyond the first that is near enough are not fitted.
    let mut few = FEWER.map(|count| best_picture(material, count));
    few.find(|mixture| picture::error(material, mixture) <= TOLERANCE)
        .unwrap_or_else(|| best_picture(material, FEWER.end))
}

/// The mixture of `count` Beckmann distributions that looks most like a material.
///
/// Least squares of D_fit − D, weighted as in a picture (`picture::goals`), over angles spaced by
/// the lobe's own logarithm, in all log widths and non-negative weights at once. Widths start
/// spaced evenly in ln α over the ranges whose weights alone do best. `count` is taken into
/// [1, [`MAX_COMPONENTS`]].
#[must_use]
pub fn best_picture(material: &Material, count: usize) -> SharedMixture {
    Problem::new(material, count.clamp(1, MAX_COMPONENTS), picture::goals, SAMPLES).solve()
}

/// The mixture of `count` Beckmann distributions that is closest to a material's lobes.
///
/// Minimises the largest |D_fit − D|/(D(0) + D) of all angles and lobes, so that dark lobes and
/// small angles count as much as any other. Least squares come first, then Σ |e|^p of a p that
/// grows to 256. Each component more makes that error smaller, or leaves it where no start leads
/// to a smaller one.
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
    LeastSquares,
    /// The largest of them.
    #[default]
    Minimax,
}

/// [`fit`] for a target's material, by an objective.
#[must_use]
pub fn fit_target(target: &Target, count: usize, objective: Objective) -> MixtureFit {
    let material = &target.material;
    let count = count.clamp(1, MAX_COMPONENTS);
    let mixture = closest(material, count, objective);
    MixtureFit {
        ndf_error: ndf_errors(material, &mixture).collect(),
        residuals: target.residuals(&Brdf::of_mixture(material, &mixture)),
        reasons: reason::of_material(material),
        mixture,
    }
}

/// The mixture whose distributions are closest: for one component after another, from the best so
/// far with a component more and from widths spaced evenly, so that the largest error never rises
/// with the count.
fn closest(material: &Material, count: usize, objective: Objective) -> SharedMixture {
    let mut best: Option<Closest> = None;
    for n in 1..=count {
        // The best of n − 1 components is a start for n, so every count is fitted on the way.
        let [coarse, fine] = ANGLES.map(|samples| {
            Problem::new(material, n, distribution_goals, samples).with_room_below(ROOM)
        });
        let search = Search { material, objective, coarse, fine };
        best = match (search.closest(best.as_ref()), best) {
            // An idle component changes nothing, so that the error never rises with the count.
            (Some(found), Some(before)) if before.error <= found.error => {
                Some(Closest { x: search.fine.split(&before.x), ..before })
            }
            (found, _) => found,
        };
    }
    best.map_or_else(SharedMixture::default, |best| best.mixture)
}

/// A mixture and how close it is.
struct Closest {
    /// The largest error of all lobes.
    error: f64,
    mixture: SharedMixture,
    x: DVector<f64>,
}

/// A search for the closest mixture of a number of components.
struct Search<'a> {
    material: &'a Material,
    objective: Objective,
    coarse: Problem,
    fine: Problem,
}

impl Search<'_> {
    /// The closest that the starts lead to, `before` that of one component fewer.
    fn closest(&self, before: Option<&Closest>) -> Option<Closest> {
        let grown = before.map_or_else(Vec::new, |before| self.coarse.grown(&before.x));
        // Each list is sorted by what the weights alone reach; its first is the most promising.
        let starts = [self.coarse.even_starts(STARTS), grown];
        let first = starts.iter().filter_map(|starts| starts.first());
        let ends = first.map(|start| self.descend(start));
        let mut found = ends.min_by(|a, b| a.error.total_cmp(&b.error));
        // A component more can always help: where the nearest starts lead nowhere, others do.
        let mut others = starts.iter().flat_map(|starts| starts.iter().skip(1));
        while let (Some(before), Some(at)) = (before, &found)
            && before.error <= at.error
            && let Some(other) = others.next()
        {
            // What is dropped was no nearer than `before`; the caller compares the last.
            found = Some(self.descend(other));
        }
        found
    }

    /// The mixture that a descent from `start` reaches.
    fn descend(&self, start: &Minimum) -> Closest {
        let x = self.objective.descend(&self.coarse, &self.fine, &start.x);
        let mixture = self.fine.mixture(&x);
        let error = ndf_errors(self.material, &mixture).fold(0.0, f64::max);
        Closest { error, mixture, x }
    }
}

impl Objective {
    /// The solution that a start leads to.
    fn descend(self, coarse: &Problem, fine: &Problem, start: &DVector<f64>) -> DVector<f64> {
        match self {
            Self::LeastSquares => coarse.descend(start, 160, 1e-7),
            Self::Minimax => {
                // A high power sees few of the angles, so it needs a start that is near.
                let x = coarse.descend(start, 80, 1e-5);
                let x = coarse.level(&x, &[4, 8, 16]);
                fine.level(&x, &[16, 64, 256])
            }
        }
    }
}

/// (D, 1) at each angle over D(0) + D, per lobe.
fn distribution_goals(material: &Material, tan2_theta: &[f64]) -> Goals {
    let ndfs = material.lobes().iter().map(|lobe| SgdNdf::new(lobe.alpha(), lobe.p()));
    ndfs.map(|ndf| tan2_theta.iter().map(|x| relative_density(&ndf, *x)).collect()).collect()
}

/// (D, 1)/(D(0) + D).
fn relative_density(ndf: &SgdNdf, tan2_theta: f64) -> (f64, f64) {
    let d = ndf.ndf(tan2_theta);
    // D of a wide lobe (α > ½) can exceed D(0), as it holds 1/cos⁴θ: hence the sum of both.
    (d / (ndf.peak() + d), 1.0 / (ndf.peak() + d))
}

/// [`ndf_error`] of each lobe.
fn ndf_errors(material: &Material, mixture: &SharedMixture) -> impl Iterator<Item = f64> {
    material.lobes().iter().enumerate().map(|(j, lobe)| ndf_error(mixture, j, lobe))
}

/// max |D_fit − D|/(D(0) + D) of one lobe.
#[must_use]
pub fn ndf_error(mixture: &SharedMixture, index: usize, lobe: &LobeParams) -> f64 {
    let exact = SgdNdf::new(lobe.alpha(), lobe.p());
    let mixture = mixture.of_lobe(index);
    let errors = angles(std::slice::from_ref(lobe), JUDGED_SAMPLES).into_iter().map(|x| {
        let d = exact.ndf(x);
        (mixture.ndf(x) - d).abs() / (exact.peak() + d)
    });
    errors.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::catalog;

    #[test]
    fn a_picture_takes_more_components_where_seven_are_too_few() {
        for entry in catalog().iter().step_by(3) {
            let mixture = for_picture(&entry.material);
            let error = picture::error(&entry.material, &mixture);
            assert!(error <= 5e-3, "{}: {} {error}", entry.material.name, mixture.alpha.len());
        }
        let counts = ["gold-paint", "green-plastic", "steel"].map(|name| {
            let entry = crate::material::find(name).expect("in the catalogue");
            for_picture(&entry.material).alpha.len()
        });
        assert_eq!(counts, [7, 8, 9]);
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
