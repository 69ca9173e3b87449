//! The published fits of the 100 isotropic MERL materials (Bagher et al. 2012, supplemental).

use std::sync::LazyLock;

use crate::material::embedded::numbers;
use crate::material::lobe::MaskingParams;
use crate::material::parameters::{ChannelParams, Material};
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

/// Printed columns other than parameters.
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
///
/// # Example
///
/// ```
/// use sgdbake::catalog;
///
/// assert_eq!(catalog().len(), 100);
/// let sharpest = catalog().iter().min_by(|a, b| {
///     let alpha = |entry: &sgdbake::material::CatalogEntry| entry.material.lobes()[0].alpha();
///     alpha(a).total_cmp(&alpha(b))
/// });
/// println!("{}", sharpest.expect("not empty").material.name);
/// ```
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
        // Both iterators with one of them empty: the function has one return type.
        let (published, refitted) = match self {
            Self::Published => (Some(published), None),
            Self::Refit => (None, Some(refitted)),
        };
        published.into_iter().flatten().chain(refitted.into_iter().flatten())
    }

    /// The edition that holds this very material.
    #[must_use]
    pub fn of(material: &Material) -> Option<Self> {
        [Self::Published, Self::Refit]
            .into_iter()
            .find(|edition| edition.material(&material.name) == Some(material))
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
///
/// # Example
///
/// ```
/// use sgdbake::named;
///
/// assert_eq!(named("chrome")?.name, "chrome");
/// assert_eq!(named("chrome@refit")?.name, "chrome@refit");
/// assert!(named("crome").is_err_and(|error| error.nearest.contains(&"chrome")));
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
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
    let mut names: Vec<(f64, &str)> = catalog()
        .iter()
        .map(|entry| (similarity(name, &entry.material.name), entry.material.name.as_str()))
        .collect();
    names.sort_by(|a, b| b.0.total_cmp(&a.0));
    names.into_iter().take(3).map(|(_, name)| name).collect()
}

fn parse_table() -> Vec<CatalogEntry> {
    let rows: Vec<(&str, ChannelParams, Printed)> = TABLE.lines().skip(1).map(parse_row).collect();
    // A material's channels are three consecutive lines.
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

/// The resemblance of a name to another, larger where it is part of it.
fn similarity(name: &str, other: &str) -> f64 {
    // Names resemble each other by at most 1, so those that contain `name` come first.
    let part = if other.contains(name) { 1.0 } else { 0.0 };
    strsim::jaro_winkler(&name.to_lowercase(), other) + part
}

/// material,channel,rho_d,rho_s,alpha,p,F0,F1,K,lambda,c,k,theta0,error
fn parse_row(line: &'static str) -> (&'static str, ChannelParams, Printed) {
    let columns: Vec<&str> = line.split(',').collect();
    let [rho_d, rho_s, alpha, p, f0, f1] = numbers(&columns, 2);
    let [printed_k, lambda, c, k, theta0, error] = numbers(&columns, 8);
    let masking = Some(MaskingParams { lambda, c, k });
    let params = ChannelParams { rho_d, rho_s, alpha, p, f0, f1, masking };
    (columns[0], params, Printed { k: printed_k, theta0, error })
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
