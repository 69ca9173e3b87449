//! Measurements as they are named on the command line: by their path.

use std::path::Path;

use crate::cli::failure::Failure;
use sgdbake::measurement::{Measurement, MeasurementError, Problem};

/// Reads a measurement.
///
/// # Errors
///
/// As [`Measurement::read`], with what to do about it.
pub fn read(path: &Path) -> Result<Measurement, Failure> {
    Measurement::read(path).map_err(Failure::from)
}

/// A measurement's name: that of its file without the ending.
#[must_use]
pub fn name(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

impl From<MeasurementError> for Failure {
    fn from(error: MeasurementError) -> Self {
        let help = match &error.problem {
            Problem::Spectral | Problem::Anisotropic(_) => {
                "the database offers each material as spectra and as RGB, and marks the anisotropic"
            }
            Problem::Length { .. } | Problem::Tensor(_) => "copy or download the file again",
            Problem::Header(_) | Problem::Row { .. } => {
                "the first line names the columns, e.g. theta_i,phi_i,theta_o,phi_o,r,g,b"
            }
            _ => "readable are MERL .binary, RGL .bsdf (RGB, isotropic) and .csv of samples",
        };
        Self::job(&error).help(help)
    }
}
