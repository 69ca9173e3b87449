//! KTX 2: one level, uncompressed, `R16G16B16A16_SFLOAT` or `R32G32B32A32_SFLOAT`, 2D or 3D.
//!
//! The key `sgdbake` holds the table's entry. Alpha is 1. No crate writes the container,
//! so it is laid out here (Khronos, KTX File Format Specification 2.0).

use half::f16;
use ktx2::{Header, KeyValueDataIterator, LevelIndex, ParseError};

use crate::encode::entry::TextureEntry;
use crate::encode::format::Format;
use crate::encode::{GENERATOR, KEY};
use crate::lut::{Depth, Table, Texels};

/// Identifier, header, index and one level index entry.
const HEAD_BYTES: usize = 12 + 9 * 4 + 4 * 4 + 2 * 8 + 3 * 8;
const R16G16B16A16_SFLOAT: u32 = 97;
const R32G32B32A32_SFLOAT: u32 = 109;

/// Encodes a table as KTX 2; `None` for 16-bit integer texels, which the formats here do not hold.
#[must_use]
pub fn encode(table: &Table) -> Option<Vec<u8>> {
    let (format, channel_bytes) = match table.texels.depth() {
        Depth::Half => (R16G16B16A16_SFLOAT, 2),
        Depth::Float => (R32G32B32A32_SFLOAT, 4),
        Depth::Unorm16 => return None,
    };
    let descriptor = data_format_descriptor(channel_bytes);
    let key_values = key_values(table);
    let level_bytes = table.texels.len() * 4 * channel_bytes as usize;
    let key_values_at = HEAD_BYTES + descriptor.len();
    // A level starts at a multiple of its texels' bytes.
    let level_at = (key_values_at + key_values.len()).next_multiple_of(4 * channel_bytes as usize);
    // 0 marks a 2D texture.
    let depth = table.size.get(2).map_or(0, |depth| *depth as u32);
    let mut bytes = Vec::with_capacity(level_at + level_bytes);
    bytes.extend(ktx2::MAGIC);
    // vkFormat, typeSize, width, height, depth, layers (0: no array), faces, levels,
    // supercompression (0: none).
    let header =
        [format, channel_bytes, table.size[0] as u32, table.size[1] as u32, depth, 0, 1, 1, 0];
    // Offset and length of the data format descriptor and of the keys and values.
    let index = [HEAD_BYTES, descriptor.len(), key_values_at, key_values.len()].map(|n| n as u32);
    for word in header.into_iter().chain(index) {
        bytes.extend(word.to_le_bytes());
    }
    // No supercompression data; then the level's offset, stored length and plain length.
    for word in [0, 0, level_at, level_bytes, level_bytes] {
        bytes.extend((word as u64).to_le_bytes());
    }
    bytes.extend(descriptor);
    bytes.extend(key_values);
    bytes.resize(level_at, 0);
    append_texels(&mut bytes, &table.texels);
    Some(bytes)
}

/// The entry of a KTX 2 file; `None` if it carries none.
///
/// # Errors
///
/// The header, the keys or a level reach beyond the file.
// Not by `ktx2::Reader`: it also parses the data format descriptor, and panics on a damaged one.
pub fn entry(bytes: &[u8]) -> Result<Option<String>, ParseError> {
    let (head, _) = bytes.split_first_chunk().ok_or(ParseError::UnexpectedEnd)?;
    let Header { index, level_count, .. } = Header::from_bytes(head)?;
    // A level count of 0 asks a reader to make mipmaps: one level is stored all the same.
    let levels = (level_count.max(1) as usize).saturating_mul(LevelIndex::LENGTH);
    let levels = section(bytes, Header::LENGTH as u64, levels as u64)?;
    for level in levels.as_chunks().0.iter().map(LevelIndex::from_bytes) {
        section(bytes, level.byte_offset, level.byte_length)?;
    }
    let key_values = section(bytes, index.kvd_byte_offset.into(), index.kvd_byte_length.into())?;
    let entry = KeyValueDataIterator::new(key_values).find(|(key, _)| *key == KEY);
    Ok(entry.map(|(_, text)| String::from_utf8_lossy(text).trim_end_matches('\0').to_owned()))
}

