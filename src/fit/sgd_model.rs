//! A diffuse colour and SGD lobes that colour all three channels.

use serde::Serialize;

use crate::material::{LobeFields, LobeParams, Material, MaterialError};
use crate::microfacet::{FittedMasking, Fresnel};

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
    /// The lobes, sharpest first; those of the paper's form in the order of the channels.
    pub lobes: Vec<SgdLobe>,
}

impl SgdLobe {
    /// F of each colour.
    #[must_use]
    pub fn fresnel(&self) -> [Fresnel; 3] {
        std::array::from_fn(|c| Fresnel::sgd(self.f0[c], self.f1[c]))
    }

    /// The lobe of a material, with the fit to its exact masking.
    fn params(&self) -> Result<LobeParams, MaterialError> {
        let Self { alpha, p, rho_s, f0, f1 } = *self;
        // The fit takes the exact masking; λ, c and k follow from α and p and are not unknowns.
        let params = LobeParams::new(LobeFields { alpha, p, masking: None, rho_s, f0, f1 })?;
        Ok(params.with_masking(FittedMasking::of(&params).params()))
    }
}

impl SgdModel {
    /// The material of these parameters, each lobe with the fit to its exact masking.
    ///
    /// # Errors
    ///
    /// A parameter out of range, or more lobes than a material can have.
    pub fn material(&self, name: &str) -> Result<Material, MaterialError> {
        let lobes = self.lobes.iter().map(SgdLobe::params).collect::<Result<_, _>>()?;
        Material::new(name, self.rho_d, lobes)
    }
}
