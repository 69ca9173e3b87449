//! Bytes that are passed on: in memory, or still in the file they came from.

use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom, Write},
    ops::Range,
    path::Path,
    sync::Arc,
};

/// A run of bytes that is copied but never looked into. A span of a file is copied by the
/// operating system when the target is a [`File`]; it does not pass through this process.
#[derive(Debug, Clone)]
pub enum Bytes {
    /// Bytes in memory.
    Memory(Arc<[u8]>),
    /// `length` bytes from `offset` of a file.
    Span {
        /// The file, opened when it is copied: a scene may name more than may be open at once.
        path: Arc<Path>,
        /// Where the bytes start.
        offset: u64,
        /// How many there are.
        length: u64,
    },
}

impl Bytes {
    /// The whole file at `path`.
    pub fn file(path: &Path) -> io::Result<Self> {
        let length = path.metadata()?.len();
        Ok(Bytes::Span { path: path.into(), offset: 0, length })
    }

    /// How many bytes there are.
    pub fn len(&self) -> u64 {
        match self {
            Bytes::Memory(bytes) => bytes.len() as u64,
            Bytes::Span { length, .. } => *length,
        }
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The bytes of a range within these.
    pub fn slice(self, range: Range<u64>) -> Self {
        match self {
            // The whole keeps the shared memory; a part of it is a copy.
            _ if range == (0..self.len()) => self,
            Bytes::Memory(bytes) => {
                Bytes::Memory(bytes[range.start as usize..range.end as usize].into())
            }
            Bytes::Span { path, offset, .. } => {
                Bytes::Span { path, offset: offset + range.start, length: range.end - range.start }
            }
        }
    }

    /// Copies the bytes to `out`; a file that became shorter meanwhile is an error.
    pub fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        match self {
            Bytes::Memory(bytes) => out.write_all(bytes),
            Bytes::Span { path, offset, length } => {
                let mut file = File::open(path)?;
                file.seek(SeekFrom::Start(*offset))?;
                let copied = io::copy(&mut file.take(*length), out)?;
                if copied == *length { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
            }
        }
    }
}

impl From<Vec<u8>> for Bytes {
    fn from(bytes: Vec<u8>) -> Self {
        Bytes::Memory(bytes.into())
    }
}
