//! Errors of reading measurements.

use std::io;
use std::path::PathBuf;

/// A file that cannot be read as a measurement.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct MeasurementError {
    /// The file.
    pub path: PathBuf,
    /// The problem.
    pub problem: Problem,
}

/// Problems with a file or its content.
#[derive(Debug, thiserror::Error)]
pub enum Problem {
    /// The system cannot read it.
    #[error("cannot be read: {0}")]
    Unreadable(#[from] io::Error),
    /// A file without a byte.
    #[error("the file is empty")]
    Empty,
    /// None of the formats.
    #[error(
        "not a measurement; sgdbake reads MERL .binary, RGL .bsdf (RGB, isotropic) and .csv of samples"
    )]
    Unknown,
    /// Text, but not a table of samples.
    #[error(
        "text whose first line is not the header of a table of samples ('{0}'); name the \
         columns theta_i, phi_i, theta_o, phi_o [degrees] or wi_x, wi_y, wi_z, wo_x, wo_y, wo_z, \
         and r, g, b"
    )]
    Header(String),
    /// A row of a table of samples.
    #[error("line {line}: {problem}")]
    Row {
        /// 1-based line of the file.
        line: u64,
        /// The problem.
        problem: RowProblem,
    },
    /// A MERL file written with the other byte order.
    #[error("a MERL file in big-endian byte order; only little-endian files are readable")]
    BigEndian,
    /// A MERL file with another number of cells.
    #[error(
        "a MERL file of {} × {} × {} cells; sgdbake reads 90 × 90 × 180 (θh, θd, φd)",
        .0[0], .0[1], .0[2]
    )]
    Dimensions([i32; 3]),
    /// A file that is longer or shorter than its header says.
    #[error("{found} bytes long, where its header needs {needed}: truncated, or not a whole copy")]
    Length {
        /// Bytes that are there.
        found: u64,
        /// Bytes that should be.
        needed: u64,
    },
    /// A cell that holds no finite number.
    #[error(
        "{channel} at θh {}, θd {}, φd {} is {value}; cells are finite, negative where not measured",
        cell[0], cell[1], cell[2]
    )]
    Cell {
        /// red, green or blue.
        channel: &'static str,
        /// Indices along θh, θd, φd.
        cell: [usize; 3],
        /// Its content.
        value: f64,
    },
    /// Nothing that was measured.
    #[error("holds no measured value")]
    NothingMeasured,
    /// Not a well-formed tensor file.
    #[error("not a valid tensor file: {0}")]
    Tensor(#[from] TensorProblem),
    /// A tensor file of spectra.
    #[error("a spectral RGL file; use the RGB file of the same material (…_rgb.bsdf)")]
    Spectral,
    /// A measurement at several azimuths of incidence.
    #[error(
        "an anisotropic RGL file ({0} azimuths of incidence); sgdbake reads isotropic ones (at most 2)"
    )]
    Anisotropic(u64),
}

/// Problems in a row of a table of samples.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RowProblem {
    /// A different number of columns, or bytes that are not text.
    #[error("{0}")]
    Malformed(String),
    /// A column without a number.
    #[error("{column} is '{found}'; a finite number is needed")]
    NotANumber {
        /// The column.
        column: &'static str,
        /// The text found.
        found: String,
    },
    /// A direction that is zero, not finite or not above the surface.
    #[error("{0} does not point above the surface; leave out rows at and below the horizon")]
    Direction(&'static str),
    /// A reflectance below 0.
    #[error(
        "{column} is {found}; a reflectance is at least 0: leave out rows without a measurement"
    )]
    Negative {
        /// The column.
        column: &'static str,
        /// The value found.
        found: f64,
    },
}

/// Problems with the container of an RGL file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TensorProblem {
    /// It ends within its own directory.
    #[error("it ends within its list of fields")]
    Directory,
    /// Another version of the format.
    #[error("version {}.{}; sgdbake reads 1.0", .0[0], .0[1])]
    Version([u8; 2]),
    /// More fields, names or dimensions than any such file has.
    #[error("{what} is {found}; at most {most} are readable")]
    Excess {
        /// The quantity that is too large.
        what: &'static str,
        /// The size.
        found: u64,
        /// The largest size accepted.
        most: u64,
    },
    /// A field whose data lie outside the file.
    #[error("the field '{0}' reaches beyond the end of the file: truncated, or not a whole copy")]
    Beyond(String),
    /// A field that every such file has.
    #[error("the field '{0}' is missing")]
    Missing(&'static str),
    /// A field of another type or shape.
    #[error("the field '{name}' is {found}; needed is {needed}")]
    Shape {
        /// The field.
        name: &'static str,
        /// Its type and shape.
        found: String,
        /// Accepted values.
        needed: String,
    },
    /// A number that the field cannot hold.
    #[error("the field '{name}' holds {found} at {index}; needed is {needed}")]
    Value {
        /// The field.
        name: &'static str,
        /// The value, as text so that errors compare.
        found: String,
        /// The index of the number.
        index: usize,
        /// Accepted value.
        needed: &'static str,
    },
}
