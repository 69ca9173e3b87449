//! A table as a file in any of the formats, and the entry read back from the file alone.

use crate::encode::entry::TextureEntry;
use crate::encode::format::Format;
use crate::encode::{KEY, exr, ktx2, png};
use crate::lut::{Depth, Table};

/// A table whose texels a format cannot hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a {format} file cannot hold {} texels; use exr or ktx2 for half and float, png for 16-bit integers", .depth.name())]
pub struct UnsupportedDepth {
    /// The format asked for.
    pub format: Format,
    /// The texels' number format.
    pub depth: Depth,
}

/// A texture file whose entry cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum EntryError {
    /// The first bytes belong to no texture format.
    #[error("not a texture: the first bytes are those of neither EXR nor KTX 2 nor PNG")]
    UnknownFormat,
    /// The file is damaged or cut short.
    #[error("not a valid {format}: {reason}")]
    Damaged {
        /// The format that its first bytes say.
        format: Format,
        /// The problem.
        reason: String,
    },
    /// An image without an entry.
    #[error("this {0} has no '{KEY}' entry, so sgdbake did not bake it")]
    Missing(Format),
    /// An entry that does not describe a texture.
    #[error("the '{KEY}' entry of this {format} is not valid: {reason}")]
    Invalid {
        /// The format of the file.
        format: Format,
        /// The problem with the entry.
        reason: String,
    },
}

/// Encodes a table, with its entry in the file's metadata.
///
/// # Errors
///
/// Texels that the format cannot hold: integers in EXR and KTX 2, floats in PNG.
///
/// # Example
///
/// ```
/// use sgdbake::encode::read_entry;
/// use sgdbake::{Format, encode};
/// use sgdbake::{Depths, Extent, MaskingKind, Quantity, Request, bake, named};
///
/// let request = Request {
///     quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
///     masking: MaskingKind::Exact,
///     extent: Extent::Size(32),
///     depths: Depths::Smallest,
/// };
/// let baked = bake(&[named("gold-paint")?], &request)?;
/// let exr = encode(&baked.tables[0], Format::Exr)?;
/// assert_eq!(read_entry(&exr)?.quantity, Quantity::Ndf);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn encode(table: &Table, format: Format) -> Result<Vec<u8>, UnsupportedDepth> {
    let bytes = match format {
        Format::Exr => exr::encode(table),
        Format::Ktx2 => ktx2::encode(table),
        Format::Png => png::encode(table),
    };
    bytes.ok_or(UnsupportedDepth { format, depth: table.texels.depth() })
}

/// Reads the entry of a whole texture file. The file is walked to its end, so that one that was
/// cut short is told from a good one; no more memory is taken than a small multiple of `bytes`.
///
/// # Errors
///
/// Another kind of file, a damaged one, or one without an entry.
pub fn read_entry(bytes: &[u8]) -> Result<TextureEntry, EntryError> {
    let format = Format::of(bytes).ok_or(EntryError::UnknownFormat)?;
    let entry = match format {
        Format::Exr => exr::entry(bytes).map_err(|error| error.to_string()),
        Format::Ktx2 => ktx2::entry(bytes).map_err(|error| error.to_string()),
        Format::Png => png::entry(bytes).map_err(|error| error.to_string()),
    };
    let entry = entry.map_err(|reason| EntryError::Damaged { format, reason })?;
    let entry = entry.ok_or(EntryError::Missing(format))?;
    TextureEntry::from_json(&entry)
        .map_err(|error| EntryError::Invalid { format, reason: error.to_string() })
}
