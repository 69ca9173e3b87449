//! The product for an engine: a material's parameters, its best fits, and the lookup textures
//! that it shares with the others. Written as a manifest with its files, or as the glTF
//! extension [`EXTENSION`] with textures inside the scene; and read back.

mod direct;
mod extension;
mod fingerprint;
mod manifest;
mod material;
mod measured;

use std::sync::Arc;

use rayon::prelude::*;

use crate::brdf::GltfBrdf;
use crate::encode::{self, Format, TextureEntry, UnsupportedDepth};
use crate::fit;
use crate::lut::{BakeError, Baked, LeftOut, Placed, Quantity, Request, Table, bake_with_progress};
use crate::material::{Material, MaterialError};

pub use direct::{
    DirectFits, Distances, GltfAt, OneLobeAt, Sources, direct_fits, direct_fits_of, stated_error,
};
pub use extension::{EXTENSION, Extension, ExtensionError, Extras, ExtrasError};
pub use fingerprint::fingerprint;
pub use manifest::{Manifest, ManifestError, ManifestMaterial};
pub use material::{MaterialEntry, Parameters, StatedError};
pub use measured::Measured;

/// A material as an engine takes it.
///
/// # Example
///
/// ```
/// use sgdbake::{Depths, Extent, Format, MaskingKind, Quantity, Request, build, named};
///
/// let request = Request {
///     quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
///     masking: MaskingKind::Exact,
///     extent: Extent::Size(32),
///     depths: Depths::Smallest,
/// };
/// let product = build(&[named("gold-paint")?], &request, Format::Exr)?;
/// let asset = &product.assets[0];
/// assert_eq!(asset.material.parameters.name, "gold-paint");
/// assert_eq!(asset.textures.len(), 3);
/// println!("roughness of the glTF material: {:.3}", asset.gltf.roughness);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
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
///
/// # Example
///
/// ```no_run
/// use sgdbake::{Depths, Extent, Format, MaskingKind, Quantity, Request, build, named};
///
/// let request = Request {
///     quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
///     masking: MaskingKind::Exact,
///     extent: Extent::Size(32),
///     depths: Depths::Smallest,
/// };
/// let product = build(&[named("gold-paint")?], &request, Format::Exr)?;
/// std::fs::write("manifest.json", product.manifest().to_text())?;
/// for texture in &product.textures {
///     std::fs::write(format!("{}.exr", texture.entry.quantity.name()), &texture.bytes)?;
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
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
    /// Parameters that make no material.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// The textures do not fit the file format.
    #[error(transparent)]
    Format(#[from] UnsupportedDepth),
}

/// A material to build.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// The material.
    pub material: &'a Material,
    /// Its origin and errors if it was fitted to a measurement: then the glTF material is the one
    /// that was fitted to the measurement too, which is nearer to the surface.
    pub measured: Option<&'a Measured>,
}

impl<'a> From<&'a Material> for Subject<'a> {
    fn from(material: &'a Material) -> Self {
        Self { material, measured: None }
    }
}

/// Fits `materials` and bakes their textures.
///
/// # Errors
///
/// A request that cannot be met, and texels that `format` cannot hold.
///
/// # Example
///
/// ```
/// use sgdbake::{Depths, Extent, Format, MaskingKind, Quantity, Request, build, named};
///
/// let request = Request {
///     quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
///     masking: MaskingKind::Exact,
///     extent: Extent::Size(32),
///     depths: Depths::Smallest,
/// };
/// let product = build(&[named("gold-paint")?], &request, Format::Exr)?;
/// assert_eq!(product.textures.len(), 3);
/// assert!(product.textures[0].bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]), "an EXR file");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn build(
    materials: &[&Material],
    request: &Request,
    format: Format,
) -> Result<Product, BuildError> {
    let subjects: Vec<Subject<'_>> = materials.iter().map(|material| (*material).into()).collect();
    build_with_progress(&subjects, request, format, &|| ())
}

