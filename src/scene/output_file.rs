//! The files that an export writes.

use std::io::{self, Write};
use std::path::PathBuf;

use crate::scene::Bytes;

/// The files and warnings of an export.
#[derive(Debug)]
pub struct Export {
    /// The scene first, then the files that it refers to.
    pub files: Vec<OutputFile>,
    /// Losses, and oddities that are likely not meant.
    pub warnings: Vec<String>,
}

/// A file to be written.
#[derive(Debug)]
pub struct OutputFile {
    /// Where.
    pub path: PathBuf,
    /// Its content, to be concatenated.
    pub pieces: Vec<Bytes>,
    /// True for a file of the input, unchanged.
    pub copy: bool,
}

impl OutputFile {
    /// Bytes that [`OutputFile::write_to`] writes.
    pub fn len(&self) -> u64 {
        self.pieces.iter().map(Bytes::len).sum()
    }

    /// Returns whether there is nothing to write.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Writes the content to `out`.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        self.pieces.iter().try_for_each(|piece| piece.write_to(out))
    }
}
