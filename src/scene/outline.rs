//! The parts of a glTF document that this crate reads; everything else is only passed on.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer};
use serde_json::Value;
use serde_json::value::RawValue;

use crate::scene::SceneError;

/// A document's arrays, with the few members that are looked at.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Outline {
    pub buffers: Vec<Buffer>,
    pub buffer_views: Vec<BufferView>,
    pub accessors: Vec<Accessor>,
    pub images: Vec<Image>,
    pub textures: Vec<Texture>,
    pub samplers: Vec<Opaque>,
    pub materials: Vec<Material>,
    pub meshes: Vec<Mesh>,
    pub nodes: Vec<Node>,
    pub scenes: Vec<Scene>,
    pub scene: Option<Index>,
    pub skins: Vec<Skin>,
    pub cameras: Vec<Opaque>,
    pub animations: Vec<Animation>,
    pub extensions_used: Vec<String>,
    pub extensions_required: Vec<String>,
}

/// The versions of glTF that a document names.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct AssetInfo {
    version: Option<String>,
    min_version: Option<String>,
}

impl AssetInfo {
    /// Refuses versions other than 2, and documents that need a later one than 2.0.
    fn check(&self) -> Result<(), SceneError> {
        let version = self.version.as_deref().unwrap_or("2.0");
        if version != "2" && !version.starts_with("2.") {
            let found = format!("the scene is glTF {}", version.escape_debug());
            return Err(SceneError::Version { found });
        }
        match self.min_version.as_deref() {
            None | Some("2.0") => Ok(()),
            Some(least) => {
                let least = least.escape_debug();
                let found = format!("the scene needs glTF {least} or later (asset.minVersion)");
                Err(SceneError::Version { found })
            }
        }
    }
}

/// A whole number ≥ 0, however it is spelled: `3`, `3.0`, `3e0`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(super) struct Index(pub u64);

impl<'de> Deserialize<'de> for Index {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let number = serde_json::Number::deserialize(deserializer)?;
        number
            .as_u64()
            .or_else(|| number.as_f64().and_then(whole))
            .map(Index)
            .ok_or_else(|| serde::de::Error::custom(format!("{number} is not an index or count")))
    }
}

/// The whole number that a float stands for; beyond 2⁵³ not every one has a float of its own.
fn whole(value: f64) -> Option<u64> {
    (value >= 0.0 && value.fract() == 0.0 && value < 2f64.powi(53)).then_some(value as u64)
}

/// An object of which only the existence matters.
#[derive(Debug, Deserialize)]
pub(super) struct Opaque {}

#[derive(Debug, Deserialize)]
pub(super) struct Material {
    pub name: Option<String>,
    #[serde(default)]
    pub extensions: MaterialExtensions,
    /// As text: another tool's may nest deeper than values are read.
    pub extras: Option<Box<RawValue>>,
}

/// The member of extras that holds the parameters.
#[derive(Debug, Deserialize)]
struct MaterialExtras {
    sgd: Option<Box<RawValue>>,
}

impl Material {
    /// `extras.sgd`; null where it nests deeper than values are read.
    pub fn sgd_extras(&self) -> Option<Value> {
        let extras: MaterialExtras = serde_json::from_str(self.extras.as_deref()?.get()).ok()?;
        Some(serde_json::from_str(extras.sgd?.get()).unwrap_or_default())
    }
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct MaterialExtensions {
    // `asset::EXTENSION`; the attribute takes a literal only.
    #[serde(rename = "SGD_materials_shifted_gamma")]
    pub sgd: Option<Value>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub uri: Option<String>,
    pub byte_length: Index,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub buffer: Index,
    #[serde(default)]
    pub byte_offset: Index,
    pub byte_length: Index,
    pub byte_stride: Option<Index>,
    #[serde(default)]
    pub extensions: BufferViewExtensions,
}

/// Extensions that say where a view's compressed bytes are.
pub(super) const COMPRESSION: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

#[derive(Debug, Default, Deserialize)]
pub(super) struct BufferViewExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    ext: Option<Compressed>,
    #[serde(rename = "KHR_meshopt_compression")]
    khr: Option<Compressed>,
}

