//! `sgdbake sheet`: one HTML page per material, their index, and a page to look at them.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::cli::failure::Failure;
use crate::cli::file_names::file_names;
use crate::cli::measured;
use crate::cli::output::{NewFile, Output, Writing};
use crate::cli::preview::environment;
use crate::cli::selection::{Chosen, Subjects};
use crate::cli::view::{balls, editions};
use sgdbake::material::Material;
use sgdbake::preview::Environment;
use sgdbake::report::sheet::Sheet;
use sgdbake::report::sheet_page::{Page, index};
use sgdbake::report::view;

/// Writes the sheet of each material: parameters, pictures of the material and of its best fits
/// with the differences, lobes, distribution, Fresnel, masking, albedo and audit.
///
/// Of a measurement, every model is fitted to it and compared with it. The sheets link to
/// view.html, which shows the materials as 'sgdbake view' does.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  sgdbake sheet --material alum-bronze --material chrome -o sheets\n  sgdbake sheet --measured paint.binary -o sheets"
)]
pub struct Arguments {
    #[command(flatten)]
    subjects: Subjects,
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
    let materials = arguments.subjects.materials(output)?;
    let measured = arguments.subjects.measured.iter().map(|path| measured::name(path));
    let names: Vec<String> =
        materials.iter().map(|material| material.name.clone()).chain(measured).collect();
    let files = file_names(names.iter().map(String::as_str), ["", ".html"], &[INDEX, view::FILE]);
    let names = files.iter().map(String::as_str).chain([view::FILE, INDEX]);
    let paths: Vec<PathBuf> = names.map(|file| arguments.output.join(file)).collect();
    let inputs: Vec<&Path> =
        arguments.subjects.inputs().chain(arguments.environment.as_deref()).collect();
    arguments.writing.check(paths.iter().map(PathBuf::as_path), &inputs)?;
    if !arguments.writing.dry_run {
        write(arguments, &materials, &files, output)?;
    }
    paths.iter().try_for_each(|path| output.written(path, arguments.writing))
}

/// The page that links to the others.
const INDEX: &str = "index.html";

/// Writes each page as soon as it is finished, so that a run that is interrupted keeps it; the
/// index comes last.
fn write(
    arguments: &Arguments,
    materials: &[Material],
    files: &[String],
    output: &Output,
) -> Result<(), Failure> {
    let environment =
        arguments.environment.as_deref().map_or_else(|| Ok(Environment::studio()), environment)?;
    let bar = output.progress(files.len() as u64, "sheets");
    let (of_materials, of_measurements) = files.split_at(materials.len());
    let pages = materials.par_iter().zip(of_materials).map(|(material, file)| {
        let page = Page::of(&Sheet::new(material, &environment)).map_err(Failure::job)?;
        arguments.write_page(file, &page.html)?;
        bar.inc(1);
        Ok(page)
    });
    let mut pages: Vec<Page> = pages.collect::<Result<_, Failure>>()?;
    let mut shown: Vec<Chosen> =
        materials.iter().flat_map(|material| editions(material.clone().into())).collect();
    // One after the other: each may take as much memory as two of its files.
    for (path, file) in arguments.subjects.measured.iter().zip(of_measurements) {
        let (measurement, surface, fit) = measured::surface_and_fit(path)?;
        let measured = measurement.averaged();
        let sheet = Sheet::of_measurement(&fit.material, &measured, &surface, &environment);
        let page = Page::of(&sheet).map_err(Failure::job)?;
        arguments.write_page(file, &page.html)?;
        bar.inc(1);
        pages.push(page);
        shown.push(Chosen::fitted(path, &surface, fit));
    }
    bar.finish_and_clear();
    // A page shows one measurement at most, so it has the fits alone.
    let view = balls(&shown, None)?;
    let file = NewFile::new(arguments.output.join(view::FILE), |file| view.write_to(file));
    arguments.writing.write_all(&[file], &[])?;
    arguments.write_page(INDEX, &index(files.iter().map(String::as_str).zip(&pages)))
}

impl Arguments {
    fn write_page(&self, file: &str, html: &str) -> Result<(), Failure> {
        let file = NewFile::of_bytes(self.output.join(file), html);
        // `run` has checked every path against the inputs.
        self.writing.write_all(&[file], &[])
    }
}
