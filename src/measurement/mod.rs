//! Measured reflectances: MERL and RGL files and tables of samples, read and written.
//!
//! A [`Measurement`] is a [`Reflectance`]: its value at a pair of directions is interpolated, and
//! NaN in all three colours where nothing was measured. [`Averaged`] makes it isotropic and
//! reciprocal, [`Filled`] closes its gaps, [`symmetry::Spread`] estimates its noise.
//! [`Merl::tabulate`] and [`Rgl::tabulate`] store any reflectance.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use glam::DVec3;
use serde::Serialize;

use crate::brdf::Reflectance;

pub mod deviation;
pub mod error;
pub mod filled;
pub mod half_difference;
pub mod merl;
pub mod rgl;
pub mod scattered;
pub mod symmetry;

mod rgl_tabulate;
mod tensor_file;
mod warp;

pub use error::{MeasurementError, Problem};
pub use filled::Filled;
pub use half_difference::HalfDifference;
pub use merl::Merl;
pub use rgl::Rgl;
pub use rgl_tabulate::INCIDENCES;
pub use scattered::Scattered;
pub use symmetry::Averaged;

/// The value of a pair that was not measured.
pub const NOT_MEASURED: [f64; 3] = [f64::NAN; 3];

/// One measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Direction to the light.
    pub wi: DVec3,
    /// Direction to the viewer.
    pub wo: DVec3,
    /// f(wi, wo) \[1/sr\] per colour.
    pub f: [f64; 3],
    /// Its share of ∫∫ dωi dωo over both hemispheres \[sr²\].
    pub weight: f64,
}

/// The formats of measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// MERL `.binary`.
    Merl,
    /// RGL `.bsdf`.
    Rgl,
    /// A table of samples, `.csv`.
    Csv,
}

/// A measured reflectance.
///
/// # Example
///
/// ```no_run
/// use sgdbake::{Measurement, Reflectance, spherical};
///
/// // MERL, RGL, or a table of samples as CSV: the content decides.
/// let measurement = Measurement::read("gold-paint.binary".as_ref())?;
/// let f = measurement.eval(spherical(0.3, 0.0), spherical(0.5, 3.0)); // NaN: not measured
/// println!("{f:?}");
/// # Ok::<(), sgdbake::measurement::MeasurementError>(())
/// ```
#[derive(Clone, Debug)]
pub enum Measurement {
    /// A table over half and difference angles.
    Merl(Merl),
    /// Tables in an adaptive parameterisation.
    Rgl(Box<Rgl>),
    /// Samples at any pairs.
    Scattered(Scattered),
}

impl Measurement {
    /// Reads a file; its content decides the format, whatever its name.
    ///
    /// Takes at most about twice the file's size in memory.
    ///
    /// # Errors
    ///
    /// The file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, MeasurementError> {
        let file = File::open(path).and_then(|file| {
            let length = file.metadata()?.len();
            Ok((file, length))
        });
        let read = file
            .map_err(Problem::from)
            .and_then(|(mut file, length)| Self::from_reader(&mut file, length));
        read.map_err(|problem| MeasurementError { path: path.to_owned(), problem })
    }

    /// Reads `length` bytes.
    ///
    /// # Errors
    ///
    /// The problem found in them.
    pub fn from_reader(reader: &mut (impl Read + Seek), length: u64) -> Result<Self, Problem> {
        let mut start = Vec::new();
        reader.by_ref().take(START_BYTES).read_to_end(&mut start)?;
        let content = Content::of(&start, length)?;
        reader.seek(SeekFrom::Start(content.start()))?;
        match content {
            Content::Merl => Merl::read(reader, length).map(Self::Merl),
            Content::Rgl => {
                let mut reader = BufReader::new(reader);
                Rgl::read(&mut reader, length).map(Box::new).map(Self::Rgl)
            }
            Content::Csv { delimiter } => {
                Scattered::read(BufReader::new(reader), delimiter).map(Self::Scattered)
            }
        }
    }

    /// The format it was read from.
    #[must_use]
    pub fn format(&self) -> Format {
        match self {
            Self::Merl(_) => Format::Merl,
            Self::Rgl(_) => Format::Rgl,
            Self::Scattered(_) => Format::Csv,
        }
    }

    /// Every measured value with its solid angles.
    #[must_use]
    pub fn samples(&self) -> Box<dyn Iterator<Item = Sample> + '_> {
        match self {
            Self::Merl(merl) => Box::new(merl.samples()),
            Self::Rgl(rgl) => Box::new(rgl.samples()),
            Self::Scattered(scattered) => Box::new(scattered.samples()),
        }
    }

    /// The measurement averaged over the symmetries of an isotropic reciprocal surface.
    #[must_use]
    pub fn averaged(&self) -> Averaged<'_> {
        Averaged(self)
    }
}

