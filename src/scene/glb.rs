//! The binary glTF container: a 12-byte header, a JSON chunk, a BIN chunk, further chunks.

use std::{
    fs::File,
    io::{self, BufReader, Read, Seek, SeekFrom},
    path::Path,
    sync::Arc,
};

use crate::scene::size::{self, Text};
use crate::scene::{Bytes, SceneError};

const MAGIC: u32 = u32::from_le_bytes(*b"glTF");
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");
/// Bytes of magic, version and length.
const HEADER: u64 = 12;
/// Bytes of a chunk's length and kind.
const CHUNK_HEADER: u64 = 8;

/// The content of a .glb. Chunk contents keep their padding.
#[derive(Debug)]
pub(super) struct Glb {
    pub json: String,
    pub bin: Option<Bytes>,
    /// Chunks after BIN with their headers, passed on as they are.
    pub rest: Option<Bytes>,
}

impl Glb {
    /// Returns whether a file that starts with these bytes is a .glb.
    pub fn is_glb(start: &[u8]) -> bool {
        start.starts_with(&MAGIC.to_le_bytes())
    }

    /// Reads the headers and the JSON chunk; the rest stays in the file. Nothing is allocated
    /// before it is known to lie within the file.
    pub fn open(path: &Path) -> Result<Self, SceneError> {
        let file = File::open(path)?;
        let size = file.metadata()?.len();
        let mut file = BufReader::new(file);
        let [magic, version, length] = words(&mut file)?;
        if magic != MAGIC {
            return Err(SceneError::Glb("the file does not start with glTF".into()));
        }
        if version != 2 {
            return Err(SceneError::Version { found: format!("the .glb is of version {version}") });
        }
        // Another length is a file that was cut off, or to which something was appended.
        if u64::from(length) != size {
            return Err(SceneError::Glb(format!(
                "the header claims {length} bytes, the file has {size}"
            )));
        }
        let chunks = chunks(&mut file, size)?;
        // glTF has JSON first and BIN, if at all, second; whatever follows is not ours.
        let (json, bin, rest) = match *chunks.as_slice() {
            [
                Chunk { kind: JSON, offset, length },
                Chunk { kind: BIN, offset: at, length: n },
                ..,
            ] => ((offset, length), Some((at, n)), at + n),
            [Chunk { kind: JSON, offset, length }, ..] => ((offset, length), None, offset + length),
            _ => return Err(SceneError::Glb("the first chunk is not JSON".into())),
        };
        size::check(Text::Gltf, json.1)?;
        file.seek(SeekFrom::Start(json.0))?;
        let mut text = Vec::new();
        // `chunks` has checked that the length lies within the file.
        Read::by_ref(&mut file).take(json.1).read_to_end(&mut text)?;
        let path: Arc<Path> = path.into();
        Ok(Glb {
            json: String::from_utf8(text).map_err(|_| SceneError::Utf8)?,
            bin: bin.map(|(offset, length)| Bytes::Span { path: path.clone(), offset, length }),
            rest: (rest < size).then(|| Bytes::Span {
                path: path.clone(),
                offset: rest,
                length: size - rest,
            }),
        })
    }
}

struct Chunk {
    kind: u32,
    offset: u64,
    length: u64,
}

fn chunks(file: &mut BufReader<File>, size: u64) -> Result<Vec<Chunk>, SceneError> {
    let mut chunks = Vec::new();
    let mut at = HEADER;
    while at < size {
        if size - at < CHUNK_HEADER {
            return Err(SceneError::Glb(format!("{} stray bytes at the end", size - at)));
        }
        let [length, kind] = words(file)?;
        let (offset, length) = (at + CHUNK_HEADER, u64::from(length));
        // At least a chunk header is left, so the difference does not underflow.
        if length > size - offset {
            return Err(SceneError::Glb(format!(
                "the chunk at byte {at} claims {length} bytes, {} are left",
                size - offset
            )));
        }
        chunks.push(Chunk { kind, offset, length });
        at = offset + length;
        file.seek_relative(length as i64)?;
    }
    Ok(chunks)
}

fn words<const N: usize>(file: &mut BufReader<File>) -> Result<[u32; N], SceneError> {
    let mut words = [0; N];
    for word in &mut words {
        let mut bytes = [0; 4];
        file.read_exact(&mut bytes).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => SceneError::Glb("the file ends in a header".into()),
            _ => error.into(),
        })?;
        *word = u32::from_le_bytes(bytes);
    }
    Ok(words)
}

/// The pieces of a .glb: JSON padded with spaces, BIN with zeros, both to four bytes.
///
/// # Errors
/// [`SceneError::TooLarge`] beyond 4 GiB, for which the header has no room.
pub(super) fn assemble(
    json: String,
    bin: Option<Vec<Bytes>>,
    rest: Option<Bytes>,
) -> Result<Vec<Bytes>, SceneError> {
    let mut pieces = chunk(JSON, vec![json.into_bytes().into()], b' ')?;
    if let Some(bin) = bin {
        pieces.extend(chunk(BIN, bin, 0)?);
    }
    pieces.extend(rest);
    // The length in the header counts the header itself.
    let total = word(HEADER + pieces.iter().map(Bytes::len).sum::<u64>())?;
    let header = [MAGIC, 2, total].map(u32::to_le_bytes).concat();
    pieces.insert(0, header.into());
    Ok(pieces)
}

fn chunk(kind: u32, content: Vec<Bytes>, pad: u8) -> Result<Vec<Bytes>, SceneError> {
    let length: u64 = content.iter().map(Bytes::len).sum();
    let padding = vec![pad; padding(length)];
    let header = [word(length + padding.len() as u64)?, kind].map(u32::to_le_bytes).concat();
    let mut pieces = vec![header.into()];
    pieces.extend(content);
    if !padding.is_empty() {
        pieces.push(padding.into());
    }
    Ok(pieces)
}

/// Bytes from `length` to the next multiple of four.
pub(super) fn padding(length: u64) -> usize {
    // 4 divides 2⁶⁴, so the wrapped −length leaves the right remainder.
    (length.wrapping_neg() % 4) as usize
}

fn word(length: u64) -> Result<u32, SceneError> {
    u32::try_from(length).map_err(|_| SceneError::TooLarge(length))
}
