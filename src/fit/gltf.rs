//! The best glTF 2.0 material.

use nalgebra::DVector;
use serde::Serialize;

use crate::brdf::gltf::GltfBrdf;
use crate::fit::gltf_problem::Problem;
use crate::fit::gltf_unknowns::{
    BASE, CLEARCOAT, COAT_ROUGHNESS, F0, Family, ROUGHNESS, ROUGHNESS_RANGE, UNKNOWNS,
    gltf_material,
};
use crate::fit::metric::Metric;
use crate::fit::minima::{local_minima, lowest};
use crate::fit::reason::{self, Reason};
use crate::fit::target::{Residuals, Target};
use crate::material::Material;
use crate::math::least_squares::{Minimum, minimise};

/// The best glTF material, with its residuals.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GltfFit {
    /// The material's factors.
    #[serde(flatten)]
    pub material: GltfBrdf,
    /// Its distance from the SGD material.
    pub residuals: Residuals,
    /// Oddities of the material or the fit.
    pub reasons: Vec<Reason>,
}

/// Roughness values looked at before the best are refined.
const SCAN: usize = 8;
/// Relative decrease of Σ r² at which the scan and the refinement end.
const SCAN_TOLERANCE: f64 = 3e-2;
const TOLERANCE: f64 = 1e-5;
/// The same at which a coat has shown whether it pays.
const COAT_TOLERANCE: f64 = 1e-3;

/// An extension is used only where it lowers the residual to this share of what it is without.
const WORTHWHILE: f64 = 0.95;

/// The best glTF material in the default metric.
///
/// # Example
///
/// ```
/// use sgdbake::{fit_gltf, named};
///
/// let fit = fit_gltf(named("alum-bronze")?);
/// assert!((0.0..=1.0).contains(&fit.material.roughness));
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
#[must_use]
pub fn fit(material: &Material) -> GltfFit {
    fit_target(&Target::new(material), Metric::default())
}

/// The best glTF material for a target, in `metric`.
///
/// Three families, each containing materials that the one before cannot reach: core properties
/// alone; a dielectric with `KHR_materials_specular`, whose F0 may be any colour; that with
/// `KHR_materials_clearcoat`. A family is chosen where it lowers the residual by more than 5 %. Its
/// best material is found by a scan over roughness and a descent from every local minimum that
/// shows.
#[must_use]
pub fn fit_target(target: &Target, metric: Metric) -> GltfFit {
    let problem = Problem::new(target, metric);
    // The simplest family that is near enough wins: each extension has to pay for itself in turn.
    let [core, specular] = [Family::Core, Family::Specular].map(|family| best(&problem, family));
    let coated = coated(&problem, &specular);
    let mut chosen = Choice { solution: &core, reasons: reason::of_material(&target.material) };
    chosen.prefer(&specular, |core| Reason::SpecularExtension { core });
    chosen.prefer(&coated, |without| Reason::Clearcoat { without });
    chosen.finish(target)
}

/// The best of a family without a coat.
fn best(problem: &Problem, family: Family) -> Minimum {
    let scan = scan(problem, family);
    let starts = local_minima(&scan.iter().map(|m| m.squares).collect::<Vec<_>>());
    // The scan held the roughness; the descents from its minima move it with the factors.
    let bounds = family.bounds();
    lowest(starts.into_iter().map(|i| {
        minimise(
            |x| problem.equations(x, &problem.lobe(x[ROUGHNESS])),
            &scan[i].x,
            &bounds,
            TOLERANCE,
        )
    }))
}

/// The best factors of a family at roughness values from rough to smooth, each found from the one
/// before.
fn scan(problem: &Problem, family: Family) -> Vec<Minimum> {
    let [low, high] = ROUGHNESS_RANGE;
    let mut scan: Vec<Minimum> = Vec::with_capacity(SCAN);
    for i in 0..SCAN {
        // From rough to smooth: a rough lobe shows at every pair, so that any start will do.
        let roughness = high + (low - high) * i as f64 / (SCAN - 1) as f64;
        let lobe = problem.lobe(roughness);
        // Neighbouring lobes have similar factors: each descent is short.
        let x = scan.last().map_or_else(first_of_scan, |last| last.x.clone());
        let bounds = family.bounds_at(roughness);
        scan.push(minimise(|x| problem.equations(x, &lobe), &x, &bounds, SCAN_TOLERANCE));
    }
    scan
}

