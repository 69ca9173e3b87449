//! A material in files: the part that manifest and glTF extension share.

use serde::{Deserialize, Serialize};

use crate::lut::Placed;
use crate::material::{LobeParams, Material, MaterialError};
use crate::microfacet::SharedMixture;

/// The parameters of a material.
///
/// # Formula
///
/// f = diffuse/π + Σ_lobes (rho_s/π) F D G/(cosθi cosθo), all of it per colour, linear RGB.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// The material's name.
    pub name: String,
    /// Diffuse albedo ρd.
    pub diffuse: [f64; 3],
    /// None to three lobes.
    pub lobes: Vec<LobeParams>,
}

/// A material with the numbers that a renderer needs in addition to its parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaterialEntry {
    /// Its parameters.
    #[serde(flatten)]
    pub parameters: Parameters,
    /// D(0) of each lobe \[1/sr\].
    pub ndf_peak: Vec<f64>,
    /// The distribution of each lobe as a Beckmann mixture.
    pub mixture: SharedMixture,
    /// Its row in the `ndf` and `masking` textures, a third of its first row in `albedo`; `None`
    /// without a visible lobe.
    pub row: Option<usize>,
    /// The row of each lobe in the `fresnel` texture; empty without a visible lobe.
    pub fresnel_rows: Vec<usize>,
    /// How far the parameters are from the measurement.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<StatedError>,
}

/// The distance of a material from the measurement that it describes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StatedError {
    /// Mean ΔE2000 of a ball under suns that the fit did not see.
    pub delta_e: f64,
    /// The measurement.
    pub source: String,
}

impl Parameters {
    /// The parameters of a material whose lobes all have a masking fit.
    #[must_use]
    pub fn of(material: &Material) -> Self {
        Self {
            name: material.name.clone(),
            diffuse: material.rho_d(),
            lobes: material.lobes().to_vec(),
        }
    }

    /// The material of these parameters.
    ///
    /// # Errors
    ///
    /// A diffuse colour out of range, or more lobes than a material can have.
    pub fn material(&self) -> Result<Material, MaterialError> {
        Material::new(self.name.clone(), self.diffuse, self.lobes.clone())
    }
}

impl MaterialEntry {
    /// The entry of a baked material, its mixture, and its distance from the surface where one is
    /// known.
    #[must_use]
    pub fn new(placed: &Placed, mixture: SharedMixture, error: Option<StatedError>) -> Self {
        Self {
            parameters: Parameters::of(&placed.material),
            ndf_peak: placed.ndf_peak.clone(),
            mixture,
            row: placed.row,
            fresnel_rows: placed.fresnel_rows.clone(),
            error,
        }
    }
}
