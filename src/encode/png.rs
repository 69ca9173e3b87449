//! 16-bit RGB PNG of the tables whose texels fit a range: code/65535 runs from the entry's
//! `range[0]` to `range[1]`. No gamma; row 0 is the first scanline. The text chunk `sgdbake` holds
//! the table's manifest entry.

use png::{BitDepth, ColorType, Compression, Encoder, EncodingError};

use crate::encode::GENERATOR;
use crate::encode::manifest::{Format, Location, TextureEntry};
use crate::lut::{Table, Texels};

/// The table as a PNG; `None` if its texels are floating point.
///
/// # Panics
///
/// Never: the image has as many codes as its size says, and memory takes every write.
#[must_use]
pub fn encode(table: &Table, name: &str) -> Option<Vec<u8>> {
    let Texels::Unorm16 { codes, .. } = &table.texels else { return None };
    let codes: Vec<u8> = codes.iter().flatten().flat_map(|code| code.to_be_bytes()).collect();
    Some(write(table, name, &codes).expect("a complete image written to memory"))
}

fn write(table: &Table, name: &str, codes: &[u8]) -> Result<Vec<u8>, EncodingError> {
    let entry = TextureEntry::new(table, Format::Png, Location::File { file: name.to_owned() });
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, table.size[0] as u32, table.size[1] as u32);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Sixteen);
    encoder.set_compression(Compression::Fast);
    encoder.add_text_chunk("Software".to_owned(), GENERATOR.to_owned())?;
    encoder.add_itxt_chunk("sgdbake".to_owned(), entry.to_json())?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(codes)?;
    writer.finish()?;
    Ok(bytes)
}
