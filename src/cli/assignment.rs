//! `SLOT=MATERIAL`: which material goes to which slot of a scene.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::cli::failure::Failure;
use crate::cli::input::read_text;
use crate::cli::output::Output;
use crate::cli::selection::{self, Chosen};
use sgdbake::scene::{Assignment, Pattern, SceneError, Slot, resolve};

/// The materials of slots.
#[derive(Debug, clap::Args)]
pub struct AssignmentArguments {
    /// A slot and its material. SLOT is a material name in the scene, a glob over names, '#N' for
    /// the N-th (from 0), '(none)' for primitives without a material, or '*' for all; the closest
    /// wins. MATERIAL is a catalogue name or the path of a material file
    #[arg(long, value_name = "SLOT=MATERIAL")]
    assign: Vec<Assignment>,
    /// A TOML file of lines "SLOT" = "MATERIAL", or - for stdin; --assign goes before it
    #[arg(long, value_name = "FILE")]
    assign_file: Option<PathBuf>,
}

/// The materials in use, each once, and which one each slot takes.
#[derive(Debug)]
pub struct Assigned {
    /// The materials in the order of the slots.
    pub materials: Vec<Chosen>,
    /// Per slot an index into `materials`.
    pub by_slot: Vec<Option<usize>>,
}

impl AssignmentArguments {
    /// The files that the assignments name.
    pub fn inputs(&self) -> impl Iterator<Item = &Path> {
        let materials = self.assign.iter().map(|assignment| Path::new(&assignment.material));
        self.assign_file.as_deref().into_iter().chain(materials)
    }

    /// The materials for `slots`.
    ///
    /// # Errors
    ///
    /// A pattern without a slot, an unknown material, an assignment file that cannot be read.
    pub fn assigned(&self, slots: &[Slot], output: &Output) -> Result<Assigned, Failure> {
        let mut assignments = match &self.assign_file {
            Some(path) => read(path)?,
            None => Vec::new(),
        };
        // Of equally close patterns the last wins: `--assign` overrules the file.
        assignments.extend(self.assign.iter().cloned());
        let patterns: Vec<(Pattern, String)> =
            assignments.into_iter().map(|a| (Pattern::new(&a.slot), a.material)).collect();
        let names = resolve(slots, &patterns)?;
        // Each name is loaded once, as a measurement would be fitted each time.
        let mut materials = Vec::new();
        let mut known = BTreeMap::new();
        let mut by_slot = Vec::new();
        for name in names {
            by_slot.push(match name {
                Some(name) if !known.contains_key(name) => {
                    materials.push(selection::chosen(name, output)?);
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
    let text = read_text(path)?;
    Assignment::parse_file(&text).map_err(|error| {
        Failure::usage(format!("{}: {error}", path.display()))
            .help("an assignment file has lines like \"Body\" = \"gold-paint\"")
    })
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
