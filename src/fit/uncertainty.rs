//! The accuracy to which a measurement determines the parameters of a fit.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::fit::sgd_model::{SgdLobe, SgdModel};
use crate::fit::unknowns::Layout;
use crate::math::least_squares::Bounds;

/// Standard errors of an SGD fit's parameters.
///
/// # Formula
///
/// H⁻¹ (Σ ψψᵀ) H⁻¹ · N/(N − n), H the objective's curvature and ψ the gradient of a single pair's
/// share (Huber 1967, White 1980): it takes what is left at the N pairs for their noise, each by
/// itself. Where the model cannot follow the surface, neighbouring pairs err alike, and the true
/// uncertainty is larger.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Uncertainty {
    /// The error of ρd.
    pub rho_d: [f64; 3],
    /// The errors of each lobe's parameters.
    pub lobes: Vec<SgdLobe>,
}

/// The covariance of the unknowns; 0 of those that their bounds hold at a number.
#[must_use]
pub(crate) fn covariance(
    hessian: &DMatrix<f64>,
    scatter: &DMatrix<f64>,
    bounds: &Bounds,
    pairs: usize,
) -> DMatrix<f64> {
    let n = hessian.nrows();
    // An unknown that no pair depends on would make the matrix singular.
    let is_seen = |i: &usize| hessian[(*i, *i)] > 0.0 && bounds.lower[*i] < bounds.upper[*i];
    let seen: Vec<usize> = (0..n).filter(is_seen).collect();
    // Unit diagonal, so that the ridge is relative to each unknown.
    let scale: Vec<f64> = seen.iter().map(|i| hessian[(*i, *i)].sqrt().recip()).collect();
    let [mut reduced, scatter] = [hessian, scatter].map(|matrix| {
        DMatrix::from_fn(seen.len(), seen.len(), |i, j| {
            matrix[(seen[i], seen[j])] * scale[i] * scale[j]
        })
    });
    (0..seen.len()).for_each(|i| reduced[(i, i)] += 1e-12);
    let mut covariance = DMatrix::zeros(n, n);
    // Not positive definite: nothing bounds the errors of the free coefficients.
    let Some(inverse) = reduced.cholesky().map(|factor| factor.inverse()) else {
        covariance.fill_diagonal(f64::INFINITY);
        return covariance;
    };
    let sandwich = &inverse * scatter * &inverse;
    // Residuals at a minimum are smaller than the noise, as the unknowns have adapted to it.
    let freedom = pairs as f64 / pairs.saturating_sub(seen.len()).max(1) as f64;
    for (i, a) in seen.iter().enumerate() {
        for (j, b) in seen.iter().enumerate() {
            covariance[(*a, *b)] = freedom * sandwich[(i, j)] * scale[i] * scale[j];
        }
    }
    covariance
}

/// The standard errors of a model from the covariance of its unknowns with free energy.
#[must_use]
pub(crate) fn of(model: &SgdModel, layout: &Layout, covariance: &DMatrix<f64>) -> Uncertainty {
    let errors = Errors { layout, covariance };
    Uncertainty {
        rho_d: std::array::from_fn(|c| errors.of(&[(c, 1.0)])),
        lobes: model.lobes.iter().enumerate().map(|(j, lobe)| errors.of_lobe(j, lobe)).collect(),
    }
}

/// The covariance C of unknowns.
struct Errors<'a> {
    layout: &'a Layout,
    covariance: &'a DMatrix<f64>,
}

impl Errors<'_> {
    /// √(gᵀ C g) of a number, g its derivative by each of these unknowns.
    fn of(&self, slopes: &[(usize, f64)]) -> f64 {
        let mut gradient = DVector::zeros(self.layout.unknowns());
        slopes.iter().for_each(|(i, slope)| gradient[*i] = *slope);
        // Rounding can take a variance of nearly 0 below it.
        gradient.dot(&(self.covariance * &gradient)).max(0.0).sqrt()
    }

    /// The errors of a lobe's parameters: the unknowns are ln α, ln p, ρs F0, ρs and ρs (F0 − F1).
    fn of_lobe(&self, j: usize, lobe: &SgdLobe) -> SgdLobe {
        let shape = self.layout.shape(j);
        let [mut rho_s, mut f0, mut f1] = [[0.0; 3]; 3];
        for c in (0..3).filter(|c| lobe.rho_s[*c] > 0.0) {
            let (scale, facing, bend) = (lobe.rho_s[c], lobe.f0[c], lobe.f1[c]);
            // With a = ρs F0, s = ρs and b = ρs (F0 − F1): F0 = a/s and F1 = (a − b)/s.
            rho_s[c] = self.of_colour(j, c, [0.0, 1.0, 0.0]);
            f0[c] = self.of_colour(j, c, [1.0 / scale, -facing / scale, 0.0]);
            f1[c] = self.of_colour(j, c, [1.0 / scale, -bend / scale, -1.0 / scale]);
        }
        SgdLobe {
            // dα/d ln α = α.
            alpha: self.of(&[(shape, lobe.alpha)]),
            p: self.of(&[(shape + 1, lobe.p)]),
            rho_s,
            f0,
            f1,
        }
    }

    /// The error of a number with these derivatives by a colour's three products.
    fn of_colour(&self, j: usize, c: usize, by: [f64; 3]) -> f64 {
        let at = self.layout.colour(j, c);
        self.of(&[(at, by[0]), (at + 1, by[1]), (at + 2, by[2])])
    }
}
