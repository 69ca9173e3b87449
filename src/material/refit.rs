//! The second edition of the catalogue: lobes that colour all channels, fitted to the measurements.
//!
//! The measurements are those of the MERL database (Matusik et al. 2003) as the networks of
//! Sztrajman et al. (2021) reproduce them. `examples/refit_catalogue.rs` makes the table.

use std::sync::LazyLock;

use crate::material::parameters::{LobeFields, LobeParams, MaskingParams, Material};

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
    rows.chunk_by(|a, b| a[0] == b[0]).map(entry).collect()
}

/// The entry of a material's lines.
fn entry(lines: &[Vec<&str>]) -> RefitEntry {
    let number = |line: &[&str], i: usize| -> f64 {
        line[i].parse().expect("the embedded table holds numbers; a test reads all of it")
    };
    let colour = |line: &[&str], first: usize| [0, 1, 2].map(|c| number(line, first + c));
    let lobe = |line: &Vec<&str>| {
        let fields = LobeFields {
            alpha: number(line, 5),
            p: number(line, 6),
            rho_s: colour(line, 7),
            f0: colour(line, 10),
            f1: colour(line, 13),
            masking: Some(MaskingParams {
                lambda: number(line, 16),
                c: number(line, 17),
                k: number(line, 18),
            }),
        };
        LobeParams::new(fields).expect("refitted parameters are in range; a test reads all of them")
    };
    let first = &lines[0];
    let material = Material::new(
        format!("{}{SUFFIX}", first[0]),
        colour(first, 2),
        lines.iter().map(lobe).collect(),
    );
    RefitEntry {
        material: material.expect("refitted colours are in range; a test reads all of them"),
        error: SurfaceError {
            delta_e: number(first, 19),
            highlights: number(first, 20),
            absolute: number(first, 21),
            lightness: number(first, 22),
        },
        published_delta_e: number(first, 23),
    }
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
