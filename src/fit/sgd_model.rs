//! A diffuse colour and SGD lobes that colour all three channels.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use serde::Serialize;

use crate::brdf::Reflectance;
use crate::brdf::eval::{above_horizon, cos_theta_d};
use crate::math::direction::{cos_theta, cot_theta, half_sum, tan2_theta};
use crate::microfacet::{BeckmannMixture, Fresnel, SgdNdf, SmithMasking};

/// One SGD lobe.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SgdLobe {
    /// Width α of the distribution.
    pub alpha: f64,
    /// Exponent p of its power law.
    pub p: f64,
    /// Specular scale ρs of each colour.
    pub rho_s: [f64; 3],
    /// Fresnel parameter F0 of each colour.
    pub f0: [f64; 3],
    /// Fresnel parameter F1 of each colour.
    pub f1: [f64; 3],
}

/// The parameters of f = ρd/π + Σ ρs/π · F D G1 G1/(cosθi cosθo) over the lobes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SgdModel {
    /// Diffuse albedo ρd of each colour.
    pub rho_d: [f64; 3],
    /// The lobes, sharpest first.
    pub lobes: Vec<SgdLobe>,
}

impl SgdLobe {
    /// F of each colour.
    #[must_use]
    pub fn fresnel(&self) -> [Fresnel; 3] {
        std::array::from_fn(|c| Fresnel { f0: self.f0[c], f1: self.f1[c] })
    }
}

/// The reflectance of an [`SgdModel`], with exact masking.
#[derive(Clone, Debug)]
pub struct SgdModelBrdf {
    rho_d: [f64; 3],
    lobes: Vec<Lobe>,
}

#[derive(Clone, Debug)]
struct Lobe {
    ndf: SgdNdf,
    masking: SmithMasking,
    rho_s: [f64; 3],
    fresnel: [Fresnel; 3],
}

/// Relative accuracy of the masking.
const ACCURACY: f64 = 1e-9;

impl SgdModelBrdf {
    /// The evaluator of a model.
    #[must_use]
    pub fn new(model: &SgdModel) -> Self {
        let lobe = |lobe: &SgdLobe| Lobe {
            ndf: SgdNdf::new(lobe.alpha, lobe.p),
            masking: SmithMasking::new(&BeckmannMixture::new(lobe.alpha, lobe.p, ACCURACY))
                .tabulated(),
            rho_s: lobe.rho_s,
            fresnel: lobe.fresnel(),
        };
        Self { rho_d: model.rho_d, lobes: model.lobes.iter().map(lobe).collect() }
    }
}

impl Reflectance for SgdModelBrdf {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !(above_horizon(wi) && above_horizon(wo)) {
            return [0.0; 3];
        }
        let h = half_sum(wi, wo);
        let (tan2_theta_h, cos_theta_d) = (tan2_theta(h), cos_theta_d(h));
        let mut f = self.rho_d.map(|rho_d| rho_d * FRAC_1_PI);
        for lobe in &self.lobes {
            let v = [wi, wo].map(|w| lobe.masking.g1(cot_theta(w)) / cos_theta(w));
            let shape = FRAC_1_PI * lobe.ndf.eval(tan2_theta_h) * (v[0] * v[1]);
            let colours = lobe.rho_s.iter().zip(&lobe.fresnel);
            for (f, (rho_s, fresnel)) in f.iter_mut().zip(colours) {
                *f += rho_s * fresnel.eval(cos_theta_d) * shape;
            }
        }
        f
    }
}