impl BufferViewExtensions {
    pub fn compressed(&self) -> Option<&Compressed> {
        self.ext.as_ref().or(self.khr.as_ref())
    }
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Compressed {
    pub buffer: Index,
    #[serde(default)]
    pub byte_offset: Index,
    pub byte_length: Index,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<Index>,
    #[serde(default)]
    pub byte_offset: Index,
    pub component_type: Index,
    pub count: Index,
    #[serde(rename = "type")]
    pub kind: String,
    pub sparse: Option<Sparse>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Sparse {
    pub count: Index,
    pub indices: SparseView,
    pub values: SparseView,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseView {
    pub buffer_view: Index,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Image {
    pub uri: Option<String>,
    pub buffer_view: Option<Index>,
    pub mime_type: Option<String>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Texture {
    pub sampler: Option<Index>,
    pub source: Option<Index>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Mesh {
    pub name: Option<String>,
    pub primitives: Vec<Primitive>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    #[serde(default)]
    pub attributes: BTreeMap<String, Index>,
    pub indices: Option<Index>,
    pub material: Option<Index>,
    pub mode: Option<Index>,
    #[serde(default)]
    pub targets: Vec<BTreeMap<String, Index>>,
    #[serde(default)]
    pub extensions: PrimitiveExtensions,
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct PrimitiveExtensions {
    #[serde(rename = "KHR_materials_variants")]
    pub variants: Option<Variants>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Variants {
    #[serde(default)]
    pub mappings: Vec<Mapping>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Mapping {
    pub material: Index,
}

#[derive(Debug, Deserialize)]
pub(super) struct Node {
    #[serde(default)]
    pub children: Vec<Index>,
    pub mesh: Option<Index>,
    pub skin: Option<Index>,
    pub camera: Option<Index>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    pub nodes: Vec<Index>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    #[serde(default)]
    pub joints: Vec<Index>,
    pub inverse_bind_matrices: Option<Index>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Animation {
    #[serde(default)]
    pub samplers: Vec<AnimationSampler>,
}

#[derive(Debug, Deserialize)]
pub(super) struct AnimationSampler {
    pub input: Index,
    pub output: Index,
}

/// The part of a document that every version has.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Versioned {
    asset: AssetInfo,
}

/// The failure of a whole document.
fn refused(reason: &str) -> SceneError {
    SceneError::Invalid("the document".into(), reason.into())
}

impl Outline {
    /// Reads the arrays of a document.
    ///
    /// # Errors
    /// Text that is not JSON, and members of the wrong type.
    pub fn read(text: &str) -> Result<Self, SceneError> {
        if text.starts_with('\u{feff}') {
            return Err(refused("starts with a byte order mark; save it as UTF-8 without one"));
        }
        if !text.trim_start().starts_with('{') {
            return Err(refused("is not a JSON object"));
        }
        // The version first: the arrays of glTF 2.0 are objects in 1.0, which fails less clearly.
        let version: Versioned = serde_json::from_str(text)?;
        version.asset.check()?;
        Ok(serde_json::from_str(text)?)
    }

    /// Triangles that a primitive draws; points and lines draw none.
    pub fn triangles(&self, primitive: &Primitive) -> u64 {
        let accessor = primitive.indices.or_else(|| primitive.attributes.get("POSITION").copied());
        let count = accessor
            .and_then(|Index(index)| self.accessors.get(usize::try_from(index).ok()?))
            .map_or(0, |accessor| accessor.count.0);
        // Modes of glTF: 4 for triangles, the default, 5 for strips, 6 for fans.
        match primitive.mode.map_or(4, |mode| mode.0) {
            4 => count / 3,
            5 | 6 => count.saturating_sub(2),
            _ => 0,
        }
    }
}
