//! The second edition of the catalogue: lobes that colour all channels, fitted to the measurements.
//!
//! The measurements are those of the MERL database (Matusik et al. 2003) as the networks of
//! Sztrajman et al. (2021) reproduce them. `examples/refit_catalogue.rs` makes the table.

use std::sync::LazyLock;

use crate::material::embedded::numbers;
use crate::material::lobe::{LobeFields, LobeParams, MaskingParams};
use crate::material::parameters::Material;

/// A line per material and lobe.
const TABLE: &str = include_str!("merl100-refit.csv");

/// Suffix of the names of this edition.
pub const SUFFIX: &str = "@refit";

/// A refitted material, and how far both editions are from the measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct RefitEntry {
    /// The material, its name ending with `@refit`.
    pub material: Material,
    /// The distance of this material.
    pub error: SurfaceError,
    /// Mean ΔE2000 of the published fit, as `error.delta_e`.
    pub published_delta_e: f64,
}

/// The distance of a material from the measured surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceError {
    /// Mean ΔE2000 of a ball under suns that the fit did not see.
    pub delta_e: f64,
    /// Mean ΔE2000 of its highlights under small area lights.
    pub highlights: f64,
    /// Mean absolute difference of f, cosine-weighted \[1/sr\].
    pub absolute: f64,
    /// Relative error in lightness.
    pub lightness: f64,
}

/// The refitted materials, in the order of the catalogue.
///
/// # Example
///
/// ```
/// use sgdbake::refit;
///
/// for entry in refit().iter().take(3) {
///     println!("{}: ΔE {:.2}", entry.material.name, entry.error.delta_e);
/// }
/// assert_eq!(refit().len(), 100);
/// ```
pub fn refit() -> &'static [RefitEntry] {
    static REFIT: LazyLock<Vec<RefitEntry>> = LazyLock::new(parse_table);
    &REFIT
}

/// The refit of a catalogue material, by the catalogue's name.
#[must_use]
pub fn refit_of(name: &str) -> Option<&'static RefitEntry> {
    refit().iter().find(|entry| entry.material.name.strip_suffix(SUFFIX) == Some(name))
}

fn parse_table() -> Vec<RefitEntry> {
    let rows: Vec<Vec<&str>> =
        TABLE.lines().skip(1).map(|line| line.split(',').collect()).collect();
    // The lines of a material are its lobes; the columns of the whole material repeat in each.
    rows.chunk_by(|a, b| a[0] == b[0]).map(entry).collect()
}

/// The entry of a material's lines.
fn entry(lines: &[Vec<&str>]) -> RefitEntry {
    let first = &lines[0];
    let material = Material::new(
        format!("{}{SUFFIX}", first[0]),
        numbers(first, 2),
        lines.iter().map(|line| lobe(line)).collect(),
    );
    let [delta_e, highlights, absolute, lightness, published_delta_e] = numbers(first, 19);
    RefitEntry {
        material: material.expect("refitted colours are in range; a test reads all of them"),
        error: SurfaceError { delta_e, highlights, absolute, lightness },
        published_delta_e,
    }
}

/// The lobe of a line.
fn lobe(line: &[&str]) -> LobeParams {
    let [alpha, p] = numbers(line, 5);
    let [lambda, c, k] = numbers(line, 16);
    let fields = LobeFields {
        alpha,
        p,
        rho_s: numbers(line, 7),
        f0: numbers(line, 10),
        f1: numbers(line, 13),
        masking: Some(MaskingParams { lambda, c, k }),
    };
    LobeParams::new(fields).expect("refitted parameters are in range; a test reads all of them")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::catalog;

    #[test]
    fn every_catalogue_material_has_a_refit_of_one_or_two_lobes() {
        let names: Vec<&str> =
            refit().iter().filter_map(|e| e.material.name.strip_suffix(SUFFIX)).collect();
        let published: Vec<&str> = catalog().iter().map(|e| e.material.name.as_str()).collect();
        assert_eq!(names, published);
        for entry in refit() {
            assert!((1..=2).contains(&entry.material.lobes().len()), "{}", entry.material.name);
        }
    }

    #[test]
    fn no_refit_is_farther_from_the_surface_than_the_published_fit() {
        for RefitEntry { material, error, published_delta_e } in refit() {
            assert!(error.delta_e <= *published_delta_e, "{}: {error:?}", material.name);
        }
    }
}
