//! How well a measurement determines the parameters of a fit.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::fit::sgd::Layout;
use crate::fit::sgd_model::{SgdLobe, SgdModel};

/// Standard errors of an SGD fit's parameters.
///
/// # Formula
///
/// H⁻¹ (Σ ψψᵀ) H⁻¹ · N/(N − n), H the objective's Gauss–Newton matrix and ψ the gradient of a single
/// pair's share (Huber 1967, White 1980): it takes what is left at the N pairs for their noise, each
/// by itself. Where the model cannot follow the surface, neighbouring pairs err alike, and the true
/// uncertainty is larger.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Uncertainty {
    /// Of ρd.
    pub rho_d: [f64; 3],
    /// Of each lobe's parameters.
    pub lobes: Vec<SgdLobe>,
}

/// The covariance of the unknowns.
#[must_use]
pub fn covariance(hessian: DMatrix<f64>, scatter: &DMatrix<f64>, pairs: usize) -> DMatrix<f64> {
    let n = hessian.nrows();
    let seen: Vec<usize> = (0..n).filter(|i| hessian[(*i, *i)] > 0.0).collect();
    // Unit diagonal, so that the ridge is relative to each unknown.
    let scale: Vec<f64> = seen.iter().map(|i| hessian[(*i, *i)].sqrt().recip()).collect();
    let scaled = |matrix: &DMatrix<f64>| {
        DMatrix::from_fn(seen.len(), seen.len(), |i, j| {
            matrix[(seen[i], seen[j])] * scale[i] * scale[j]
        })
    };
    let mut reduced = scaled(&hessian);
    (0..seen.len()).for_each(|i| reduced[(i, i)] += 1e-12);
    let mut covariance = DMatrix::zeros(n, n);
    let Some(inverse) = reduced.cholesky().map(|factor| factor.inverse()) else {
        covariance.fill_diagonal(f64::INFINITY);
        return covariance;
    };
    let sandwich = &inverse * scaled(scatter) * &inverse;
    let freedom = pairs as f64 / pairs.saturating_sub(n).max(1) as f64;
    for (i, a) in seen.iter().enumerate() {
        for (j, b) in seen.iter().enumerate() {
            covariance[(*a, *b)] = freedom * sandwich[(i, j)] * scale[i] * scale[j];
        }
    }
    covariance
}

/// The standard errors of a model whose unknowns, those of a fit with free energy, have a covariance.
#[must_use]
pub fn of(model: &SgdModel, layout: &Layout, covariance: &DMatrix<f64>) -> Uncertainty {
    let error = |slopes: &[(usize, f64)]| {
        let mut gradient = DVector::zeros(layout.unknowns());
        slopes.iter().for_each(|(i, slope)| gradient[*i] = *slope);
        gradient.dot(&(covariance * &gradient)).max(0.0).sqrt()
    };
    let lobe = |(j, lobe): (usize, &SgdLobe)| {
        let [alpha, p] = [layout.shape(j), layout.shape(j) + 1];
        let of = |slopes: &dyn Fn(f64, f64, f64) -> [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|c| {
                let (at, rho_s) = (layout.colour(j, c), lobe.rho_s[c]);
                if rho_s <= 0.0 {
                    return 0.0;
                }
                let by = slopes(rho_s, lobe.f0[c], lobe.f1[c]);
                error(&[(at, by[0]), (at + 1, by[1]), (at + 2, by[2])])
            })
        };
        SgdLobe {
            alpha: error(&[(alpha, lobe.alpha)]),
            p: error(&[(p, lobe.p)]),
            rho_s: of(&|_, _, _| [0.0, 1.0, 0.0]),
            f0: of(&|rho_s, f0, _| [1.0 / rho_s, -f0 / rho_s, 0.0]),
            f1: of(&|rho_s, _, f1| [1.0 / rho_s, -f1 / rho_s, -1.0 / rho_s]),
        }
    };
    Uncertainty {
        rho_d: std::array::from_fn(|c| error(&[(c, 1.0)])),
        lobes: model.lobes.iter().enumerate().map(lobe).collect(),
    }
}
