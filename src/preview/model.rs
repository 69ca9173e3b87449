//! The models that a material can be shown in.

use crate::brdf::Reflectance;
use crate::brdf::batch::SgdBatch;
use crate::brdf::lobes::LobesBrdf;
use crate::brdf::one_lobe::Distribution;
use crate::fit::{gltf, lobes, one_lobe};
use crate::lut::BakeError;
use crate::lut::decode::{Lookup, LutBrdf};
use crate::lut::table::Depth;
use crate::material::Material;
use crate::microfacet::masking::MaskingKind;

/// A reflectance that stands for a material: its own, or the best fit of another model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Model {
    /// The measured SGD reflectance with exact masking.
    Sgd,
    /// The best single Beckmann lobe per channel.
    Beckmann,
    /// The best single GGX lobe per channel.
    Ggx,
    /// SGD with its distribution as [`SHOWN_LOBES`] Beckmann lobes.
    Lobes,
    /// The best glTF 2.0 material.
    Gltf,
    /// Half-float lookup textures of [`SHOWN_TEXELS`] texels.
    Lut,
}

/// Lobes of [`Model::Lobes`].
pub const SHOWN_LOBES: usize = 5;

/// Texels along each axis of [`Model::Lut`].
pub const SHOWN_TEXELS: usize = 256;

impl Model {
    /// The reflectance of `material` in this model.
    ///
    /// # Errors
    ///
    /// The textures cannot be baked.
    pub fn reflectance(self, material: &Material) -> Result<Box<dyn Reflectance>, BakeError> {
        let one_lobe = |distribution| Box::new(one_lobe::fit(material, distribution).per_channel);
        Ok(match self {
            Self::Sgd => Box::new(SgdBatch::new(material, MaskingKind::Exact)),
            Self::Beckmann => one_lobe(Distribution::Beckmann),
            Self::Ggx => one_lobe(Distribution::Ggx),
            Self::Lobes => Box::new(LobesBrdf::new(material, &lobes::lobes(material, SHOWN_LOBES))),
            Self::Gltf => Box::new(gltf::fit(material).material),
            Self::Lut => {
                Box::new(LutBrdf::bake(material, SHOWN_TEXELS, Depth::Half, Lookup::Filtered)?)
            }
        })
    }
}
