//! `SLOT=MATERIAL`: which material goes to which slot of a scene.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::cli::failure::Failure;
use crate::cli::selection;
use crate::material::Material;
use crate::scene::{Pattern, SceneError, Slot, resolve};

/// Which slots take which materials.
#[derive(Debug, clap::Args)]
pub struct AssignmentArguments {
    /// A slot and its material. SLOT is a material name in the scene, a glob over names, '#N' for
    /// the N-th (from 0), '(none)' for primitives without a material, or '*' for all; the closest
    /// wins. MATERIAL is a catalogue name or the path of a material file
    #[arg(long, value_name = "SLOT=MATERIAL")]
    assign: Vec<Assignment>,
    /// A TOML file of lines "SLOT" = "MATERIAL"; --assign goes before it
    #[arg(long, value_name = "FILE")]
    assign_file: Option<PathBuf>,
}

/// One assignment as it was given.
#[derive(Clone, Debug)]
pub struct Assignment {
    /// The slot's pattern.
    pub slot: String,
    /// The material's name or path.
    pub material: String,
}

impl FromStr for Assignment {
    type Err = &'static str;

    /// Split at the last `=`: slot names may hold one.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.rsplit_once('=') {
            Some((slot, material)) if !slot.is_empty() && !material.is_empty() => {
                Ok(Self { slot: slot.to_owned(), material: material.to_owned() })
            }
            _ => Err("give a slot and a material as SLOT=MATERIAL"),
        }
    }
}

/// The materials in use, each once, and which one each slot takes.
#[derive(Debug)]
pub struct Assigned {
    /// The materials in the order of the slots.
    pub materials: Vec<Material>,
    /// Per slot an index into `materials`.
    pub by_slot: Vec<Option<usize>>,
}

impl AssignmentArguments {
    /// The materials for `slots`.
    ///
    /// # Errors
    ///
    /// A pattern without a slot, an unknown material, a file that is no assignment file.
    pub fn assigned(&self, slots: &[Slot]) -> Result<Assigned, Failure> {
        let mut assignments = match &self.assign_file {
            Some(path) => read(path)?,
            None => Vec::new(),
        };
        assignments.extend(self.assign.iter().cloned());
        let patterns: Vec<(Pattern, String)> =
            assignments.into_iter().map(|a| (Pattern::new(&a.slot), a.material)).collect();
        let names = resolve(slots, &patterns)?;
        let mut materials = Vec::new();
        let mut known = BTreeMap::new();
        let mut by_slot = Vec::new();
        for name in names {
            by_slot.push(match name {
                Some(name) if !known.contains_key(name) => {
                    materials.push(selection::material(name)?);
                    known.insert(name, materials.len() - 1);
                    Some(materials.len() - 1)
                }
                Some(name) => known.get(name).copied(),
                None => None,
            });
        }
        Ok(Assigned { materials, by_slot })
    }
}

/// The assignments of a file.
fn read(path: &Path) -> Result<Vec<Assignment>, Failure> {
    let text = fs::read_to_string(path)
        .map_err(|error| Failure::job(format!("cannot read {}: {error}", path.display())))?;
    parse(&text).map_err(|reason| {
        Failure::usage(format!("{}: {reason}", path.display()))
            .help("an assignment file has lines like \"Body\" = \"gold-paint\"")
    })
}

/// The assignments in a TOML text, in its order.
///
/// # Errors
///
/// Text that is no TOML, and values that are no strings.
pub fn parse(text: &str) -> Result<Vec<Assignment>, String> {
    let table: toml::Table = text.parse().map_err(|error: toml::de::Error| error.to_string())?;
    let assignment = |(slot, value): (String, toml::Value)| match value {
        toml::Value::String(material) => Ok(Assignment { slot, material }),
        other => Err(format!("slot {slot:?} has a {}, a material is a string", other.type_str())),
    };
    table.into_iter().map(assignment).collect()
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        match error {
            SceneError::NoSlot { .. } => {
                Self::usage(error).help("'sgdbake inspect SCENE' lists the slots of a scene")
            }
            SceneError::Kind(_) => Self::usage(error).help("name a .glb or .gltf to write"),
            _ => Self::job(error),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::*;

    #[test]
    fn slots_may_hold_an_equals_sign() {
        let Assignment { slot, material } = "a=b=gold-paint".parse().unwrap();
        assert_eq!((slot, material), ("a=b".into(), "gold-paint".into()));
        assert!("=x".parse::<Assignment>().is_err() && "x".parse::<Assignment>().is_err());
    }

    #[test]
    fn files_keep_their_order() {
        let text = "\"b*\" = 'chrome'\n\"#0\" = \"x\" # comment\n\"a\" = 'y'\n";
        let slots: Vec<_> = parse(text).unwrap().into_iter().map(|a| a.slot).collect();
        assert_eq!(slots, ["b*", "#0", "a"]);
        assert!(parse("a = 1").unwrap_err().contains("\"a\" has a integer"));
        assert!(parse("a").is_err());
    }
}
