//! `sgdbake export`: a scene with best-fit glTF materials, the SGD parameters and the textures.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde::Serialize;

use crate::cli::assignment::{Assigned, AssignmentArguments};
use crate::cli::failure::Failure;
use crate::cli::output::{Output, Writing};
use crate::cli::scene_file::{FileReport, print_files, read, write};
use crate::cli::selection::{Chosen, TextureArguments, note_far_fits};
use crate::cli::terminal::name;
use sgdbake::asset::{Subject, build_with_progress};
use sgdbake::encode::Format;
use sgdbake::scene::{Container, Export, Scene, Slot};

/// Puts measured materials into the slots of a scene. Everything that is not an assigned material
/// comes out as it came in.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  sgdbake export --shape ball -o ball.glb --assign '*=gold-paint'
  sgdbake export chair.glb -o out.glb --assign 'Legs=chrome' --assign 'Seat*=black-fabric'
  sgdbake export teapot.obj -o teapot.gltf --assign '(none)=alum-bronze'")]
pub struct Arguments {
    /// The scene: .obj, .gltf or .glb
    #[arg(value_name = "SCENE", required_unless_present = "shape")]
    scene: Option<PathBuf>,
    /// A built-in shape in place of a scene
    #[arg(long, value_enum, conflicts_with = "scene")]
    shape: Option<Shape>,
    /// The file to write: .glb, or .gltf with its buffer and textures in the same folder
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    #[command(flatten)]
    assignments: AssignmentArguments,
    /// Take out the images that only replaced materials showed
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

/// A built-in shape.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Shape {
    /// A unit sphere with one slot, `ball`
    Ball,
}

/// Rows of quads on the built-in ball.
const BALL_ROWS: u16 = 64;

/// The object that `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    schema: &'static str,
    dry_run: bool,
    slots: Vec<SlotReport<'a>>,
    files: Vec<FileReport<'a>>,
    warnings: Vec<&'a str>,
}

/// A slot and what is assigned to it.
#[derive(Serialize)]
struct SlotReport<'a> {
    slot: String,
    index: Option<usize>,
    meshes: &'a [String],
    triangles: u64,
    used: bool,
    material: Option<&'a str>,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    // A wrong ending is refused before anything is baked.
    Container::of(&arguments.output)?;
    let scene = open(arguments, output)?;
    let slots = scene.slots();
    let assigned = arguments.assignments.assigned(&slots, output)?;
    note_far_fits(assigned.materials.iter().map(|chosen| &chosen.material), output);
    let subjects: Vec<Subject<'_>> = assigned.materials.iter().map(Chosen::subject).collect();
    let assets =
        build_with_progress(&subjects, &arguments.textures.into(), Format::Exr, &|| ())?.assets;
    let pairs = slots.iter().zip(&assigned.by_slot);
    let replaced: Vec<_> = pairs.filter_map(|(slot, m)| Some((slot.id, &assets[(*m)?]))).collect();
    // Before the export, while the old materials still say which images they show.
    let scene = if arguments.prune { scene.pruned(&replaced)? } else { scene };
    let export = scene.export(&replaced, &arguments.output)?;
    let inputs: Vec<&Path> =
        arguments.scene.as_deref().into_iter().chain(arguments.assignments.inputs()).collect();
    write(&arguments.output, &export.files, &inputs, arguments.writing)?;
    for warning in scene.warnings().iter().chain(&export.warnings) {
        output.note(format_args!("warning: {warning}"));
    }
    report(arguments, &scene, &slots, &assigned, &export, output)
}

fn open(arguments: &Arguments, output: &Output) -> Result<Scene, Failure> {
    match (&arguments.scene, arguments.shape) {
        (Some(path), _) => read(path, output),
        // clap asks for a scene or a shape, so one of them is there.
        (None, Some(Shape::Ball) | None) => Ok(Scene::ball(BALL_ROWS)?),
    }
}

fn report(
    arguments: &Arguments,
    scene: &Scene,
    slots: &[Slot],
    assigned: &Assigned,
    export: &Export,
    output: &mut Output,
) -> Result<(), Failure> {
    let slot_reports = slots.iter().enumerate().map(|(i, slot)| SlotReport {
        slot: slot.label(),
        index: slot.id.index(),
        meshes: &slot.meshes,
        triangles: slot.triangles,
        used: slot.used,
        material: assigned.by_slot[i].map(|chosen| &*assigned.materials[chosen].material.name),
    });
    let warnings = scene.warnings().iter().chain(&export.warnings).map(String::as_str);
    let report = Report {
        schema: "sgdbake/export/1",
        dry_run: arguments.writing.dry_run,
        slots: slot_reports.collect(),
        files: FileReport::of(export),
        warnings: warnings.collect(),
    };
    if arguments.json { output.json(&report) } else { print(&report, output) }
}

fn print(report: &Report<'_>, output: &mut Output) -> Result<(), Failure> {
    for slot in &report.slots {
        let material = slot.material.unwrap_or("stays as it is");
        let meshes = if slot.used { slot.meshes.join(", ") } else { "unused".into() };
        output.line(format_args!(
            "{}: {} ({} triangles; {})",
            name(&slot.slot),
            name(material),
            slot.triangles,
            name(&meshes)
        ))?;
    }
    print_files(&report.files, report.dry_run, output)
}
