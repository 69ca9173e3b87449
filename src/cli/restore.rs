//! `sgdbake restore`: a scene with the extension rebuilt from the parameters in its extras.

use std::path::PathBuf;

use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::output::{Output, Writing};
use crate::cli::scene_file::{FileReport, print_files, read, write};
use crate::cli::selection::TextureArguments;
use crate::cli::terminal::name;
use sgdbake::asset::{Asset, EXTENSION, Extras, rebuild};
use sgdbake::encode::Format;
use sgdbake::scene::{Container, Export, Scene, Slot};

/// Rebuilds the extension and its textures from `extras.sgd`, where a tool dropped or broke them.
/// The glTF materials and everything else stay as the scene has them.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  sgdbake restore optimised.glb -o restored.glb
  sgdbake restore optimised.glb -o restored.glb --dry-run")]
pub struct Arguments {
    /// The scene: .gltf or .glb
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// The file to write: .glb, or .gltf with its buffer and textures in the same folder
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Take out the lookup textures of the extensions that are replaced
    #[arg(long)]
    prune: bool,
    #[command(flatten)]
    textures: TextureArguments,
    #[command(flatten)]
    writing: Writing,
    /// Machine-readable report
    #[arg(long)]
    json: bool,
}

/// The object that `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    schema: &'static str,
    dry_run: bool,
    materials: Vec<MaterialReport<'a>>,
    files: Vec<FileReport<'a>>,
    warnings: Vec<&'a str>,
}

/// A material of the scene.
#[derive(Serialize)]
struct MaterialReport<'a> {
    slot: String,
    index: usize,
    /// The measured material of its extras; without them it is left alone.
    restored: Option<&'a str>,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    // A wrong ending is refused before anything is baked.
    Container::of(&arguments.output)?;
    let scene = read(&arguments.scene, output)?;
    let (indices, extras) = found(&scene, arguments)?;
    let assets = rebuild(&extras, &arguments.textures.into(), Format::Exr)?;
    let restored: Vec<(usize, &Asset)> = indices.iter().copied().zip(&assets).collect();
    let slots = scene.slots();
    // Now, while the scene has no lookups but the old ones.
    let scene = match arguments.prune {
        true => scene.without_lookups(&indices.into_iter().collect())?,
        false => scene,
    };
    let export = scene.restored(&restored, &arguments.output)?;
    write(&arguments.output, &export.files, &[&arguments.scene], arguments.writing)?;
    for warning in &export.warnings {
        output.note(format_args!("warning: {warning}"));
    }
    report(arguments, &slots, &restored, &export, output)
}

/// The materials that have extras, and the extras.
fn found(scene: &Scene, arguments: &Arguments) -> Result<(Vec<usize>, Vec<Extras>), Failure> {
    let path = arguments.scene.display();
    let extras = scene.extras().map_err(|error| {
        Failure::job(format!("{path}: {error}"))
            .help("export the scene again, or take `sgd` out of that material's extras")
    })?;
    if extras.is_empty() {
        return Err(Failure::job(format!(
            "{path}: no material has extras.sgd, from which {EXTENSION} is rebuilt"
        ))
        .help(
            "some tools drop extras unless told to keep them, see docs/pipelines.md; else assign \
             the materials again with 'sgdbake export'",
        ));
    }
    Ok(extras.into_iter().unzip())
}

fn report(
    arguments: &Arguments,
    slots: &[Slot],
    restored: &[(usize, &Asset)],
    export: &Export,
    output: &mut Output,
) -> Result<(), Failure> {
    let materials = slots.iter().filter_map(|slot| {
        let index = slot.id.index()?;
        let restored = restored.iter().find(|(restored, _)| *restored == index);
        let restored = restored.map(|(_, asset)| &*asset.material.parameters.name);
        Some(MaterialReport { slot: slot.label(), index, restored })
    });
    let report = Report {
        schema: "sgdbake/restore/1",
        dry_run: arguments.writing.dry_run,
        materials: materials.collect(),
        files: FileReport::of(export),
        warnings: export.warnings.iter().map(String::as_str).collect(),
    };
    if arguments.json { output.json(&report) } else { print(&report, output) }
}

fn print(report: &Report<'_>, output: &mut Output) -> Result<(), Failure> {
    for material in &report.materials {
        let restored = match material.restored {
            Some(restored) => format!("restored {}", name(restored)),
            None => "left alone: no extras.sgd".into(),
        };
        output.line(format_args!("{}: {restored}", name(&material.slot)))?;
    }
    print_files(&report.files, report.dry_run, output)
}
