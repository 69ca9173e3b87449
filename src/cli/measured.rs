//! Measurements as they are named on the command line: by their path.

use std::path::Path;
use std::time::Instant;

use crate::cli::failure::Failure;
use crate::cli::output::Output;
use sgdbake::fit::sgd::Options;
use sgdbake::measurement::{Measurement, MeasurementError, Problem};
use sgdbake::report::distance::Distance;
use sgdbake::report::surface::{Surface, SurfaceError, SurfaceFit};

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
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    if name.trim().is_empty() { "measured".to_owned() } else { name }
}

/// Returns whether a path ends as a measurement's does.
#[must_use]
pub fn is_named_so(path: &Path) -> bool {
    let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    matches!(ending.as_deref(), Some("binary" | "bsdf" | "csv"))
}

/// The surface of a measurement file and the material that is fitted to it; a note says so, with
/// the time it took and the distance.
///
/// # Errors
///
/// A file that is not a measurement, or one that nothing can be fitted to.
pub fn fitted(path: &Path, output: &Output) -> Result<(Surface, SurfaceFit), Failure> {
    let start = Instant::now();
    let (_, surface, fit) = surface_and_fit(path)?;
    output.note(format_args!(
        "note: {} was fitted in {:.1} s, {} and {:.2} ΔE2000 from the measurement; \
         'sgdbake measure' keeps the fit in a file",
        path.display(),
        start.elapsed().as_secs_f64(),
        match fit.material.lobes().len() {
            1 => "with one lobe".to_owned(),
            count => format!("with {count} lobes"),
        },
        fit.distance.suns
    ));
    Ok((surface, fit))
}

/// A measurement, its surface and the material that is fitted to it.
///
/// # Errors
///
/// As [`fitted`].
pub fn surface_and_fit(path: &Path) -> Result<(Measurement, Surface, SurfaceFit), Failure> {
    let measurement = read(path)?;
    let surface =
        Surface::new(&measurement.averaged()).map_err(|error| unfit(path, &error.into()))?;
    let fit =
        // `measure` has the options and keeps the result in a file.
        surface.fit(&name(path), Options::default()).map_err(|error| unfit(path, &error.into()))?;
    Ok((measurement, surface, fit))
}

/// The failure of a measurement that no material can be fitted to.
#[must_use]
pub fn unfit(path: &Path, error: &SurfaceError) -> Failure {
    Failure::job(format!("{}: {error}", path.display()))
        .help("'sgdbake audit --measured FILE' shows what a measurement covers")
}

/// The head of a table of distances.
pub const ERRORS: &str = "error against the measurement   ΔE2000 suns  highlights  absolute [1/sr]  \
                          relative  lightness";

/// A row of that table.
#[must_use]
pub fn error_row(model: &str, distance: &Distance) -> String {
    let Distance { suns, highlights, absolute, relative, lightness } = distance;
    format!(
        "{model:<30}  {suns:>11.2}  {highlights:>10.2}  {absolute:>15.5}  {relative:>8.4}  {lightness:>9.4}"
    )
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
            _ => "use MERL .binary, RGL .bsdf (RGB, isotropic) and .csv of samples",
        };
        Self::job(&error).help(help)
    }
}
