//! `sgdbake bake`: lookup textures and their manifest.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use crate::cli::assignment::AssignmentArguments;
use crate::cli::failure::Failure;
use crate::cli::output::{NewFile, Output, Writing};
use crate::cli::scene_file::{FileReport, print_files, unreadable};
use crate::cli::selection::{self, Chosen, ExtentArguments};
use sgdbake::asset::{BuildError, Product, Subject, build_with_progress};
use sgdbake::brdf::MaskingKind;
use sgdbake::encode::{Format, shader};
use sgdbake::lut::{self, BakeError, Depth, Depths, Quantity, Request, Table};
use sgdbake::material::{Edition, Material, catalog};
use sgdbake::scene::Scene;

/// Bakes lookup textures of materials, with a manifest and shader functions that decode them.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  sgdbake bake --material gold-paint --material chrome -o lut --tolerance 1e-3
  sgdbake bake chair.glb --assign 'Legs=chrome' --assign 'Seat*=black-fabric' -o lut")]
pub struct Arguments {
    /// A scene: the materials assigned to slots that its meshes use are baked, and no others
    #[arg(value_name = "SCENE", required_unless_present_any = ["material", "all"])]
    scene: Option<PathBuf>,
    #[command(flatten)]
    assignments: AssignmentArguments,
    /// A catalogue name, or the path of a material file or of a measurement. Repeat for more
    #[arg(
        long,
        value_name = "MATERIAL",
        conflicts_with = "scene",
        value_parser = selection::MaterialParser,
        hide_possible_values = true
    )]
    material: Vec<String>,
    /// The whole catalogue
    #[arg(long, conflicts_with_all = ["scene", "material"])]
    all: bool,
    /// The edition of the catalogue that --all means
    #[arg(long, value_enum, default_value_t, requires = "all")]
    edition: selection::EditionChoice,
    /// The folder to write
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// The quantities to store, separated by commas
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "ndf,masking,fresnel",
        value_parser = selection::one_of::<Quantity>(Quantity::ALL.map(Quantity::name))
    )]
    quantity: Vec<Quantity>,
    /// The masking function to store
    #[arg(long, value_enum, default_value_t)]
    masking: MaskingKind,
    #[command(flatten)]
    extent: ExtentArguments,
    /// The file format; png holds 16-bit integers, and only masking, fresnel and albedo
    #[arg(
        long,
        default_value = "exr",
        value_parser = selection::one_of::<Format>(Format::ALL.map(Format::extension))
    )]
    format: Format,
    /// The texels' number format; by default the smallest that keeps the tolerance
    #[arg(long, value_parser = selection::one_of::<Depth>(["half", "float"]))]
    depth: Option<Depth>,
    /// Also bake all five quantities of the whole catalogue, and report the bytes that were saved;
    /// takes a while at small tolerances
    #[arg(long)]
    compare: bool,
    #[command(flatten)]
    writing: Writing,
    /// Machine-readable report
    #[arg(long)]
    json: bool,
}

/// A file of the bake.
struct File {
    path: PathBuf,
    bytes: Arc<[u8]>,
}

impl File {
    fn report(&self) -> FileReport<'_> {
        FileReport { path: &self.path, bytes: self.bytes.len() as u64 }
    }
}

/// The object that `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    schema: &'static str,
    dry_run: bool,
    files: Vec<FileReport<'a>>,
    texture_bytes: usize,
    #[serde(flatten)]
    catalogue: Option<Everything>,
    rows: usize,
    measured_error: Option<f64>,
    left_out: usize,
}

/// All quantities of the whole catalogue, at the same tolerance or size.
#[derive(Clone, Copy, Default, Serialize)]
struct Everything {
    #[serde(rename = "catalogue_texture_bytes")]
    texture_bytes: usize,
    /// The materials whose 3D table would be larger than any can be: their bytes are not counted.
    #[serde(rename = "catalogue_out_of_reach")]
    out_of_reach: usize,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let materials = materials(arguments, output)?;
    let request = request(arguments)?;
    let bar = output.progress(steps(arguments, &materials), "bake");
    selection::note_far_fits(materials.iter().map(|chosen| &chosen.material), output);
    let subjects: Vec<Subject<'_>> = materials.iter().map(Chosen::subject).collect();
    let product = build_with_progress(&subjects, &request, arguments.format, &|| bar.inc(1))
        .map_err(|error| refused(error, &request))?;
    let catalogue = arguments.compare.then(|| everything(&request, &|| bar.inc(1))).transpose()?;
    let files = files(arguments, &product);
    bar.finish_and_clear();
    let new: Vec<NewFile<'_>> =
        files.iter().map(|file| NewFile::of_bytes(&file.path, &file.bytes)).collect();
    arguments.writing.write_all(&new, &arguments.inputs())?;
    report(arguments, &files, &product, catalogue, output)
}

