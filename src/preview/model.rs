//! The models that a material can be shown in.

use crate::brdf::Reflectance;
use crate::brdf::batch::SgdBatch;
use crate::brdf::{Brdf, MaskingKind};
use crate::fit::{gltf, mixture, one_lobe};
use crate::lut::decode::{Lookup, LutBrdf};
use crate::lut::{BakeError, Depth, Depths, Extent, Quantity, Request, bake};
use crate::material::Material;
use crate::microfacet::Family;

/// A reflectance that stands for a material: its own, or the best fit of another model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Model {
    /// The measured material
    #[default]
    Sgd,
    /// The best single Beckmann lobe
    Beckmann,
    /// The best single GGX lobe
    Ggx,
    /// Five Beckmann distributions with widths shared by the lobes
    Mixture,
    /// The best glTF material
    Gltf,
    /// Lookup textures of 256 texels in half floats
    Lut,
}

/// Components of [`Model::Mixture`].
pub const SHOWN_COMPONENTS: usize = 5;

/// Texels along each axis of [`Model::Lut`].
pub const SHOWN_TEXELS: usize = 256;

impl Model {
    /// The reflectance of `material` in this model.
    ///
    /// # Errors
    ///
    /// The textures cannot be baked.
    pub fn reflectance(self, material: &Material) -> Result<Box<dyn Reflectance>, BakeError> {
        Ok(match self {
            Self::Sgd => Box::new(SgdBatch::new(material, MaskingKind::Exact)),
            Self::Beckmann => {
                Box::new(one_lobe::fit(material, Family::Beckmann).per_channel.brdf())
            }
            Self::Ggx => Box::new(one_lobe::fit(material, Family::Ggx).per_channel.brdf()),
            Self::Mixture => {
                let mixture = mixture::best_picture(material, SHOWN_COMPONENTS);
                Box::new(Brdf::of_mixture(material, &mixture))
            }
            Self::Gltf => Box::new(gltf::fit(material).material),
            Self::Lut => Box::new(through_textures(material)?),
        })
    }
}

/// The material through textures of [`SHOWN_TEXELS`] half floats.
fn through_textures(material: &Material) -> Result<LutBrdf, BakeError> {
    let request = Request {
        quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
        masking: MaskingKind::Exact,
        extent: Extent::Size(SHOWN_TEXELS),
        depths: Depths::Only(Depth::Half),
    };
    let baked = bake(&[material], &request)?;
    LutBrdf::new(&baked, 0, Lookup::Filtered).ok_or(BakeError::NoMaterial)
}
