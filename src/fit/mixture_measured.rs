//! The best Beckmann mixture for a measurement.

use std::f64::consts::FRAC_1_PI;
use std::rc::Rc;

use nalgebra::DVector;
use serde::Serialize;

use crate::brdf::gltf::schlick_weight;
use crate::brdf::{Brdf, Lobe};
use crate::fit::descent::{by_steps, further};
use crate::fit::measured_target::{MeasuredPair, MeasuredTarget};
use crate::material::{LobeParams, Material};
use crate::math::least_squares::{Bounds, NormalEquations};
use crate::microfacet::{Beckmann, BeckmannMixture, Distribution as _, Fresnel, SharedMixture};

/// A diffuse colour and one or more lobes, each a mixture of the same Beckmann distributions.
///
/// f = ρd/π + Σ_lobes F D G1 G1/(cosθi cosθo),   D = Σ_k w_k D_k   \[1/sr\]
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredMixture {
    /// Widths and weights.
    #[serde(flatten)]
    pub mixture: SharedMixture,
    /// Diffuse albedo ρd per colour.
    pub diffuse: [f64; 3],
    /// F of each lobe, per colour, with the lobe's scale; a fitted one is ≥ 0.
    pub fresnel: Vec<[Fresnel; 3]>,
}

/// The distance that ln α may go beyond the widths of the start: no pair of the target sees a
/// sharper lobe.
const BEYOND: f64 = 0.7;
/// Relative decrease at which the descent ends.
const TOLERANCE: f64 = 1e-4;
/// ρd of each colour; F's three shares of each colour of a lobe.
const DIFFUSE: usize = 3;
const FRESNEL: usize = 9;

impl MeasuredMixture {
    /// The mixture in place of the distributions of `material`.
    #[must_use]
    pub fn of_material(material: &Material, mixture: SharedMixture) -> Self {
        let fresnel = material.lobes().iter().map(scaled_fresnel).collect();
        Self { mixture, diffuse: material.rho_d(), fresnel }
    }

    /// The reflectance.
    #[must_use]
    pub fn brdf(&self) -> Brdf<BeckmannMixture> {
        let lobes = self.fresnel.iter().enumerate().map(|(j, fresnel)| Lobe {
            distribution: self.mixture.of_lobe(j),
            fitted: None,
            // F holds the lobe's scale.
            rho_s: [std::f64::consts::PI; 3],
            fresnel: *fresnel,
        });
        Brdf { rho_d: self.diffuse, lobes: lobes.collect() }
    }
}

/// The nearest mixture to a measurement that a descent from `start` reaches: widths, weights,
/// diffuse colour and Fresnel terms at once. `start` itself where that is nearer: its Fresnel terms
/// may be below 0, those of a fit are not.
#[must_use]
pub fn fit(target: &MeasuredTarget, start: &MeasuredMixture) -> MeasuredMixture {
    let form = Form { components: start.mixture.alpha.len(), lobes: start.fresnel.len() };
    let bounds = form.bounds(&start.mixture.alpha);
    let given = form.unknowns(start);
    let squares = form.equations(target, &given, &bounds).squares;
    // Compared as given: the bounds may take away what makes the start near.
    let inside = bounds.clamp(&given);
    let best = further(|x| form.equations(target, x, &bounds), &inside, &bounds, TOLERANCE);
    if best.squares < squares { form.mixture(&best.x) } else { start.clone() }
}

/// ρs F/π of each colour.
fn scaled_fresnel(lobe: &LobeParams) -> [Fresnel; 3] {
    std::array::from_fn(|c| {
        let scale = FRAC_1_PI * lobe.rho_s()[c];
        let facing = lobe.f0()[c] - lobe.f1()[c];
        curve([scale * lobe.f0()[c], scale, scale * facing])
    })
}

/// F = f0·(1 − u − cosθd) + f90·u + F(0°)·cosθd, u = (1−cosθd)⁵: three shares ≥ 0 make it ≥ 0.
fn curve([f0, f90, facing]: [f64; 3]) -> Fresnel {
    Fresnel { f0, f90, f1: f0 - facing }
}

/// The numbers of components and lobes. The unknowns are ln α of the components; ρd; then of each
/// lobe the weights and the shares of F.
#[derive(Clone, Copy)]
struct Form {
    components: usize,
    lobes: usize,
}

