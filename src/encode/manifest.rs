//! `manifest.json`, and the texture entries that the glTF extension shares with it.

use std::str::FromStr;

use serde::Serialize;

use crate::brdf::GltfBrdf;
use crate::brdf::lobes::Lobes;
use crate::encode::GENERATOR;
use crate::lut::{Axis, Depth, Encoding, ErrorNote, LeftOut, Placed, Quantity, Table};
use crate::material::ChannelParams;

/// The manifest's schema.
pub const SCHEMA: &str = "sgdbake/manifest/1";

/// Everything that a program needs to decode a bake.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Manifest {
    /// Always [`SCHEMA`].
    pub schema: &'static str,
    /// Always [`GENERATOR`].
    pub generator: &'static str,
    /// The materials in the order given.
    pub materials: Vec<MaterialEntry>,
    /// The textures.
    pub textures: Vec<TextureEntry>,
    /// The lobes that no texture holds.
    pub left_out: Vec<LeftOut>,
}

/// One material: its parameters, its row, and its best fits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialEntry {
    /// Its name.
    pub name: String,
    /// Its row in every texture that has rows; `None` without a visible lobe.
    pub row: Option<usize>,
    /// Its parameters.
    pub channels: ChannelEntries,
    /// D(0) per channel \[1/sr\].
    pub ndf_peak: [f64; 3],
    /// The best-fit glTF material.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gltf: Option<GltfBrdf>,
    /// The best-fit Beckmann mixture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lobes: Option<Lobes>,
}

/// The parameters of three channels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ChannelEntries {
    /// Red.
    pub r: ChannelParams,
    /// Green.
    pub g: ChannelParams,
    /// Blue.
    pub b: ChannelParams,
}

/// A texture and how to decode it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TextureEntry {
    /// What it stores.
    pub quantity: Quantity,
    /// Where its bytes are.
    #[serde(flatten)]
    pub location: Location,
    /// The file format.
    pub format: Format,
    /// The texels' number format.
    pub depth: Depth,
    /// The texels that the codes 0 and 65535 of a 16-bit integer texture stand for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<[f32; 2]>,
    /// Texels along each axis.
    pub size: Vec<usize>,
    /// The axes, the fastest first.
    pub axes: Vec<Axis>,
    /// How a texel becomes a value.
    pub encoding: Encoding,
    /// Always `linear`.
    pub filter: &'static str,
    /// The first material of each row.
    pub rows: Vec<String>,
    /// The row that a texture without a row axis holds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row: Option<usize>,
    /// Promised and measured error.
    pub error: ErrorNote,
}

/// Where a texture's bytes are.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum Location {
    /// A file beside the manifest.
    File {
        /// Its name.
        file: String,
    },
    /// A file beside the glTF.
    Uri {
        /// Its relative URI.
        uri: String,
    },
    /// A buffer view of the glTF.
    BufferView {
        /// Its index.
        #[serde(rename = "bufferView")]
        buffer_view: usize,
        /// What it holds.
        #[serde(rename = "mimeType")]
        mime_type: &'static str,
    },
}

/// A texture file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// OpenEXR.
    Exr,
    /// KTX 2.
    Ktx2,
    /// 16-bit PNG.
    Png,
}

/// No format of that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is not a texture format; accepted are exr, ktx2, png")]
pub struct UnknownFormat(String);

impl FromStr for Format {
    type Err = UnknownFormat;

    fn from_str(name: &str) -> Result<Self, UnknownFormat> {
        [Self::Exr, Self::Ktx2, Self::Png]
            .into_iter()
            .find(|format| format.extension() == name)
            .ok_or_else(|| UnknownFormat(name.to_owned()))
    }
}

impl Format {
    /// The format of a file, by its first bytes.
    #[must_use]
    pub fn of(start: &[u8]) -> Option<Self> {
        [Self::Exr, Self::Ktx2, Self::Png]
            .into_iter()
            .find(|format| start.starts_with(format.signature()))
    }

    /// The bytes that every file of the format starts with.
    #[must_use]
    pub const fn signature(self) -> &'static [u8] {
        match self {
            Self::Exr => b"\x76\x2f\x31\x01",
            Self::Ktx2 => &ktx2::MAGIC,
            Self::Png => b"\x89PNG\r\n\x1a\n",
        }
    }

    /// The name, which is also the file extension.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Ktx2 => "ktx2",
            Self::Png => "png",
        }
    }
}

impl Manifest {
    /// The manifest of these entries.
    #[must_use]
    pub fn new(
        materials: Vec<MaterialEntry>,
        textures: Vec<TextureEntry>,
        left_out: Vec<LeftOut>,
    ) -> Self {
        Self { schema: SCHEMA, generator: GENERATOR, materials, textures, left_out }
    }
}

impl MaterialEntry {
    /// The entry of a baked material, without fits.
    #[must_use]
    pub fn new(placed: &Placed) -> Self {
        let [r, g, b] = placed.channels;
        Self {
            name: placed.name.clone(),
            row: placed.row,
            channels: ChannelEntries { r, g, b },
            ndf_peak: placed.ndf_peak,
            gltf: None,
            lobes: None,
        }
    }
}

impl TextureEntry {
    /// The entry of a table whose bytes are at `location`.
    #[must_use]
    pub fn new(table: &Table, format: Format, location: Location) -> Self {
        Self {
            quantity: table.quantity,
            location,
            format,
            depth: table.texels.depth(),
            range: table.texels.range(),
            size: table.size.clone(),
            axes: table.axes.clone(),
            encoding: table.encoding,
            filter: "linear",
            rows: table.rows.clone(),
            row: table.row,
            error: table.error,
        }
    }

    /// The entry as JSON.
    ///
    /// # Panics
    ///
    /// Never: numbers and strings have a JSON form.
    #[must_use]
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("numbers and strings have a JSON form")
    }
}
