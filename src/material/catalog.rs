//! The published fits of the 100 isotropic MERL materials (Bagher et al. 2012, supplemental).

use std::sync::LazyLock;

use crate::material::parameters::{ChannelParams, MaskingParams, Material};
use crate::material::refit::{SUFFIX, refit, refit_of};

/// The table as published, one line per material and channel, rows r, g, b.
const TABLE: &str = include_str!("merl100.csv");

/// A catalogue material with the columns that follow from its parameters, as printed.
#[derive(Clone, Debug, PartialEq)]
pub struct CatalogEntry {
    /// The material.
    pub material: Material,
    /// Its rows of the paper's table, in the order r, g, b.
    pub channels: [ChannelParams; 3],
    /// Other numbers that the paper prints, per channel.
    pub printed: [Printed; 3],
}

/// Printed columns that are no parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Printed {
    /// Normalisation K = 1/(α Γ(1−p, α)).
    pub k: f64,
    /// Onset θ0 of the fitted masking \[rad\].
    pub theta0: f64,
    /// The fitting error that the paper states for the channel.
    pub error: f64,
}

/// No material of that name in the catalogue.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no material is called '{name}'")]
pub struct UnknownMaterial {
    /// The name asked for.
    pub name: String,
    /// Catalogue names that look most like it, best first.
    pub nearest: Vec<&'static str>,
}

/// The 100 materials in the table's order.
pub fn catalog() -> &'static [CatalogEntry] {
    static CATALOG: LazyLock<Vec<CatalogEntry>> = LazyLock::new(parse_table);
    &CATALOG
}

/// An edition of the catalogue.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Edition {
    /// The fits of the paper, to the digit: `gold-paint`.
    #[default]
    Published,
    /// Lobes that colour all channels, fitted to the measurements: `gold-paint@refit`.
    Refit,
}

impl Edition {
    /// Its 100 materials, in the order of the paper's table.
    pub fn materials(self) -> impl Iterator<Item = &'static Material> {
        let published = catalog().iter().map(|entry| &entry.material);
        let refitted = refit().iter().map(|entry| &entry.material);
        let (published, refitted) = match self {
            Self::Published => (Some(published), None),
            Self::Refit => (None, Some(refitted)),
        };
        published.into_iter().flatten().chain(refitted.into_iter().flatten())
    }

    /// The edition that holds this very material.
    #[must_use]
    pub fn of(material: &Material) -> Option<Self> {
        let holds = |edition: &Self| edition.material(&material.name) == Some(material);
        [Self::Published, Self::Refit].into_iter().find(holds)
    }

    /// The other one.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Published => Self::Refit,
            Self::Refit => Self::Published,
        }
    }

    /// Its material of a name of either edition.
    #[must_use]
    pub fn material(self, name: &str) -> Option<&'static Material> {
        let name = name.strip_suffix(SUFFIX).unwrap_or(name);
        match self {
            Self::Published => find(name).ok().map(|entry| &entry.material),
            Self::Refit => refit_of(name).map(|entry| &entry.material),
        }
    }
}

/// The material of that exact name in either edition.
///
/// # Errors
///
/// [`UnknownMaterial`] with the nearest names.
pub fn named(name: &str) -> Result<&'static Material, UnknownMaterial> {
    match name.strip_suffix(SUFFIX) {
        Some(of) => refit_of(of)
            .map(|entry| &entry.material)
            .ok_or_else(|| UnknownMaterial { name: name.to_owned(), nearest: nearest_names(of) }),
        None => find(name).map(|entry| &entry.material),
    }
}

/// The catalogue entry of that exact name.
///
/// # Errors
///
/// [`UnknownMaterial`] with the nearest names.
pub fn find(name: &str) -> Result<&'static CatalogEntry, UnknownMaterial> {
    catalog()
        .iter()
        .find(|entry| entry.material.name == name)
        .ok_or_else(|| UnknownMaterial { name: name.to_owned(), nearest: nearest_names(name) })
}

/// The three catalogue names most similar to `name`.
fn nearest_names(name: &str) -> Vec<&'static str> {
    let similarity = |candidate: &str| {
        strsim::jaro_winkler(&name.to_lowercase(), candidate)
            + if candidate.contains(name) { 1.0 } else { 0.0 }
    };
    let mut names: Vec<(f64, &str)> = catalog()
        .iter()
        .map(|entry| (similarity(&entry.material.name), entry.material.name.as_str()))
        .collect();
    names.sort_by(|a, b| b.0.total_cmp(&a.0));
    names.into_iter().take(3).map(|(_, name)| name).collect()
}

fn parse_table() -> Vec<CatalogEntry> {
    let rows: Vec<(&str, ChannelParams, Printed)> = TABLE.lines().skip(1).map(parse_row).collect();
    rows.chunks_exact(3)
        .map(|rgb| {
            let channels = std::array::from_fn(|c| rgb[c].1);
            CatalogEntry {
                material: Material::of_channels(rgb[0].0, &channels)
                    .expect("published parameters are in range; a test reads all of them"),
                channels,
                printed: std::array::from_fn(|c| rgb[c].2),
            }
        })
        .collect()
}

/// material,channel,rho_d,rho_s,alpha,p,F0,F1,K,lambda,c,k,theta0,error
fn parse_row(line: &'static str) -> (&'static str, ChannelParams, Printed) {
    let columns: Vec<&str> = line.split(',').collect();
    let number = |i: usize| -> f64 {
        columns[i].parse().expect("the embedded table holds numbers; a test reads all of it")
    };
    let masking = MaskingParams { lambda: number(9), c: number(10), k: number(11) };
    let params = ChannelParams {
        rho_d: number(2),
        rho_s: number(3),
        alpha: number(4),
        p: number(5),
        f0: number(6),
        f1: number(7),
        masking: Some(masking),
    };
    (columns[0], params, Printed { k: number(8), theta0: number(12), error: number(13) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_100_valid_materials() {
        let names: Vec<&str> = catalog().iter().map(|e| e.material.name.as_str()).collect();
        assert_eq!(names.len(), 100);
        assert!(
            names.iter().collect::<std::collections::HashSet<_>>().len() == 100,
            "names are unique"
        );
        for entry in catalog() {
            assert_eq!(entry.material.lobes().len(), 3, "a lobe a channel");
            assert_eq!(entry.material.channels(), Some(entry.channels));
        }
    }

    #[test]
    fn a_misspelt_name_gets_suggestions() {
        let error = find("gold-pant").expect_err("misspelt");
        assert_eq!(error.nearest[0], "gold-paint");
    }
}