impl Reflectance for Measurement {
    /// f(wi, wo) as measured, interpolated; [`NOT_MEASURED`] where it was not, 0 below the
    /// horizon.
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        match self {
            Self::Merl(merl) => merl.eval(wi, wo),
            Self::Rgl(rgl) => rgl.eval(wi, wo),
            Self::Scattered(scattered) => scattered.eval(wi, wo),
        }
    }
}

/// The format of a file, as far as its beginning tells.
enum Content {
    Merl,
    Rgl,
    Csv { delimiter: u8 },
}

/// Bytes at the start of a file that tell its format.
const START_BYTES: u64 = 4096;

/// Most cells along an axis for three integers to be the header of some MERL file.
const MAX_CELLS: i32 = 4096;

impl Content {
    fn of(start: &[u8], length: u64) -> Result<Self, Problem> {
        if start.is_empty() {
            return Err(Problem::Empty);
        }
        if start.starts_with(&tensor_file::MAGIC) {
            return Ok(Self::Rgl);
        }
        // A MERL header has zero bytes, which no text has.
        if let Some(text) = text(start) {
            return Self::of_text(text);
        }
        let expected = merl::SIZE.map(|size| size as i32);
        match three_numbers(start, i32::from_le_bytes) {
            Some(found) if found == expected => Ok(Self::Merl),
            _ if three_numbers(start, i32::from_be_bytes) == Some(expected) => {
                Err(Problem::BigEndian)
            }
            Some(found) if is_header(found, length) => Err(Problem::Dimensions(found)),
            _ => Err(Problem::Unknown),
        }
    }

    /// A table of samples, by the separator of its first line that is not a comment.
    fn of_text(text: &str) -> Result<Self, Problem> {
        // Spreadsheets write a byte order mark in front of the first name.
        let lines = text.lines().map(|line| line.trim_start_matches('\u{feff}').trim());
        let header = lines.into_iter().find(|line| !line.is_empty() && !line.starts_with('#'));
        let header = header.unwrap_or_default();
        // The header has names alone, so that no decimal comma can be taken for a separator.
        let delimiter = [b',', b';', b'\t'].into_iter().find(|d| header.as_bytes().contains(d));
        delimiter.map_or_else(
            || Err(Problem::Header(header.chars().take(80).collect())),
            |delimiter| Ok(Self::Csv { delimiter }),
        )
    }

    /// Where the rest of the file is read from.
    fn start(&self) -> u64 {
        if matches!(self, Self::Merl) { 12 } else { 0 }
    }
}

/// The text that a file begins with, less a character that its end cuts; `None` for other bytes.
fn text(start: &[u8]) -> Option<&str> {
    let text = match std::str::from_utf8(start) {
        Ok(text) => text,
        // `None` is a character that goes on beyond the bytes at hand: valid so far.
        Err(error) if error.error_len().is_none() => {
            std::str::from_utf8(&start[..error.valid_up_to()]).ok()?
        }
        Err(_) => return None,
    };
    (!text.is_empty() && text.chars().all(|c| !c.is_control() || matches!(c, '\n' | '\r' | '\t')))
        .then_some(text)
}

/// The three integers that a file starts with.
fn three_numbers(start: &[u8], read: fn([u8; 4]) -> i32) -> Option<[i32; 3]> {
    let (numbers, _) = start.get(..12)?.as_chunks::<4>();
    Some([read(numbers[0]), read(numbers[1]), read(numbers[2])])
}

/// Returns whether three integers are the header of a MERL file with other sizes.
fn is_header(sizes: [i32; 3], length: u64) -> bool {
    if !sizes.iter().all(|size| (1..=MAX_CELLS).contains(size)) {
        return false;
    }
    // At most 4096³: neither the product nor its bytes overflow.
    let cells: u64 = sizes.iter().map(|size| u64::from(size.unsigned_abs())).product();
    length == 12 + 24 * cells
}