/// As [`build`]; `step` is called after each part: those of
/// [`bake_with_progress`], then one per material.
///
/// # Errors
///
/// As [`build`].
pub fn build_with_progress(
    subjects: &[Subject<'_>],
    request: &Request,
    format: Format,
    step: &(dyn Fn() + Sync),
) -> Result<Product, BuildError> {
    if subjects.is_empty() {
        return Ok(Product { assets: Vec::new(), textures: Vec::new(), left_out: Vec::new() });
    }
    let materials: Vec<&Material> = subjects.iter().map(|subject| subject.material).collect();
    let Baked { tables, placed, left_out } = bake_with_progress(&materials, request, step)?;
    let textures: Vec<Texture> =
        tables.into_iter().map(|table| Texture::new(&table, format)).collect::<Result<_, _>>()?;
    // Indexed, so the order is that of `subjects` on any number of threads.
    let assets = subjects.par_iter().zip(&placed);
    let assets = assets.map(|(subject, placed)| Asset::new(*subject, placed, &textures));
    Ok(Product { assets: assets.inspect(|_| step()).collect(), textures, left_out })
}

/// Builds again the assets that extras describe, one per element in order. Only their glTF
/// material may be another than the exported one, where that was fitted to a measurement.
///
/// # Errors
///
/// As [`build`].
pub fn rebuild(
    extras: &[Extras],
    request: &Request,
    format: Format,
) -> Result<Vec<Asset>, BuildError> {
    // A scene may show one material in many slots; each is built once.
    let mut different: Vec<&Extras> = Vec::new();
    for extras in extras {
        if !different.contains(&extras) {
            different.push(extras);
        }
    }
    let materials: Vec<Material> =
        different.iter().map(|extras| extras.parameters.material()).collect::<Result<_, _>>()?;
    let product = build(&materials.iter().collect::<Vec<_>>(), request, format)?;
    let mut assets = product.assets;
    for (asset, extras) in assets.iter_mut().zip(&different) {
        // Extras of earlier versions do not state it.
        asset.material.error = extras.error.clone().or(asset.material.error.take());
    }
    let of_each = extras.iter().filter_map(|extras| {
        let built = different.iter().zip(&assets).find(|(built, _)| **built == extras);
        built.map(|(_, asset)| asset.clone())
    });
    Ok(of_each.collect())
}

impl Asset {
    fn new(subject: Subject<'_>, placed: &Placed, textures: &[Texture]) -> Self {
        let Subject { material, measured } = subject;
        let error = measured.map(Measured::stated_error).or_else(|| stated_error(material));
        let mixture = fit::mixture::for_picture(material);
        let used = textures.iter().filter(|texture| texture.holds(placed.row));
        Self {
            material: MaterialEntry::new(placed, mixture, error),
            gltf: measured.map_or_else(|| best_gltf(material), |measured| measured.gltf),
            textures: used.cloned().collect(),
        }
    }
}

/// The glTF material nearest to the surface: fitted to the measurement where the material is a
/// refit of one, else to the material.
#[must_use]
pub fn best_gltf(material: &Material) -> GltfBrdf {
    let direct = direct_fits_of(material).map(|fits| fits.gltf.measured.material);
    direct.unwrap_or_else(|| fit::gltf::fit(material).material)
}

impl Texture {
    fn new(table: &Table, format: Format) -> Result<Self, UnsupportedDepth> {
        let bytes = encode::encode(table, format)?.into();
        Ok(Self { entry: TextureEntry::of_file(table, format), bytes })
    }

    /// Returns whether the row of a material is in the texture.
    fn holds(&self, row: Option<usize>) -> bool {
        match self.entry.quantity {
            // The 3D table holds one material, the others a row for each.
            Quantity::Brdf3d => row.is_some() && row == self.entry.row,
            _ => row.is_some(),
        }
    }
}

impl Product {
    /// The manifest of the product, for textures that are files in its folder.
    #[must_use]
    pub fn manifest(&self) -> Manifest {
        let materials = self
            .assets
            .iter()
            .map(|asset| ManifestMaterial { entry: asset.material.clone(), gltf: asset.gltf });
        Manifest::new(
            materials.collect(),
            self.textures.iter().map(|texture| texture.entry.clone()).collect(),
            self.left_out.clone(),
        )
    }
}
