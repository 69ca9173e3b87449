//! `manifest.json`: everything that a program needs to decode a bake.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::asset::material::MaterialEntry;
use crate::brdf::GltfBrdf;
use crate::encode::{GENERATOR, TextureEntry};
use crate::lut::LeftOut;

/// The schema that is read and written.
const SCHEMA: &str = "sgdbake/manifest/2";

/// The manifest of a bake.
///
/// # Example
///
/// ```
/// use sgdbake::Manifest;
/// use sgdbake::{Depths, Extent, Format, MaskingKind, Quantity, Request, build, named};
///
/// let request = Request {
///     quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
///     masking: MaskingKind::Exact,
///     extent: Extent::Size(32),
///     depths: Depths::Smallest,
/// };
/// let product = build(&[named("gold-paint")?], &request, Format::Exr)?;
/// let text = product.manifest().to_text();
/// assert_eq!(Manifest::read(&text)?, product.manifest());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    schema: Schema,
    /// The program that wrote it, and its version.
    pub generator: String,
    /// The materials in the order given.
    pub materials: Vec<ManifestMaterial>,
    /// The textures.
    pub textures: Vec<TextureEntry>,
    /// The lobes that no texture holds.
    pub left_out: Vec<LeftOut>,
}

/// A material in a manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ManifestMaterial {
    /// Its parameters and rows.
    #[serde(flatten)]
    pub entry: MaterialEntry,
    /// The best-fit glTF 2.0 material.
    pub gltf: GltfBrdf,
}

/// A manifest that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("not a valid manifest: {0}")]
pub struct ManifestError(#[from] serde_json::Error);

/// The one schema that is read and written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
struct Schema;

impl From<Schema> for String {
    fn from(_: Schema) -> Self {
        SCHEMA.to_owned()
    }
}

impl TryFrom<String> for Schema {
    type Error = String;

    fn try_from(schema: String) -> Result<Self, String> {
        if schema == SCHEMA { Ok(Self) } else { Err(unknown(&schema)) }
    }
}

fn unknown(schema: &str) -> String {
    format!("schema {schema:?} is not supported; this sgdbake reads {SCHEMA:?}")
}

impl Manifest {
    /// The manifest of these entries.
    #[must_use]
    pub fn new(
        materials: Vec<ManifestMaterial>,
        textures: Vec<TextureEntry>,
        left_out: Vec<LeftOut>,
    ) -> Self {
        Self { schema: Schema, generator: GENERATOR.to_owned(), materials, textures, left_out }
    }

    /// Reads a manifest.
    ///
    /// # Errors
    ///
    /// Text that is not JSON, another schema, and members that are missing or of another type.
    pub fn read(text: &str) -> Result<Self, ManifestError> {
        // By way of a value: tagged enums take numbers of arbitrary precision from nothing else.
        let value: Value = serde_json::from_str(text)?;
        // The schema first: a manifest of another one lacks members, which is not what to tell.
        if let Some(schema) = value.get("schema") {
            Schema::deserialize(schema)?;
        }
        Ok(Self::deserialize(value)?)
    }

    /// The manifest as the text of its file.
    ///
    /// # Panics
    ///
    /// Never: numbers and strings have a JSON form.
    #[must_use]
    pub fn to_text(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers and strings have a JSON form") + "\n"
    }
}