fn section(bytes: &[u8], start: u64, length: u64) -> Result<&[u8], ParseError> {
    let end = start.saturating_add(length);
    let range = usize::try_from(start).ok().zip(usize::try_from(end).ok());
    range.and_then(|(start, end)| bytes.get(start..end)).ok_or(ParseError::UnexpectedEnd)
}

/// The basic data format descriptor: linear BT.709 RGBA, signed floats.
fn data_format_descriptor(channel_bytes: u32) -> Vec<u8> {
    const VERSION_2: u32 = 2;
    const RGBSDA_BT709_LINEAR: u32 = 1 | 1 << 8 | 1 << 16;
    const FLOAT_SIGNED: u32 = 0xC0;
    let block_bytes = 24 + 4 * 16;
    // Total size; Khronos, basic format; version and block size; model (RGBSDA), primaries and
    // transfer function; a block of one texel; bytes of plane 0, of the planes after it none.
    let mut words = vec![
        4 + block_bytes,
        0,
        VERSION_2 | block_bytes << 16,
        RGBSDA_BT709_LINEAR,
        0,
        4 * channel_bytes,
        0,
    ];
    // A sample each: red, green, blue, and 15 for alpha.
    for (i, channel) in [0, 1, 2, 15].into_iter().enumerate() {
        let bits = 8 * channel_bytes;
        // Bit offset, length − 1, channel with its type; place in the block; range −1 to 1.
        words.push((i as u32 * bits) | ((bits - 1) << 16) | (channel | FLOAT_SIGNED) << 24);
        words.extend([0, (-1f32).to_bits(), 1f32.to_bits()]);
    }
    words.into_iter().flat_map(u32::to_le_bytes).collect()
}

/// Key and value pairs, sorted by key, each padded to four bytes.
fn key_values(table: &Table) -> Vec<u8> {
    let entry = TextureEntry::of_file(table, Format::Ktx2);
    let mut bytes = Vec::new();
    for (key, value) in [("KTXwriter", GENERATOR), (KEY, &entry.to_json())] {
        bytes.extend(((key.len() + value.len() + 2) as u32).to_le_bytes());
        for text in [key, value] {
            bytes.extend(text.as_bytes());
            bytes.push(0);
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes
}

/// The level: texels with an alpha of 1, in little-endian bytes.
fn append_texels(bytes: &mut Vec<u8>, texels: &Texels) {
    match texels {
        Texels::Half(texels) => {
            // In pieces, so that no second copy of a large level is held.
            for texels in texels.chunks(1 << 12) {
                let rgba: Vec<[u16; 4]> = texels
                    .iter()
                    .map(|[r, g, b]| [*r, *g, *b, f16::ONE].map(|t| t.to_bits().to_le()))
                    .collect();
                bytes.extend_from_slice(bytemuck::cast_slice(&rgba));
            }
        }
        Texels::Float(texels) => {
            for [r, g, b] in texels {
                bytes.extend([*r, *g, *b, 1.0].into_iter().flat_map(f32::to_le_bytes));
            }
        }
        Texels::Unorm16 { .. } => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lut::{Depths, Extent, Quantity, Request, bake};
    use crate::material::find;

    #[test]
    fn another_parser_reads_the_same_texels() {
        let material = &find("chrome").expect("in the catalogue").material;
        for depth in [Depth::Half, Depth::Float] {
            let request = Request {
                quantities: vec![Quantity::Masking],
                masking: Default::default(),
                extent: Extent::Size(33),
                depths: Depths::Only(depth),
            };
            let baked = bake(&[material], &request).expect("a plain bake");
            let bytes = encode(&baked.tables[0]).expect("a float depth");
            let reader = ktx2::Reader::new(&bytes[..]).expect("valid");
            assert_eq!((reader.header().pixel_width, reader.header().pixel_height), (33, 1));
            // The format ends a text value with NUL, which this parser leaves on.
            let writer = reader.writer().map(|writer| writer.trim_end_matches('\0'));
            assert_eq!(writer, Some(GENERATOR));
            let level = reader.levels().next().expect("one level").data;
            let texel: [f32; 3] = std::array::from_fn(|c| match depth {
                Depth::Half => {
                    f16::from_le_bytes([level[8 * 20 + 2 * c], level[8 * 20 + 2 * c + 1]]).to_f32()
                }
                _ => f32::from_le_bytes(std::array::from_fn(|i| level[16 * 20 + 4 * c + i])),
            });
            assert_eq!(texel, baked.tables[0].texels.get(20));
        }
    }
}
