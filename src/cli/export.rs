//! `sgdbake export`: a scene with best-fit glTF materials, the SGD parameters and the textures.

use std::fs;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde::Serialize;

use crate::cli::assignment::{Assigned, AssignmentArguments};
use crate::cli::evaluator::MaskingChoice;
use crate::cli::failure::Failure;
use crate::cli::output::{NewFile, Output, Writing};
use crate::cli::ownership::is_ours;
use crate::cli::selection::{Chosen, ExtentArguments, note_far_fits};
use crate::cli::terminal::name;
use sgdbake::asset::{Subject, build_with_progress};
use sgdbake::encode::Format;
use sgdbake::lut::{Depths, Quantity, Request};
use sgdbake::scene::{Container, Export, OutputFile, Scene, SceneError, Slot};

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
    /// The masking function to store
    #[arg(long, value_enum, default_value_t)]
    masking: MaskingChoice,
    #[command(flatten)]
    extent: ExtentArguments,
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

/// A written file.
#[derive(Serialize)]
pub struct FileReport<'a> {
    path: &'a Path,
    bytes: u64,
}

impl<'a> FileReport<'a> {
    /// The files of an export.
    pub fn of(export: &'a Export) -> Vec<Self> {
        let files = export.files.iter();
        files.map(|file| Self { path: &file.path, bytes: file.len() }).collect()
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    Container::of(&arguments.output)?;
    let scene = open(arguments, output)?;
    let slots = scene.slots();
    let assigned = arguments.assignments.assigned(&slots, output)?;
    let request = Request {
        quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
        masking: arguments.masking.into(),
        extent: arguments.extent.into(),
        depths: Depths::Smallest,
    };
    note_far_fits(assigned.materials.iter().map(|chosen| &chosen.material), output);
    let subjects: Vec<Subject<'_>> = assigned.materials.iter().map(Chosen::subject).collect();
    let assets = build_with_progress(&subjects, &request, Format::Exr, &|| ())?.assets;
    let pairs = slots.iter().zip(&assigned.by_slot);
    let replaced: Vec<_> = pairs.filter_map(|(slot, m)| Some((slot.id, &assets[(*m)?]))).collect();
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
        (None, Some(Shape::Ball) | None) => Ok(Scene::ball(BALL_ROWS)?),
    }
}

/// Reads a scene, with a progress bar.
pub fn read(path: &Path, output: &Output) -> Result<Scene, Failure> {
    let size = fs::metadata(path).map_or(0, |metadata| metadata.len());
    let bar = output.progress(size, "reading");
    let scene = Scene::open_with_progress(path, &mut |bytes| bar.set_position(bytes));
    bar.finish_and_clear();
    scene.map_err(|error| unreadable(path, error))
}

/// A scene that cannot be read, with its path.
pub fn unreadable(path: &Path, error: SceneError) -> Failure {
    let message = format!("{}: {error}", path.display());
    match error {
        SceneError::Kind(_) => Failure::usage(message).help("a scene is a .obj, .gltf or .glb"),
        SceneError::Uri { .. } | SceneError::Missing { .. } => {
            Failure::job(message).help("put the file into the scene's folder")
        }
        _ => Failure::job(message),
    }
}

/// The files to write: not those of the input that stand there already.
fn changed(files: &[OutputFile]) -> Vec<&OutputFile> {
    files.iter().filter(|file| !(file.copy && stands_already(file))).collect()
}

/// Returns whether the file is there with this content. Its size is compared first.
fn stands_already(file: &OutputFile) -> bool {
    let same_size =
        fs::metadata(&file.path).is_ok_and(|old| old.is_file() && old.len() == file.len());
    let mut bytes = Vec::new();
    same_size
        && file.write_to(&mut bytes).is_ok()
        && fs::read(&file.path).is_ok_and(|old| old == bytes)
}

/// Writes the files, the scene last: a reader that finds it finds everything. What belongs to a
/// scene that sgdbake wrote (the buffer has no mark of its own) it may write again.
pub fn write(
    scene: &Path,
    files: &[OutputFile],
    inputs: &[&Path],
    writing: Writing,
) -> Result<(), Failure> {
    let Writing { dry_run, force } = writing;
    let files = changed(files);
    let own_scene = scene.is_file() && is_ours(scene);
    let copies = files.iter().filter(|file| file.copy).map(|file| file.path.as_path());
    writing.check(copies, inputs)?;
    let new: Vec<NewFile<'_>> =
        files.iter().rev().map(|file| NewFile::new(&file.path, |out| file.write_to(out))).collect();
    Writing { dry_run, force: force || own_scene }.write_all(&new, inputs)
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

/// A line for each file that was written, or would be.
pub fn print_files(
    files: &[FileReport<'_>],
    dry_run: bool,
    output: &mut Output,
) -> Result<(), Failure> {
    let verb = if dry_run { "would write" } else { "wrote" };
    files.iter().try_for_each(|file| {
        output.line(format_args!("{verb} {} ({} bytes)", file.path.display(), file.bytes))
    })
}
