//! `sgdbake bake`: lookup textures and their manifest.

use std::path::PathBuf;

use rayon::prelude::*;
use serde::Serialize;

use crate::cli::dressing;
use crate::cli::failure::Failure;
use crate::cli::output::{Output, refuse_foreign, write_file};
use crate::cli::selection::{self, MaskingChoice};
use crate::encode::exr;
use crate::encode::manifest::{Format, Location, Manifest, TextureEntry};
use crate::lut::{self, BakeError, Depth, Extent, Quantity, Request, Table};
use crate::material::Material;

/// Bakes lookup textures of materials, with a manifest that tells how to decode them.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  sgdbake bake --material gold-paint --material chrome -o lut --size 256"
)]
pub struct Arguments {
    /// A catalogue name or the path of a material file
    #[arg(long, value_name = "MATERIAL", required = true)]
    material: Vec<String>,
    /// The folder to write
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// What to store
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "ndf,masking,fresnel")]
    quantity: Vec<Quantity>,
    /// The masking function to store
    #[arg(long, value_enum, default_value_t)]
    masking: MaskingChoice,
    /// Texels along each axis that is not a row
    #[arg(long, value_name = "N", default_value_t = 256)]
    size: usize,
    /// The texels' number format: half or float
    #[arg(long, default_value = "half")]
    depth: Depth,
    /// Say what would be written, and write nothing
    #[arg(long)]
    dry_run: bool,
    /// Overwrite files that sgdbake did not write
    #[arg(long)]
    force: bool,
    /// Machine-readable report
    #[arg(long)]
    json: bool,
}

/// A file of the bake.
struct File {
    path: PathBuf,
    bytes: Vec<u8>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    schema: &'static str,
    dry_run: bool,
    files: Vec<FileReport>,
}

#[derive(Serialize)]
struct FileReport {
    path: PathBuf,
    bytes: usize,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let materials: Vec<Material> = arguments
        .material
        .iter()
        .map(|name| selection::material(name))
        .collect::<Result<_, _>>()?;
    let request = Request {
        quantities: arguments.quantity.clone(),
        masking: arguments.masking.into(),
        extent: Extent::Size(arguments.size),
        depth: arguments.depth,
    };
    let files = files(arguments, &materials, &request)?;
    // All or nothing: what stands in the way is found before the first file is written.
    for file in &files {
        refuse_foreign(&file.path, arguments.force)?;
    }
    if !arguments.dry_run {
        for file in &files {
            write_file(&file.path, &file.bytes, arguments.force)?;
        }
    }
    report(arguments, &files, output)
}

/// The textures, and the manifest last: a reader that finds it finds everything.
fn files(
    arguments: &Arguments,
    materials: &[Material],
    request: &Request,
) -> Result<Vec<File>, Failure> {
    let baked = lut::bake(&materials.iter().collect::<Vec<_>>(), request)?;
    let mut files: Vec<File> = baked
        .tables
        .iter()
        .map(|table| {
            let name = file_name(table);
            File { bytes: exr::encode(table, &name), path: arguments.output.join(name) }
        })
        .collect();
    let entry =
        |table| TextureEntry::new(table, Format::Exr, Location::File { file: file_name(table) });
    let manifest = Manifest::new(
        materials.par_iter().zip(&baked.placed).map(|(m, p)| dressing::entry(m, p)).collect(),
        baked.tables.iter().map(entry).collect(),
        baked.left_out,
    );
    let mut bytes = serde_json::to_vec_pretty(&manifest).map_err(Failure::job)?;
    bytes.push(b'\n');
    files.push(File { path: arguments.output.join("manifest.json"), bytes });
    Ok(files)
}

fn file_name(table: &Table) -> String {
    format!("{}.exr", table.quantity.name())
}

fn report(arguments: &Arguments, files: &[File], output: &mut Output) -> Result<(), Failure> {
    if arguments.json {
        let files = files.iter();
        let files = files.map(|f| FileReport { path: f.path.clone(), bytes: f.bytes.len() });
        return output.json(&Report {
            schema: "sgdbake/bake/1",
            dry_run: arguments.dry_run,
            files: files.collect(),
        });
    }
    for file in files {
        let verb = if arguments.dry_run { "would write" } else { "wrote" };
        output.line(format!("{verb} {} ({} bytes)", file.path.display(), file.bytes.len()))?;
    }
    Ok(())
}

impl From<BakeError> for Failure {
    fn from(error: BakeError) -> Self {
        Self::usage(error)
    }
}