impl Arguments {
    /// The files that the command reads.
    fn inputs(&self) -> Vec<&Path> {
        let named = self.material.iter().map(Path::new);
        self.scene.as_deref().into_iter().chain(self.assignments.inputs()).chain(named).collect()
    }
}

/// The steps of a bake's progress: each material is sampled and fitted, and may get a 3D table;
/// to compare, each of the catalogue is sampled and gets a 3D table.
fn steps(arguments: &Arguments, materials: &[Chosen]) -> u64 {
    let tables = usize::from(arguments.quantity.contains(&Quantity::Brdf3d));
    let compared = if arguments.compare { 2 * catalog().len() } else { 0 };
    (materials.len() * (2 + tables) + compared) as u64
}

/// The materials asked for, or those that a scene's meshes use.
fn materials(arguments: &Arguments, output: &Output) -> Result<Vec<Chosen>, Failure> {
    if arguments.all {
        let edition = Edition::from(arguments.edition);
        return Ok(edition.materials().cloned().map(Chosen::from).collect());
    }
    let Some(path) = &arguments.scene else {
        return arguments.material.iter().map(|name| selection::chosen(name, output)).collect();
    };
    let scene = Scene::open(path).map_err(|error| unreadable(path, error))?;
    let slots = scene.slots();
    let assigned = arguments.assignments.assigned(&slots, output)?;
    let mut used: Vec<usize> = slots
        .iter()
        .zip(&assigned.by_slot)
        .filter(|(slot, _)| slot.used)
        .filter_map(|(_, material)| *material)
        .collect();
    // Several slots may share a material.
    used.sort_unstable();
    used.dedup();
    if used.is_empty() {
        return Err(Failure::usage("no material is assigned to a slot that a mesh uses")
            .help("assign one with --assign SLOT=MATERIAL; '*' stands for every slot"));
    }
    Ok(used.into_iter().map(|i| assigned.materials[i].clone()).collect())
}

fn request(arguments: &Arguments) -> Result<Request, Failure> {
    let depths = match (arguments.format, arguments.depth) {
        (Format::Png, None) => Depths::Only(Depth::Unorm16),
        (Format::Png, Some(_)) => {
            return Err(Failure::usage("a PNG holds 16-bit integers, neither half nor float")
                .help("leave out --depth, or choose --format exr or ktx2"));
        }
        (_, depth) => depth.map_or(Depths::Smallest, Depths::Only),
    };
    Ok(Request {
        quantities: arguments.quantity.clone(),
        masking: arguments.masking,
        extent: arguments.extent.into(),
        depths,
    })
}

/// Bakes every quantity of the whole catalogue for its bytes: the 3D tables one at a time, as
/// together they may not fit the memory.
fn everything(request: &Request, step: &(dyn Fn() + Sync)) -> Result<Everything, Failure> {
    let depths = match request.depths {
        // The integers of a PNG hold neither D nor the 3D table, which are baked here too.
        Depths::Only(Depth::Unorm16) => Depths::Smallest,
        depths => depths,
    };
    let (solid, flat) = Quantity::ALL.into_iter().partition(|q| *q == Quantity::Brdf3d);
    let flat = Request { quantities: flat, depths, ..request.clone() };
    let solid = Request { quantities: solid, ..flat.clone() };
    let all: Vec<&Material> = catalog().iter().map(|entry| &entry.material).collect();
    let texture_bytes = texel_bytes(&lut::bake_with_progress(&all, &flat, step)?.tables);
    let mut everything = Everything { texture_bytes, out_of_reach: 0 };
    for material in all {
        match lut::bake(&[material], &solid) {
            // Only the size is kept: the tables are dropped before the next are baked.
            Ok(baked) => everything.texture_bytes += texel_bytes(&baked.tables),
            Err(BakeError::NotReached { .. } | BakeError::Volume { .. }) => {
                everything.out_of_reach += 1;
            }
            Err(error) => return Err(error.into()),
        }
        step();
    }
    Ok(everything)
}

