//! Files that a command reads: regular ones of a size that makes sense, or stdin.

use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read as _};
use std::path::Path;

use crate::cli::failure::Failure;

/// The name that stands for stdin.
pub const STDIN: &str = "-";

/// The largest material or assignment file: many thousand times what one holds.
const LARGEST_TEXT: u64 = 16 << 20;

/// Refuses what would block or fill the memory: pipes, devices, folders, and texts of more than
/// 16 MiB. A file that is not there is left to whoever opens it.
pub fn check_text(path: &Path) -> Result<(), Failure> {
    let Ok(metadata) = fs::metadata(path) else { return Ok(()) };
    regular(path, &metadata)?;
    if metadata.len() > LARGEST_TEXT {
        let size = metadata.len();
        return Err(Failure::usage(format!("{} has {size} bytes", path.display()))
            .help(format!("a text of this kind has at most {LARGEST_TEXT} bytes")));
    }
    Ok(())
}

/// Refuses pipes, devices and folders.
pub fn check_regular(path: &Path) -> Result<(), Failure> {
    fs::metadata(path).map_or(Ok(()), |metadata| regular(path, &metadata))
}

fn regular(path: &Path, metadata: &fs::Metadata) -> Result<(), Failure> {
    if metadata.is_file() {
        return Ok(());
    }
    Err(Failure::usage(format!("{} is not a regular file", path.display()))
        .help("save the input to a file first"))
}

/// The failure of a file that cannot be read.
#[must_use]
pub fn unreadable(path: &Path, error: &io::Error) -> Failure {
    Failure::job(format!("cannot read {}: {error}", path.display()))
}

/// Reads a whole text.
pub fn read_text(path: &Path) -> Result<String, Failure> {
    if path == Path::new(STDIN) {
        let mut text = String::new();
        // Stdin has no length to check beforehand: what lies beyond the limit is not read.
        io::stdin()
            .take(LARGEST_TEXT)
            .read_to_string(&mut text)
            .map_err(|error| unreadable(path, &error))?;
        return Ok(text);
    }
    check_text(path)?;
    fs::read_to_string(path).map_err(|error| unreadable(path, &error))
}

/// Opens a file, or stdin for `-`, to be read line by line.
pub fn open(path: &Path) -> Result<Box<dyn BufRead>, Failure> {
    if path == Path::new(STDIN) {
        return Ok(Box::new(io::stdin().lock()));
    }
    check_regular(path)?;
    let file = File::open(path).map_err(|error| unreadable(path, &error))?;
    Ok(Box::new(BufReader::new(file)))
}

/// Reads the next line, of at most `most` bytes with its line break, into `line`, which gets it
/// without the break. Returns false at the end.
///
/// # Errors
///
/// A longer line, of which no more is read, and text that is not UTF-8.
pub fn next_line(input: &mut dyn BufRead, line: &mut String, most: usize) -> io::Result<bool> {
    line.clear();
    // One byte more than is allowed tells a line that is too long from one that just fits.
    let length = input.take(most as u64 + 1).read_line(line)?;
    if length > most {
        let reason = format!("the line has more than {most} bytes");
        return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
    }
    line.truncate(line.trim_end_matches(['\n', '\r']).len());
    Ok(length > 0)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::*;

    #[test]
    fn lines_are_bounded() {
        let mut line = String::new();
        let mut short: &[u8] = b"abc\r\n\nlast";
        let mut lines = Vec::new();
        while next_line(&mut short, &mut line, 8).unwrap() {
            lines.push(line.clone());
        }
        assert_eq!(lines, ["abc", "", "last"]);
        let mut endless = BufReader::new(io::repeat(b'x'));
        let error = next_line(&mut endless, &mut line, 100).unwrap_err().to_string();
        assert_eq!(error, "the line has more than 100 bytes");
    }
}
