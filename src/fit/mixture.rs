//! The best mixture of a few Beckmann distributions, their widths shared by the lobes of a material.

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

/// Angles of the first and of the last steps of the fit to the distributions.
const ANGLES: [usize; 2] = [48, 120];

/// Starts of evenly spaced widths, of which all but the first are tried where that leads nowhere.
const STARTS: usize = 6;

/// How far below the range of the starts ln α may go: the best of many components have one that is
/// three times narrower than the bend of the distribution.
const ROOM: f64 = 1.5;

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
    Problem::new(material, count.clamp(1, MAX_COMPONENTS), picture::goals, SAMPLES).solve()
}

/// The mixture of `count` Beckmann distributions that is closest to a material's lobes.
///
/// The largest |D_fit − D|/(D(0) + D) of all angles and lobes is made least: no lobe is given up for
/// being dark, no angle for being small. Least squares come first, then Σ |e|^p of a p that grows
/// to 256. Each component more makes that error smaller, or leaves it where no start
/// leads to a smaller one.
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
        let [coarse, fine] = ANGLES.map(|samples| {
            Problem::new(material, n, distribution_goals, samples).with_room_below(ROOM)
        });
        let descended = |start: Minimum| {
            let x = objective.descend(&coarse, &fine, &start.x);
            let mixture = fine.mixture(&x);
            (largest_error(&mixture), mixture, x)
        };
        let grown = best.as_ref().map_or_else(Vec::new, |(_, _, x)| coarse.grown(x));
        let starts = [coarse.even_starts(STARTS), grown];
        let first = starts.iter().filter_map(|starts| starts.first().cloned());
        let mut found = first.map(descended).min_by(|a, b| a.0.total_cmp(&b.0));
        // A component more can always help: where the nearest starts lead nowhere, others do.
        let mut others = starts.iter().flat_map(|starts| starts.iter().skip(1).cloned());
        while let (Some(before), Some(at)) = (&best, &found)
            && before.0 <= at.0
            && let Some(other) = others.next()
        {
            found = Some(descended(other));
        }
        best = match (best, found) {
            (Some(before), Some(found)) if before.0 <= found.0 => {
                let (error, mixture, x) = before;
                Some((error, mixture, fine.split(&x)))
            }
            (_, found) => found,
        };
    }
    best.map_or_else(SharedMixture::default, |(_, mixture, _)| mixture)
}

impl Objective {
    /// The solution that a start leads to.
    fn descend(self, coarse: &Problem, fine: &Problem, start: &DVector<f64>) -> DVector<f64> {
        match self {
            Self::LeastSquares => coarse.descend(start, 160, 1e-7),
            Self::Minimax => {
                let x = coarse.descend(start, 80, 1e-5);
                let x = coarse.level(&x, &[4, 8, 16]);
                fine.level(&x, &[16, 64, 256])
            }
        }
    }
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
