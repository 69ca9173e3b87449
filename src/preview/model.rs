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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Model {
    /// The measured material
    #[default]
    Sgd,
    /// The best single Beckmann lobe
    Beckmann,
    /// The best single GGX lobe
    Ggx,
    /// Five Beckmann lobes with widths shared by the channels
    Lobes,
    /// The best glTF material
    Gltf,
    /// Lookup textures of 256 texels in half floats
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
