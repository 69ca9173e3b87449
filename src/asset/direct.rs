//! Fits of engine models made directly to the measurements of the catalogue, not by way of SGD.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use crate::asset::material::StatedError;
use crate::brdf::{GltfBrdf, OneLobe};
use crate::material::{Material, find, refit_of};

/// A line per material, made by `examples/refit_catalogue.rs`.
const TABLE: &str = include_str!("merl100-direct.jsonl");

/// The fits of a catalogue material's measurement, each with its distance from the surface.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct DirectFits {
    /// The published name.
    pub name: String,
    /// The published fit.
    pub published: Distances,
    /// The refit of one lobe or two.
    pub refit: Distances,
    /// The refit of one lobe.
    pub one_lobe: Distances,
    /// The refit without the limit on energy.
    pub free: Distances,
    /// The refit in the paper's form, a lobe for each channel.
    pub per_channel: Distances,
    /// glTF materials.
    pub gltf: Sources<GltfAt>,
    /// One GGX lobe.
    pub ggx: Sources<OneLobeAt>,
    /// One Beckmann lobe.
    pub beckmann: Sources<OneLobeAt>,
}

/// A fit to the measurement itself, and one to the published fit of it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Sources<T> {
    /// Fitted to the measurement.
    pub measured: T,
    /// Fitted to the published SGD.
    pub of_published: T,
}

/// A glTF material and its distance.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct GltfAt {
    /// The material.
    pub material: GltfBrdf,
    /// Its distance as appendix B of glTF evaluates it.
    pub error: Distances,
    /// Mean ΔE2000 under suns as each engine evaluates it.
    pub engines: BTreeMap<String, f64>,
}

/// A lobe and its distance.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct OneLobeAt {
    /// The lobe.
    pub lobe: OneLobe,
    /// Its distance.
    pub error: Distances,
}

/// The distance of a model from a measured surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Distances {
    /// Mean ΔE2000 of a ball under suns that no fit saw.
    pub suns: f64,
    /// Mean ΔE2000 of its highlights under small area lights.
    pub highlights: f64,
    /// Mean absolute difference of f, cosine-weighted \[1/sr\].
    pub absolute: f64,
    /// The same relative to the mean of f.
    pub relative: f64,
    /// Relative error in lightness.
    pub lightness: f64,
}

/// Every catalogue material's direct fits, in the order of the catalogue.
pub fn direct_fits() -> &'static [DirectFits] {
    static FITS: LazyLock<Vec<DirectFits>> = LazyLock::new(|| {
        let fits = TABLE.lines().map(serde_json::from_str);
        fits.map(|fits| fits.expect("the embedded lines are JSON; a test reads all")).collect()
    });
    &FITS
}

/// The direct fits that belong to a material of the refit edition.
#[must_use]
pub fn direct_fits_of(material: &Material) -> Option<&'static DirectFits> {
    // Equal parameters are required besides the name: a file may carry the name of a catalogue
    // material and other numbers.
    let name = published_name(material)?;
    refit_of(name).filter(|entry| entry.material == *material)?;
    direct_fits().iter().find(|fits| fits.name == name)
}

/// The name without its edition.
fn published_name(material: &Material) -> Option<&str> {
    material.name.split('@').next()
}

/// The distance of a catalogue material of either edition from its measurement.
#[must_use]
pub fn stated_error(material: &Material) -> Option<StatedError> {
    let name = published_name(material)?;
    let refit = refit_of(name)?;
    let delta_e = if refit.material == *material {
        refit.error.delta_e
    } else {
        find(name).ok().filter(|entry| entry.material == *material)?;
        refit.published_delta_e
    };
    let source = format!("MERL {name}, as the network of Sztrajman et al. 2021 reproduces it");
    Some(StatedError { delta_e, source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{Edition, refit};

    #[test]
    fn every_refitted_material_has_direct_fits_and_a_stated_error() {
        for entry in refit() {
            let fits = direct_fits_of(&entry.material).expect("in the table");
            assert!((fits.refit.suns - entry.error.delta_e).abs() < 1e-4, "{}", fits.name);
        }
        for material in Edition::Published.materials().chain(Edition::Refit.materials()) {
            assert!(stated_error(material).is_some_and(|error| error.delta_e > 0.0));
        }
    }

    #[test]
    fn a_changed_material_has_neither() {
        let changed = refit()[0].material.clone().map_lobes(|lobe| lobe);
        assert!(direct_fits_of(&changed).is_some(), "equal parameters are the same material");
        let other = Material::new(changed.name.clone(), [0.5; 3], Vec::new()).expect("in range");
        assert!(direct_fits_of(&other).is_none() && stated_error(&other).is_none());
    }
}
