//! How to decode a texture: the entry in the manifest, in the glTF extension and in the texture
//! file itself.

use serde::{Deserialize, Serialize};

use crate::encode::format::Format;
use crate::lut::{Axis, Depth, Encoding, ErrorNote, Quantity, Table};

/// A texture and how to decode it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureEntry {
    /// The quantity.
    pub quantity: Quantity,
    /// Where its bytes are.
    #[serde(flatten)]
    pub location: Location,
    /// The file format.
    pub format: Format,
    /// The texels' number format.
    pub depth: Depth,
    /// The texels that the codes 0 and 65535 of a 16-bit integer texture stand for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[f32; 2]>,
    /// Texels along each axis.
    pub size: Vec<usize>,
    /// The axes, the fastest first.
    pub axes: Vec<Axis>,
    /// How a texel becomes a value.
    pub encoding: Encoding,
    /// How texels are mixed.
    pub filter: Interpolation,
    /// The first material of each row.
    pub rows: Vec<String>,
    /// The row that a texture without a row axis holds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub row: Option<usize>,
    /// Promised and measured error.
    pub error: ErrorNote,
}

/// Where a texture's bytes are.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Location {
    /// A file in the manifest's folder.
    File {
        /// Its name.
        file: String,
    },
    /// A file in the glTF's folder.
    Uri {
        /// Its relative URI.
        uri: String,
    },
    /// A buffer view of the glTF.
    BufferView {
        /// Its index.
        #[serde(rename = "bufferView")]
        buffer_view: usize,
        /// The media type of its bytes.
        #[serde(rename = "mimeType")]
        mime_type: String,
    },
}

/// How the texels around a coordinate become one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Interpolation {
    /// Linearly along every axis but the rows.
    #[default]
    Linear,
}

impl TextureEntry {
    /// The entry of a table in a file of its own, named after its quantity: `ndf.exr`, or
    /// `brdf3d-2.exr` for the 3D table of row 2.
    #[must_use]
    pub fn of_file(table: &Table, format: Format) -> Self {
        Self {
            quantity: table.quantity,
            location: Location::File { file: file_name(table.quantity, table.row, format) },
            format,
            depth: table.texels.depth(),
            range: table.texels.range(),
            size: table.size.clone(),
            axes: table.axes.clone(),
            encoding: table.encoding,
            filter: Interpolation::Linear,
            rows: table.rows.clone(),
            row: table.row,
            error: table.error,
        }
    }

    /// The name of the texture's file, wherever its bytes are now.
    #[must_use]
    pub fn file_name(&self) -> String {
        file_name(self.quantity, self.row, self.format)
    }

    /// The same texture with its bytes in another place.
    #[must_use]
    pub fn at(&self, location: Location) -> Self {
        Self { location, ..self.clone() }
    }

    /// The number of bytes of all texels, three numbers each.
    #[must_use]
    pub fn texel_bytes(&self) -> usize {
        self.size.iter().fold(3 * self.depth.bytes(), |bytes, n| bytes.saturating_mul(*n))
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

    /// Reads an entry from JSON.
    ///
    /// # Errors
    ///
    /// Text that is not JSON, and members that are missing or of another type.
    pub fn from_json(text: &str) -> serde_json::Result<Self> {
        // By way of a value: tagged enums take numbers of arbitrary precision from nothing else.
        serde_json::from_value(serde_json::from_str(text)?)
    }
}

fn file_name(quantity: Quantity, row: Option<usize>, format: Format) -> String {
    let row = row.map_or_else(String::new, |row| format!("-{row}"));
    format!("{}{row}.{}", quantity.name(), format.extension())
}
