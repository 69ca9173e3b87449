//! The glTF material extension, and the copy of the parameters that survives tools which drop
//! extensions they do not know.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::asset::material::{MaterialEntry, Parameters};
use crate::encode::TextureEntry;

/// The name of the glTF material extension.
pub const EXTENSION: &str = "SGD_materials_shifted_gamma";

/// The version of the extension's body and of `extras.sgd`.
const VERSION: u32 = 2;

/// The body of the extension.
///
/// # Example
///
/// ```
/// use sgdbake::Extension;
/// use sgdbake::{Depths, Extent, Format, MaskingKind, Quantity, Request, build, named};
///
/// let request = Request {
///     quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
///     masking: MaskingKind::Exact,
///     extent: Extent::Size(32),
///     depths: Depths::Smallest,
/// };
/// let product = build(&[named("gold-paint")?], &request, Format::Exr)?;
/// let body = serde_json::to_value(Extension::new(&product.assets[0].material, Vec::new()))?;
/// assert_eq!(Extension::read(&body)?.material, product.assets[0].material);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Extension {
    version: Version,
    /// The material.
    #[serde(flatten)]
    pub material: MaterialEntry,
    /// Its textures.
    pub textures: Vec<TextureEntry>,
    /// A hash of the whole document as it was exported, on one of its materials.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub document: Option<String>,
}

/// The content of `extras.sgd` of a glTF material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Extras {
    version: Version,
    /// The parameters.
    #[serde(flatten)]
    pub parameters: Parameters,
}

/// An extension that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{EXTENSION}: {0}")]
pub struct ExtensionError(#[from] serde_json::Error);

/// The one version that is read and written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
struct Version;

impl From<Version> for u32 {
    fn from(_: Version) -> Self {
        VERSION
    }
}

impl TryFrom<u32> for Version {
    type Error = String;

    fn try_from(version: u32) -> Result<Self, String> {
        if version == VERSION { Ok(Self) } else { Err(unknown(version)) }
    }
}

fn unknown(version: u32) -> String {
    format!("version {version} is not supported; this sgdbake reads version {VERSION}")
}

impl Extension {
    /// The extension of a material with these textures.
    #[must_use]
    pub fn new(material: &MaterialEntry, textures: Vec<TextureEntry>) -> Self {
        Self { version: Version, material: material.clone(), textures, document: None }
    }

    /// Reads a body.
    ///
    /// # Errors
    ///
    /// Another version, and members that are missing or of another type.
    pub fn read(body: &Value) -> Result<Self, ExtensionError> {
        // The version first: a body of another one lacks members, which is not what to tell.
        if let Some(version) = body.get("version") {
            Version::deserialize(version)?;
        }
        Ok(Self::deserialize(body)?)
    }
}

impl Extras {
    /// The extras of a material.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        Self { version: Version, parameters: parameters.clone() }
    }
}