/// The factors that a scan starts from.
fn first_of_scan() -> DVector<f64> {
    // Inside all ranges, so that every factor can move in both directions.
    let mut x = DVector::repeat(UNKNOWNS, 0.5);
    x.rows_mut(F0, 3).fill(0.2);
    x.rows_mut(BASE, 3).fill(0.3);
    x[CLEARCOAT] = 0.0;
    (x[ROUGHNESS], x[COAT_ROUGHNESS]) = (ROUGHNESS_RANGE[1], ROUGHNESS_RANGE[1]);
    x
}

/// The best with a clear coat over a dielectric, from coats sharper and softer than its lobe.
fn coated(problem: &Problem, plain: &Minimum) -> Minimum {
    let starts = [0.4, 2.5].map(|factor| {
        let mut x = plain.x.clone();
        (x[CLEARCOAT], x[COAT_ROUGHNESS]) = (0.5, factor * x[ROUGHNESS]);
        x
    });
    let rough = lowest(starts.iter().map(|start| descend_coated(problem, start, COAT_TOLERANCE)));
    // A coat that does not pay need not be followed to the end.
    if worthwhile(&rough, plain) { descend_coated(problem, &rough.x, TOLERANCE) } else { rough }
}

/// The minimum with a coat that a descent from `start` reaches.
fn descend_coated(problem: &Problem, start: &DVector<f64>, tolerance: f64) -> Minimum {
    minimise(|x| problem.coated_equations(x), start, &Family::Coated.bounds(), tolerance)
}

/// Returns whether `other` has a residual so much lower that its extension pays.
fn worthwhile(other: &Minimum, without: &Minimum) -> bool {
    // `WORTHWHILE` is of the residual, the root of the sum of squares.
    other.squares < WORTHWHILE.powi(2) * without.squares
}

/// The best so far, and why.
struct Choice<'a> {
    solution: &'a Minimum,
    reasons: Vec<Reason>,
}

impl<'a> Choice<'a> {
    /// Takes `other` where it is worth its extension; the reason is given the residual without.
    fn prefer(&mut self, other: &'a Minimum, reason: impl Fn(f64) -> Reason) {
        if worthwhile(other, self.solution) {
            self.reasons.push(reason(self.solution.squares.sqrt()));
            self.solution = other;
        }
    }

    /// The fit, with what is odd about it.
    fn finish(mut self, target: &Target) -> GltfFit {
        let material = gltf_material(&self.solution.x);
        if material.metallic > 0.5 {
            self.reasons.push(Reason::Metal);
        }
        self.reasons.extend(at_range_end(&self.solution.x));
        GltfFit { residuals: target.residuals(&material), material, reasons: self.reasons }
    }
}

/// The factors that the range of glTF stops, by name.
fn at_range_end(x: &DVector<f64>) -> Vec<Reason> {
    let [low, high] = ROUGHNESS_RANGE;
    let ends = [
        ("specular colour (F0 = 1)", (F0..F0 + 3).any(|f0| x[f0] >= 1.0)),
        ("base colour (1)", (BASE..BASE + 3).any(|base| x[base] >= 1.0)),
        ("roughness (as a mirror)", x[ROUGHNESS] <= low),
        ("roughness (1)", x[ROUGHNESS] >= high),
    ];
    ends.into_iter()
        .filter(|(_, at_end)| *at_end)
        .map(|(name, _)| Reason::AtRangeEnd(name))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::catalog;

    #[test]
    fn factors_are_in_their_ranges() {
        for entry in catalog().iter().step_by(25) {
            let GltfFit { material, residuals, .. } = fit(&entry.material);
            let unit = material.base_color.into_iter().chain([
                material.metallic,
                material.roughness,
                material.specular_factor,
            ]);
            assert!(unit.into_iter().all(|x| (0.0..=1.0).contains(&x)), "{material:?}");
            assert!(material.specular_color.iter().all(|x| (0.0..=25.0).contains(x)));
            assert!(residuals.cube_root.iter().all(|r| *r < 0.3), "{residuals:?}");
        }
    }
}
