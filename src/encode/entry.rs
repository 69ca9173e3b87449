//! The manifest entry that every texture file carries, read back from the file alone.

use crate::encode::manifest::Format;
use crate::encode::{exr, ktx2, png};

/// A file whose manifest entry cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum EntryError {
    /// Another kind of file.
    #[error("neither an EXR nor a KTX 2 nor a PNG file")]
    NoTexture,
    /// A damaged EXR.
    #[error("not a valid EXR: {0}")]
    Exr(#[from] ::exr::error::Error),
    /// A damaged KTX 2.
    #[error("not a valid KTX 2: {0}")]
    Ktx2(#[from] ::ktx2::ParseError),
    /// A damaged PNG.
    #[error("not a valid PNG: {0}")]
    Png(#[from] ::png::DecodingError),
    /// An image without the entry.
    #[error("this {} carries no '{}' entry: sgdbake did not bake it", .0.extension(), super::KEY)]
    Missing(Format),
}

/// The entry as JSON, from a whole file. The file is walked to its end, so that one that was cut
/// short is told from a good one; no more memory is taken than a small multiple of `bytes`.
///
/// # Errors
///
/// [`EntryError`]: no texture file, a damaged one, or one without the entry.
pub fn read(bytes: &[u8]) -> Result<String, EntryError> {
    let format = Format::of(bytes).ok_or(EntryError::NoTexture)?;
    let entry = match format {
        Format::Exr => exr::entry(bytes)?,
        Format::Ktx2 => ktx2::entry(bytes)?,
        Format::Png => png::entry(bytes)?,
    };
    entry.ok_or(EntryError::Missing(format))
}
