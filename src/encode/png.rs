//! 16-bit RGB PNG of the tables whose texels fit a range: code/65535 runs from the entry's
//! `range[0]` to `range[1]`. No gamma; row 0 is the first scanline. The text chunk `sgdbake` holds
//! the table's entry.

use std::io::Cursor;

use png::{
    BitDepth, ColorType, Compression, Decoder, DecodingError, Encoder, EncodingError, Limits,
};

use crate::encode::entry::TextureEntry;
use crate::encode::format::Format;
use crate::encode::{GENERATOR, KEY};
use crate::lut::{Table, Texels};

/// Encodes a table as PNG; `None` for floating-point texels.
///
/// # Panics
///
/// Never: the image has as many codes as its size says, and memory takes every write.
#[must_use]
pub fn encode(table: &Table) -> Option<Vec<u8>> {
    let Texels::Unorm16 { codes, .. } = &table.texels else { return None };
    // PNG is big-endian.
    let codes: Vec<u8> = codes.iter().flatten().flat_map(|code| code.to_be_bytes()).collect();
    Some(write(table, &codes).expect("a complete image written to memory"))
}

/// The entry of a PNG; `None` if it carries none.
///
/// # Errors
///
/// A chunk is damaged or missing, or a row is too long for any table.
pub fn entry(bytes: &[u8]) -> Result<Option<String>, DecodingError> {
    /// Hundreds of times the longest row and text that are written.
    const LARGEST: usize = 16 << 20;
    let decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: LARGEST });
    let mut reader = decoder.read_info()?;
    // To the end: text may follow the image, and a file cut short must be an error.
    reader.finish()?;
    let text = reader.info().utf8_text.iter().find(|text| text.keyword == KEY);
    let Some(mut text) = text.cloned() else { return Ok(None) };
    // Whoever rewrites the file may compress it; the crate bounds what it may grow to.
    text.decompress_text()?;
    text.get_text().map(Some)
}

fn write(table: &Table, codes: &[u8]) -> Result<Vec<u8>, EncodingError> {
    let entry = TextureEntry::of_file(table, Format::Png);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, table.size[0] as u32, table.size[1] as u32);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Sixteen);
    encoder.set_compression(Compression::Fast);
    encoder.add_text_chunk("Software".to_owned(), GENERATOR.to_owned())?;
    // iTXt is UTF-8: a material's name may be outside the Latin-1 of tEXt.
    encoder.add_itxt_chunk(KEY.to_owned(), entry.to_json())?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(codes)?;
    writer.finish()?;
    Ok(bytes)
}
