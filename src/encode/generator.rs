//! The program that an image file names as its writer, read from the header alone.

use std::io::{BufRead, Read, Seek};

use ktx2::{Header, KeyValueDataIterator};
use png::{Decoder, Limits};

use crate::encode::format::Format;

/// The most bytes of metadata that are looked at: many times what sgdbake writes.
const LARGEST: usize = 16 << 20;

/// The program that an EXR, KTX 2 or PNG file names as its writer; `None` for another kind of file,
/// one that names none, or a damaged one. Texels are not read.
pub fn generator_of(mut file: impl BufRead + Seek) -> Option<String> {
    // The longest signature, that of KTX 2.
    let mut start = [0; 12];
    file.read_exact(&mut start).ok()?;
    file.rewind().ok()?;
    match Format::of(&start)? {
        Format::Exr => of_exr(file),
        Format::Ktx2 => of_ktx2(file),
        Format::Png => of_png(file),
    }
}

fn of_exr(file: impl BufRead + Seek) -> Option<String> {
    let meta = exr::meta::MetaData::read_from_buffered(file, false).ok()?;
    let mut headers = meta.headers.iter();
    headers.find_map(|header| header.own_attributes.software_name.as_ref()).map(ToString::to_string)
}

fn of_ktx2(mut file: impl BufRead + Seek) -> Option<String> {
    let mut head = [0; Header::LENGTH];
    file.read_exact(&mut head).ok()?;
    let index = Header::from_bytes(&head).ok()?.index;
    // The header may claim anything; no more than LARGEST is read.
    let length = usize::try_from(index.kvd_byte_length).ok().filter(|n| *n <= LARGEST)?;
    file.seek(std::io::SeekFrom::Start(index.kvd_byte_offset.into())).ok()?;
    let mut pairs = Vec::new();
    file.take(length as u64).read_to_end(&mut pairs).ok()?;
    let (_, writer) = KeyValueDataIterator::new(&pairs).find(|(key, _)| *key == "KTXwriter")?;
    Some(String::from_utf8_lossy(writer).trim_end_matches('\0').to_owned())
}

fn of_png(file: impl BufRead + Seek) -> Option<String> {
    let decoder = Decoder::new_with_limits(file, Limits { bytes: LARGEST });
    let reader = decoder.read_info().ok()?;
    // The chunk that `png::encode` writes ahead of the texels.
    let mut texts = reader.info().uncompressed_latin1_text.iter();
    texts.find(|text| text.keyword == "Software").map(|text| text.text.clone())
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use crate::encode::{GENERATOR, encode};
    use crate::lut::{Depth, Depths, Extent, Quantity, Request, bake};
    use crate::material::find;

    #[test]
    fn every_format_names_its_writer() {
        let material = &find("gold-paint").expect("in the catalogue").material;
        for format in Format::ALL {
            let depth = if format == Format::Png { Depth::Unorm16 } else { Depth::Half };
            let request = Request {
                quantities: vec![Quantity::Fresnel],
                masking: Default::default(),
                extent: Extent::Size(8),
                depths: Depths::Only(depth),
            };
            let table = &bake(&[material], &request).expect("a plain bake").tables[0];
            let bytes = encode(table, format).expect("the depth fits");
            assert_eq!(generator_of(Cursor::new(&bytes)).as_deref(), Some(GENERATOR), "{format}");
            for end in 0..64 {
                assert_eq!(generator_of(Cursor::new(&bytes[..end])), None, "{format} cut at {end}");
            }
        }
    }
}
