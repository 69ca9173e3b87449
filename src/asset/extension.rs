//! The glTF material extension, and the copy of the parameters that survives tools which drop
//! extensions they do not know.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::asset::material::{MaterialEntry, Parameters, StatedError};
use crate::encode::TextureEntry;
use crate::material::{LobeFields, LobeParams};

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

/// The content of `extras.sgd` of a glTF material: all of the extension that cannot be computed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Extras {
    version: Version,
    /// The parameters.
    #[serde(flatten)]
    pub parameters: Parameters,
    /// How far they are from the measurement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<StatedError>,
}

/// `extras.sgd` that does not describe a material.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key}: {reason}")]
pub struct ExtrasError {
    /// The member, from `extras` on.
    pub key: String,
    /// What was found, and what is accepted.
    pub reason: String,
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
    pub fn new(material: &MaterialEntry) -> Self {
        Self {
            version: Version,
            parameters: material.parameters.clone(),
            error: material.error.clone(),
        }
    }

    /// Reads the content of `extras.sgd`. Members that it does not know are passed over.
    ///
    /// # Errors
    ///
    /// The first member that is missing, of another type or out of range.
    pub fn read(body: &Value) -> Result<Self, ExtrasError> {
        let at = "extras.sgd";
        if !body.is_object() {
            return Err(ExtrasError::new(at, format!("expected an object, found {}", show(body))));
        }
        // A tool may have written 2 as 2.0.
        let version: f64 = member(body, at, "version")?;
        if version != f64::from(VERSION) {
            let reason =
                format!("{version} is not supported; this sgdbake reads version {VERSION}");
            return Err(ExtrasError::new(&format!("{at}.version"), reason));
        }
        let lobes: Vec<Value> = member(body, at, "lobes")?;
        let lobes = lobes.iter().enumerate();
        let parameters = Parameters {
            name: member(body, at, "name")?,
            diffuse: member(body, at, "diffuse")?,
            lobes: lobes
                .map(|(i, lobe)| read_lobe(lobe, &format!("{at}.lobes[{i}]")))
                .collect::<Result<_, _>>()?,
        };
        // Checked here, where the error can still name the place in the file.
        parameters.material().map_err(|error| ExtrasError::new(at, error))?;
        let error = body.get("error").map(|_| member(body, at, "error")).transpose()?;
        Ok(Self { version: Version, parameters, error })
    }
}

fn read_lobe(lobe: &Value, at: &str) -> Result<LobeParams, ExtrasError> {
    // `null` is what a lobe without a masking fit is written as.
    let masking = lobe.get("masking").filter(|masking| !masking.is_null());
    let fields = LobeFields {
        alpha: member(lobe, at, "alpha")?,
        p: member(lobe, at, "p")?,
        masking: masking.map(|_| member(lobe, at, "masking")).transpose()?,
        rho_s: member(lobe, at, "rho_s")?,
        f0: member(lobe, at, "f0")?,
        f1: member(lobe, at, "f1")?,
    };
    LobeParams::new(fields).map_err(|error| ExtrasError::new(at, error))
}

/// A member of the object at the path `at`.
fn member<T: DeserializeOwned>(object: &Value, at: &str, key: &str) -> Result<T, ExtrasError> {
    let at = format!("{at}.{key}");
    let value = object.get(key).ok_or_else(|| ExtrasError::new(&at, "is missing"))?;
    T::deserialize(value).map_err(|error| ExtrasError::new(&at, error))
}

/// A value as it stands in a message, cut to a line.
fn show(value: &Value) -> String {
    value.to_string().chars().take(60).collect()
}

impl ExtrasError {
    fn new(key: &str, reason: impl ToString) -> Self {
        Self { key: key.to_owned(), reason: reason.to_string() }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::*;
    use serde_json::json;

    fn body() -> Value {
        json!({"version": 2, "name": "paint", "diffuse": [0.1, 0.2, 0.3], "unknown": null,
            "lobes": [{"alpha": 0.1, "p": 1, "rho_s": [0.5, 0, 0], "f0": [0, 0, 0], "f1": [0, 0, 0],
                       "masking": {"lambda": 2, "c": 1e-7, "k": 24}}]})
    }

    #[test]
    fn extras_come_back_as_they_were_written() {
        let mut extras = Extras::read(&body()).unwrap();
        extras.error = Some(StatedError { delta_e: 1.5, source: "a file".into() });
        let written = serde_json::to_value(&extras).unwrap();
        assert_eq!(Extras::read(&written), Ok(extras));
    }

    #[test]
    fn a_tool_may_write_the_version_as_a_float() {
        let mut body = body();
        body["version"] = json!(2.0);
        assert!(Extras::read(&body).is_ok());
    }

    #[test]
    fn what_is_broken_is_named() {
        let cases = [
            ("/version", json!(1), "extras.sgd.version: 1 is not supported"),
            ("/name", json!(5), "extras.sgd.name: invalid type: number"),
            ("/diffuse", json!([0.1, 0.2]), "extras.sgd.diffuse: invalid length 2"),
            ("/diffuse/0", json!(-1), "extras.sgd: rho_d = -1 is out of range"),
            ("/lobes/0", json!("x"), "extras.sgd.lobes[0].alpha: is missing"),
            ("/lobes/0/f0/1", Value::Null, "extras.sgd.lobes[0].f0: invalid type: null"),
            ("/lobes/0/alpha", json!(0), "extras.sgd.lobes[0]: alpha = 0 is out of range"),
            ("/lobes/0/masking/k", json!("24"), "extras.sgd.lobes[0].masking: invalid type"),
            ("", json!([1]), "extras.sgd: expected an object, found [1]"),
        ];
        for (pointer, value, expected) in cases {
            let mut body = body();
            *body.pointer_mut(pointer).unwrap() = value;
            let error = Extras::read(&body).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }
}
