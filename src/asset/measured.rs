//! The table `[measured]` of a material file: the measurement that the parameters were fitted to.

use serde::{Deserialize, Serialize};

use crate::asset::direct::Distances;
use crate::asset::fingerprint::fingerprint;
use crate::asset::material::StatedError;
use crate::brdf::GltfBrdf;
use crate::encode::GENERATOR;
use crate::fit::sgd::Energy;
use crate::material::{Material, to_toml};

/// A material that was fitted to a measurement: the distance between the two, and the glTF
/// material fitted directly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The measurement's file.
    pub source: String,
    /// The limit that the fit kept.
    pub energy: Energy,
    /// The distance of the material from the measurement.
    pub error: Distances,
    /// The glTF material that was fitted to the measurement itself.
    pub gltf: GltfBrdf,
    /// The distance of that.
    pub gltf_error: Distances,
}

/// The table in its file.
#[derive(Serialize, Deserialize)]
struct File {
    measured: Marked,
}

/// The table with a mark by which parameters that were edited since are told.
#[derive(Serialize, Deserialize)]
struct Marked {
    parameters: String,
    #[serde(flatten)]
    measured: Measured,
}

/// How a file that was written here begins.
const FIRST_LINE: &str = "# Fitted by sgdbake ";

impl Measured {
    /// The text of a material's file with this table.
    ///
    /// # Panics
    ///
    /// Never: strings and numbers have a TOML form.
    #[must_use]
    pub fn to_text(&self, material: &Material) -> String {
        let marked = Marked { parameters: mark(material), measured: self.clone() };
        let table = toml::to_string(&File { measured: marked });
        let table = table.expect("strings and numbers have a TOML form");
        format!("# Fitted by {GENERATOR}\n{}\n{table}", to_toml(material))
    }

    /// The table in the text of a material's file; `None` without one, or where the parameters were
    /// edited since it was written.
    #[must_use]
    pub fn of_text(text: &str, material: &Material) -> Option<Self> {
        let File { measured } = toml::from_str(text.trim_start_matches('\u{feff}')).ok()?;
        (measured.parameters == mark(material)).then_some(measured.measured)
    }

    /// Returns whether a material file was written here and its parameters are still those.
    #[must_use]
    pub fn is_unedited(text: &str, material: &Material) -> bool {
        text.starts_with(FIRST_LINE) && Self::of_text(text, material).is_some()
    }

    /// The error as the other files state it.
    #[must_use]
    pub fn stated_error(&self) -> StatedError {
        StatedError { delta_e: self.error.suns, source: self.source.clone() }
    }
}

/// The mark of a material's parameters, whatever its name.
fn mark(material: &Material) -> String {
    let text = to_toml(material);
    // The name alone is in the first line of `to_toml`: renaming a material is no edit.
    fingerprint(text.split_once('\n').map_or("", |(_name, parameters)| parameters))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    use crate::material::{find, parse};

    /// What a material file says of its measurement, and whether nobody edited it.
    fn read(text: &str) -> (Option<Measured>, bool) {
        let material = parse(text, Path::new("m.toml")).expect("a material file");
        (Measured::of_text(text, &material), Measured::is_unedited(text, &material))
    }

    #[test]
    fn the_table_is_read_back_until_a_parameter_is_edited() {
        let error = Distances {
            suns: 0.5,
            highlights: 1.5,
            absolute: 1e-3,
            relative: 0.02,
            lightness: 0.01,
        };
        let gltf = GltfBrdf {
            base_color: [0.5, 0.25, 1e-9],
            metallic: 0.0,
            roughness: 0.3,
            specular_factor: 1.0,
            specular_color: [1.0; 3],
            clearcoat: None,
            clearcoat_roughness: Some(0.25),
        };
        let source = "a\n[lobe]\u{1b} \"paint\".binary".to_owned();
        let measured =
            Measured { source, energy: Energy::Conserve, error, gltf, gltf_error: error };
        let material = find("gold-paint").expect("in the catalogue").material.clone();
        let text = measured.to_text(&material);
        assert_eq!(read(&text), (Some(measured.clone()), true));
        let renamed = text.replace("gold-paint", "my gold");
        assert_eq!(read(&renamed), (Some(measured), true));
        let edited = text.replacen("rho_d = [", "rho_d = [0.5, 0.5, 0.5] #", 1);
        assert_eq!(read(&edited), (None, false));
        assert_eq!(read(&to_toml(&material)), (None, false));
    }
}
