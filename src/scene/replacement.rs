//! What takes the place of an assigned material: numbers and JSON, no physics.

use std::sync::Arc;

use serde_json::{Map, Value};

/// A glTF metallic-roughness material with the SGD parameters and textures beside it.
#[derive(Debug, Clone)]
pub struct Replacement {
    /// SGD material name; the glTF material's name where the slot has none.
    pub name: String,
    /// Linear RGB in [0, 1].
    pub base_color: [f64; 3],
    /// In [0, 1].
    pub metallic: f64,
    /// Perceptual roughness in [0, 1]; α = roughness².
    pub roughness: f64,
    /// KHR_materials_specular.
    pub specular: Option<Specular>,
    /// KHR_materials_clearcoat.
    pub clearcoat: Option<Clearcoat>,
    /// Body of `SGD_materials_shifted_gamma` without `textures`.
    pub extension: Map<String, Value>,
    /// Stands at `extras.sgd`, for tools that drop unknown extensions.
    pub extras: Value,
    /// The lookup textures, for `textures` of the extension.
    pub textures: Vec<Attachment>,
}

/// KHR_materials_specular.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Specular {
    /// `specularFactor`, in [0, 1].
    pub factor: f64,
    /// `specularColorFactor`, linear RGB, ≥ 0.
    pub color: [f64; 3],
}

impl Specular {
    /// What glTF takes where the extension is absent.
    pub const DEFAULT: Self = Self { factor: 1.0, color: [1.0; 3] };
}

/// KHR_materials_clearcoat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clearcoat {
    /// `clearcoatFactor`, in [0, 1].
    pub factor: f64,
    /// `clearcoatRoughnessFactor`, in [0, 1].
    pub roughness: f64,
}

/// A texture that the extension refers to: a buffer view in a .glb, a file beside a .gltf.
/// Attachments that share their bytes (the same `Arc`) are stored once.
#[derive(Debug, Clone)]
pub struct Attachment {
    /// The manifest's entry without `file`.
    pub entry: Map<String, Value>,
    /// File name beside a .gltf.
    pub file_name: String,
    /// Media type, `image/x-exr`.
    pub mime: &'static str,
    /// The encoded file.
    pub bytes: Arc<[u8]>,
}
