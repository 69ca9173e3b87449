//! OpenEXR: flat, single part, scanline, increasing y, uncompressed, channels R G B.
//!
//! Row 0 of the table is the first scanline; of a 3D table texel (i, j, k) is column i of scanline
//! k·size\[1\] + j. The text attribute `sgdbake` holds the table's entry, so that the file alone says
//! how to decode it.

use std::io::Cursor;

use exr::block::reader::Reader;
use exr::image::IntoSample;
use exr::prelude::*;

use crate::encode::entry::TextureEntry;
use crate::encode::format::Format;
use crate::encode::{GENERATOR, KEY};
use crate::lut::range::WIDTHS;
use crate::lut::{Table, Texels};

/// Encodes a table as OpenEXR; `None` for 16-bit integer texels.
///
/// # Panics
///
/// Never: the channels have as many samples as the image, and memory takes every write.
#[must_use]
pub fn encode(table: &Table) -> Option<Vec<u8>> {
    let mut attributes = LayerAttributes::named("");
    // A flat file has channels R, G, B and no layer to name.
    attributes.layer_name = None;
    attributes.software_name = Some(GENERATOR.into());
    let entry = TextureEntry::of_file(table, Format::Exr).to_json();
    let entry = Text::from(entry.as_str());
    attributes.other.insert(KEY.into(), AttributeValue::Text(entry));
    let encoding = Encoding {
        compression: Compression::Uncompressed,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    // The slices of a 3D table follow one another down the picture.
    let size = Vec2(table.size[0], table.size[1..].iter().product());
    match &table.texels {
        Texels::Half(texels) => {
            Some(written(size, attributes, encoding, |i| texels[i], table.bytes()))
        }
        Texels::Float(texels) => {
            Some(written(size, attributes, encoding, |i| texels[i], table.bytes()))
        }
        Texels::Unorm16 { .. } => None,
    }
}

/// The picture whose i-th pixel has the given red, green and blue, about `bytes` long.
fn written<S: IntoSample>(
    size: Vec2<usize>,
    attributes: LayerAttributes,
    encoding: Encoding,
    rgb: impl Fn(usize) -> [S; 3] + Sync,
    bytes: usize,
) -> Vec<u8> {
    let channels = SpecificChannels::build()
        // OpenEXR lists channels in alphabetical order.
        .with_channel("B")
        .with_channel("G")
        .with_channel("R")
        .with_pixel_fn(|at| {
            let [r, g, b] = rgb(at.flat_index_for_size(size));
            (b, g, r)
        });
    let layer = Layer::new(size, attributes, encoding, channels);
    // Room for the header, and for the offset and the head of each scanline.
    let mut bytes = Cursor::new(Vec::with_capacity(bytes + bytes / 32 + (1 << 16)));
    Image::from_layer(layer)
        .write()
        .to_buffered(&mut bytes)
        .expect("a complete image written to memory");
    bytes.into_inner()
}

/// The entry of an OpenEXR file; `None` if it carries none.
///
/// # Errors
///
/// The header, or a block of texels that it claims, cannot be read.
pub fn entry(bytes: &[u8]) -> Result<Option<String>> {
    let reader = Reader::read_from_buffered(Cursor::new(bytes), false)?;
    // The reader allocates as many scanlines at once as a header claims to be in a block.
    if reader.headers().iter().any(|header| header.layer_size.width() > *WIDTHS.end()) {
        return Err(Error::Invalid("wider than any lookup texture".into()));
    }
    let attributes = reader.headers().iter().flat_map(|header| {
        header.own_attributes.other.iter().chain(&header.shared_attributes.other)
    });
    let mut entries = attributes.filter_map(|(name, value)| match value {
        AttributeValue::Text(text) if name.eq(KEY) => Some(text.to_string()),
        _ => None,
    });
    let entry = entries.next();
    // To the end of the last block, so that a file cut short is an error.
    reader.all_chunks(false)?.try_for_each(|chunk| chunk.map(drop))?;
    Ok(entry)
}
