//! `sgdbake sheet`: one HTML page per material, and their index.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::cli::failure::Failure;
use crate::cli::output::{Output, Writing, refuse_foreign, write_file};
use crate::cli::preview::environment;
use crate::cli::selection::Materials;
use sgdbake::preview::Environment;
use sgdbake::report::sheet::{Page, page};
use sgdbake::report::sheet_page::index;

/// Writes the sheet of each material: parameters, pictures of the material and of its best fits
/// with the differences, lobes, distribution, Fresnel, masking, albedo and audit.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  sgdbake sheet --material alum-bronze --material chrome -o sheets"
)]
pub struct Arguments {
    #[command(flatten)]
    materials: Materials,
    /// The folder to write
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// An equirectangular .hdr or .exr image in place of the built-in lights
    #[arg(long, value_name = "FILE")]
    environment: Option<PathBuf>,
    #[command(flatten)]
    writing: Writing,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let materials = arguments.materials.load()?;
    let names = materials.iter().map(|material| material.name.as_str()).chain(["index"]);
    let paths: Vec<PathBuf> =
        names.map(|name| path(&arguments.output, name)).collect::<Result<_, _>>()?;
    paths.iter().try_for_each(|path| refuse_foreign(path, arguments.writing.force))?;
    if arguments.writing.dry_run {
        return paths.iter().try_for_each(|path| output.line(path.display()));
    }
    let environment =
        arguments.environment.as_deref().map_or_else(|| Ok(Environment::studio()), environment)?;
    let bar = output.progress(materials.len() as u64, "sheets");
    let pages: Vec<Page> = materials
        .par_iter()
        .map(|material| page(material, &environment))
        .inspect(|_| bar.inc(1))
        .collect::<Result<_, _>>()
        .map_err(Failure::job)?;
    bar.finish_and_clear();
    let index = index(&pages);
    let texts = pages.iter().map(|page| &page.html).chain([&index]);
    for (path, text) in paths.iter().zip(texts) {
        write_file(path, text.as_bytes(), arguments.writing.force)?;
        output.line(path.display())?;
    }
    Ok(())
}

/// Where a material's page goes; a name that is a path of its own goes nowhere.
fn path(folder: &Path, name: &str) -> Result<PathBuf, Failure> {
    if name.is_empty() || name.contains(['/', '\\', '\0']) || name.starts_with('.') {
        return Err(Failure::usage(format!("'{name}' cannot be the name of a page"))
            .help("give the material file a name without slashes"));
    }
    Ok(folder.join(format!("{name}.html")))
}
