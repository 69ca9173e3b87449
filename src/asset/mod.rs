//! What an engine is handed for a material: its parameters, its best fits, and the lookup textures
//! that it shares with the others. Written as a manifest with files beside it, or as the glTF
//! extension [`EXTENSION`] with textures inside the scene; and read back.

mod extension;
mod manifest;
mod material;

use std::sync::Arc;

use rayon::prelude::*;

use crate::brdf::GltfBrdf;
use crate::encode::{self, Format, TextureEntry, UnsupportedDepth};
use crate::fit;
use crate::lut::{BakeError, Baked, LeftOut, Placed, Quantity, Request, Table, bake_with_progress};
use crate::material::Material;

pub use extension::{EXTENSION, Extension, ExtensionError, Extras};
pub use manifest::{Manifest, ManifestError, ManifestMaterial};
pub use material::{MaterialEntry, Parameters, StatedError};

/// A material as an engine takes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Asset {
    /// Its parameters, its mixture, and its rows in the textures.
    pub material: MaterialEntry,
    /// The best-fit glTF 2.0 material.
    pub gltf: GltfBrdf,
    /// The textures that it uses; none without a visible lobe.
    pub textures: Vec<Texture>,
}

/// A lookup texture as a file. Clones share the bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// How to decode it.
    pub entry: TextureEntry,
    /// The whole file.
    pub bytes: Arc<[u8]>,
}

/// The assets of a set of materials.
#[derive(Clone, Debug, PartialEq)]
pub struct Product {
    /// One asset per material, in the order given.
    pub assets: Vec<Asset>,
    /// Every texture once.
    pub textures: Vec<Texture>,
    /// The lobes that no texture holds.
    pub left_out: Vec<LeftOut>,
}

/// A product that cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BuildError {
    /// The textures cannot be baked as requested.
    #[error(transparent)]
    Bake(#[from] BakeError),
    /// The textures do not fit the file format.
    #[error(transparent)]
    Format(#[from] UnsupportedDepth),
}

/// Fits `materials` and bakes their textures.
///
/// # Errors
///
/// A request that cannot be met, and texels that `format` cannot hold.
pub fn build(
    materials: &[&Material],
    request: &Request,
    format: Format,
) -> Result<Product, BuildError> {
    build_with_progress(materials, request, format, &|| ())
}

/// As [`build`]; `step` is called after each part: those of
/// [`bake_with_progress`], then one per material.
///
/// # Errors
///
/// As [`build`].
pub fn build_with_progress(
    materials: &[&Material],
    request: &Request,
    format: Format,
    step: &(dyn Fn() + Sync),
) -> Result<Product, BuildError> {
    if materials.is_empty() {
        return Ok(Product { assets: Vec::new(), textures: Vec::new(), left_out: Vec::new() });
    }
    let Baked { tables, placed, left_out } = bake_with_progress(materials, request, step)?;
    let textures: Vec<Texture> =
        tables.into_iter().map(|table| Texture::new(&table, format)).collect::<Result<_, _>>()?;
    let assets = materials.par_iter().zip(&placed);
    let assets = assets.map(|(material, placed)| Asset::new(material, placed, &textures));
    Ok(Product { assets: assets.inspect(|_| step()).collect(), textures, left_out })
}

impl Asset {
    fn new(material: &Material, placed: &Placed, textures: &[Texture]) -> Self {
        let mixture = fit::mixture::for_picture(material);
        let used = |texture: &&Texture| texture.holds(placed.row);
        Self {
            material: MaterialEntry::new(placed, mixture),
            gltf: fit::gltf::fit(material).material,
            textures: textures.iter().filter(used).cloned().collect(),
        }
    }
}

impl Texture {
    fn new(table: &Table, format: Format) -> Result<Self, UnsupportedDepth> {
        let bytes = encode::encode(table, format)?.into();
        Ok(Self { entry: TextureEntry::of_file(table, format), bytes })
    }

    /// Whether the row of a material is in the texture.
    fn holds(&self, row: Option<usize>) -> bool {
        match self.entry.quantity {
            Quantity::Brdf3d => row.is_some() && row == self.entry.row,
            _ => row.is_some(),
        }
    }
}

impl Product {
    /// The manifest of the product, for textures that are files beside it.
    #[must_use]
    pub fn manifest(&self) -> Manifest {
        let material =
            |asset: &Asset| ManifestMaterial { entry: asset.material.clone(), gltf: asset.gltf };
        Manifest::new(
            self.assets.iter().map(material).collect(),
            self.textures.iter().map(|texture| texture.entry.clone()).collect(),
            self.left_out.clone(),
        )
    }
}