/// D, Λ(wi) and Λ(wo) of a component at every pair.
type Column = Rc<[[f64; 3]]>;

/// Unknowns, and the components of their widths.
struct Model {
    x: DVector<f64>,
    columns: Vec<Column>,
}

impl Form {
    fn len(self) -> usize {
        self.components + DIFFUSE + self.lobes * self.lobe_len()
    }

    fn lobe_len(self) -> usize {
        self.components + FRESNEL
    }

    /// The place of a lobe's first unknown.
    fn lobe(self, j: usize) -> usize {
        self.components + DIFFUSE + j * self.lobe_len()
    }

    fn bounds(self, alpha: &[f64]) -> Bounds {
        let mut bounds = Bounds::non_negative(self.len());
        // Every component has the same range: they may change places on the way.
        let sharpest = alpha.iter().copied().fold(f64::INFINITY, f64::min).ln() - BEYOND;
        let widest = alpha.iter().copied().fold(0.0, f64::max).ln() + BEYOND;
        for k in 0..self.components {
            [bounds.lower[k], bounds.upper[k]] = [sharpest, widest];
        }
        for c in 0..DIFFUSE {
            // Only ρd has an upper bound: weights and Fresnel shares scale each other freely.
            bounds.upper[self.components + c] = 1.0;
        }
        bounds
    }

    fn unknowns(self, start: &MeasuredMixture) -> DVector<f64> {
        let mut x: Vec<f64> = start.mixture.alpha.iter().map(|alpha| alpha.ln()).collect();
        x.extend(start.diffuse);
        for (j, fresnel) in start.fresnel.iter().enumerate() {
            x.extend(start.mixture.weights.iter().map(|weights| weights[j]));
            x.extend(fresnel.iter().flat_map(|f| [f.f0, f.f90, f.f0 - f.f1]));
        }
        DVector::from_vec(x)
    }

    /// The mixture of the unknowns, widths ascending.
    fn mixture(self, x: &DVector<f64>) -> MeasuredMixture {
        let mut order: Vec<usize> = (0..self.components).collect();
        order.sort_by(|a, b| x[*a].total_cmp(&x[*b]));
        // A solution's weights have any sum; in the mixture they sum to 1, and F takes the factor.
        let sums: Vec<f64> = (0..self.lobes).map(|j| self.weight_sum(x, j)).collect();
        let weights = order.iter().map(|k| {
            let lobes = sums.iter().enumerate();
            lobes.map(|(j, sum)| x[self.lobe(j) + k] / sum).collect()
        });
        let fresnel = sums
            .iter()
            .enumerate()
            .map(|(j, sum)| self.shares(x, j).map(|shares| curve(shares.map(|share| share * sum))));
        MeasuredMixture {
            mixture: SharedMixture {
                alpha: order.iter().map(|k| x[*k].exp()).collect(),
                weights: weights.collect(),
            },
            diffuse: std::array::from_fn(|c| x[self.components + c]),
            fresnel: fresnel.collect(),
        }
    }

    /// Σ_k w_k of a lobe. One whose weights all vanished keeps a distribution, and nothing of it
    /// shows.
    fn weight_sum(self, x: &DVector<f64>, j: usize) -> f64 {
        x.rows(self.lobe(j), self.components).sum().max(f64::MIN_POSITIVE)
    }

    /// The shares of F of each colour of a lobe.
    fn shares(self, x: &DVector<f64>, j: usize) -> [[f64; 3]; 3] {
        let first = self.lobe(j) + self.components;
        std::array::from_fn(|c| std::array::from_fn(|share| x[first + 3 * c + share]))
    }

    fn equations(
        self,
        target: &MeasuredTarget,
        x: &DVector<f64>,
        bounds: &Bounds,
    ) -> NormalEquations {
        let here = self.model(target, x, None);
        by_steps(
            target,
            x,
            bounds,
            |moved| self.model(target, moved, Some(&here)),
            |model, i| self.eval(model, &target.pairs[i], i),
        )
    }

    /// The model of the unknowns; a component is evaluated where its width is not that of `known`.
    fn model(self, target: &MeasuredTarget, x: &DVector<f64>, known: Option<&Model>) -> Model {
        // Most steps of the derivatives move a weight or a colour, and no width.
        let columns = (0..self.components).map(|k| match known {
            Some(known) if known.x[k] == x[k] => known.columns[k].clone(),
            _ => column(target, x[k].exp()),
        });
        Model { x: x.clone(), columns: columns.collect() }
    }