/// The textures and decoders, and the manifest last: a reader that finds it finds everything.
fn files(arguments: &Arguments, product: &Product) -> Vec<File> {
    let textures = product.textures.iter();
    let textures = textures.map(|texture| (texture.entry.file_name(), texture.bytes.clone()));
    let texts = [
        ("sgd_lut.glsl", shader::GLSL.to_owned()),
        ("sgd_lut.wgsl", shader::WGSL.to_owned()),
        ("manifest.json", product.manifest().to_text()),
    ];
    let texts = texts.map(|(name, text)| (name.to_owned(), Arc::from(text.into_bytes())));
    textures
        .chain(texts)
        .map(|(name, bytes)| File { path: arguments.output.join(name), bytes })
        .collect()
}

/// Bytes of the texels of some tables.
fn texel_bytes(tables: &[Table]) -> usize {
    tables.iter().map(Table::bytes).sum()
}

fn report(
    arguments: &Arguments,
    files: &[File],
    product: &Product,
    catalogue: Option<Everything>,
    output: &mut Output,
) -> Result<(), Failure> {
    let report = Report {
        schema: "sgdbake/bake/1",
        dry_run: arguments.writing.dry_run,
        files: files.iter().map(File::report).collect(),
        texture_bytes: product.textures.iter().map(|texture| texture.entry.texel_bytes()).sum(),
        catalogue,
        rows: rows(product),
        measured_error: product
            .textures
            .iter()
            .filter_map(|texture| texture.entry.error.measured)
            .reduce(f64::max),
        left_out: product.left_out.len(),
    };
    if arguments.json { output.json(&report) } else { print(&report, output) }
}

fn print(report: &Report<'_>, output: &mut Output) -> Result<(), Failure> {
    print_files(&report.files, report.dry_run, output)?;
    let Report { rows, texture_bytes, left_out, .. } = *report;
    output
        .line(format!("{rows} rows, {texture_bytes} bytes of texels, {left_out} lobes left out"))?;
    if let Some(error) = report.measured_error {
        output.line(format!("largest error of f measured: {error:.2e}"))?;
    }
    if let Some(Everything { texture_bytes: all, out_of_reach }) = report.catalogue {
        // Materials without a visible lobe have no texels at all.
        let share = all as f64 / texture_bytes.max(1) as f64;
        output.line(format!(
            "all five quantities of the whole catalogue: {all} bytes, {share:.1} times as many"
        ))?;
        if out_of_reach > 0 {
            output.line(format!(
                "not counted: 3D tables larger than any can be, of {out_of_reach} of its materials"
            ))?;
        }
    }
    Ok(())
}

/// The number of rows that the materials use.
fn rows(product: &Product) -> usize {
    // Rows count from 0; a material without a visible lobe has none.
    product.assets.iter().filter_map(|asset| asset.material.row).max().map_or(0, |row| row + 1)
}

/// The failure of a bake. Where only half floats are allowed, they may be why the tolerance is not
/// reached.
fn refused(error: BuildError, request: &Request) -> Failure {
    let half = request.depths == Depths::Only(Depth::Half);
    let not_reached = matches!(error, BuildError::Bake(BakeError::NotReached { .. }));
    let failure = Failure::from(error);
    if half && not_reached {
        return failure.help("accept a larger --tolerance, or allow --depth float");
    }
    failure
}

impl From<BuildError> for Failure {
    fn from(error: BuildError) -> Self {
        match error {
            BuildError::Bake(error) => error.into(),
            BuildError::Material(error) => Self::job(error),
            BuildError::Format(error) => Self::usage(error).help("choose --format exr"),
        }
    }
}

impl From<BakeError> for Failure {
    fn from(error: BakeError) -> Self {
        match error {
            BakeError::NotReached { .. } => Self::check(error).help("accept a larger --tolerance"),
            BakeError::Memory { .. } => Self::job(error)
                .help("choose a smaller --size, a larger --tolerance or fewer materials"),
            _ => Self::usage(error),
        }
    }
}