    /// f of the model at the pair of index `i`.
    fn eval(self, model: &Model, pair: &MeasuredPair, i: usize) -> [f64; 3] {
        let u = schlick_weight(pair.cos_theta_d);
        let basis = [1.0 - u - pair.cos_theta_d, u, pair.cos_theta_d];
        let mut f = std::array::from_fn(|c| FRAC_1_PI * model.x[self.components + c]);
        for j in 0..self.lobes {
            let [mut d, mut sum] = [0.0; 2];
            let mut lambda = [0.0; 2];
            for (k, column) in model.columns.iter().enumerate() {
                let weight = model.x[self.lobe(j) + k];
                let [d_k, i_k, o_k] = column[i];
                (d, sum) = (d + weight * d_k, sum + weight);
                lambda = [lambda[0] + weight * i_k, lambda[1] + weight * o_k];
            }
            // D G1 G1/(cosθi cosθo), the weights scaled to a sum of 1 but for D's.
            let [v_i, v_o] = [0, 1].map(|side| sum / ((sum + lambda[side]) * pair.cos_theta[side]));
            // Without any weight v is 0/0.
            let lobe = if sum > 0.0 { d * v_i * v_o } else { 0.0 };
            let shares = self.shares(&model.x, j);
            for c in 0..3 {
                let fresnel: f64 = shares[c].iter().zip(basis).map(|(share, b)| share * b).sum();
                f[c] += fresnel * lobe;
            }
        }
        f
    }
}

/// D, Λ(wi) and Λ(wo) of a Beckmann distribution at every pair.
fn column(target: &MeasuredTarget, alpha: f64) -> Column {
    let beckmann = Beckmann { alpha };
    let pairs = target.pairs.iter();
    pairs
        .map(|pair| {
            // Λ and not G1: it is Λ that is linear in the weights.
            let [lambda_i, lambda_o] = pair.cot_theta.map(|cot| beckmann.lambda(cot));
            [beckmann.ndf(pair.tan2_theta_h), lambda_i, lambda_o]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{MaskingKind, SgdBrdf};
    use crate::fit::mixture::for_picture;
    use crate::material::find;

    #[test]
    fn a_descent_gets_nearer_and_the_reflectance_is_what_it_evaluated() {
        let material = &find("gold-paint").expect("in the catalogue").material;
        let brdf = SgdBrdf::new(material, MaskingKind::Exact);
        let target = MeasuredTarget::of(&brdf).expect("measured everywhere").thinned(4);
        let mut mixture = for_picture(material);
        mixture.alpha.iter_mut().for_each(|alpha| *alpha *= 1.3);
        let start = MeasuredMixture::of_material(material, mixture);
        let found = fit(&target, &start);
        let [before, after] = [&start, &found].map(|mixture| {
            let brdf = mixture.brdf();
            target.picture_difference(|i| brdf.eval(target.pairs[i].wi, target.pairs[i].wo))
        });
        assert!(after < 0.1 * before, "{after} {before}");
        assert!(found.mixture.alpha.is_sorted());

        let form = Form { components: start.mixture.alpha.len(), lobes: start.fresnel.len() };
        let model = form.model(&target, &form.unknowns(&start), None);
        let brdf = start.brdf();
        for (i, pair) in target.pairs.iter().enumerate().step_by(7) {
            let (f, exact) = (form.eval(&model, pair, i), brdf.eval(pair.wi, pair.wo));
            for c in 0..3 {
                assert!(
                    (f[c] - exact[c]).abs() <= 1e-9 * exact[c].abs() + 1e-12,
                    "{f:?} {exact:?}"
                );
            }
        }
    }

    /// A fit's Fresnel terms are ≥ 0, so it cannot follow one that is not.
    #[test]
    fn a_start_that_is_nearer_is_kept() {
        let material = &find("gold-paint").expect("in the catalogue").material;
        let mut start = MeasuredMixture::of_material(material, for_picture(material));
        for fresnel in start.fresnel.iter_mut().flatten() {
            *fresnel = curve([0.02, 0.2, -0.02]);
        }
        start.diffuse = [0.5; 3];
        let target = MeasuredTarget::of(&start.brdf()).expect("measured everywhere").thinned(8);
        assert_eq!(fit(&target, &start), start);
    }
}
