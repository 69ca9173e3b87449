//! `sgdbake speed-error`: every way to evaluate a material, timed and measured in one run.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::file_names::file_names;
use crate::cli::output::{NewFile, Output, Writing};
use crate::cli::selection::Materials;
use sgdbake::report::machine::Machine;
use sgdbake::report::pareto_front::RULE;
use sgdbake::report::speed_error::{Effort, SpeedError, speed_error};
use sgdbake::report::speed_error_page::{markdown, picture};

/// Measures nanoseconds per RGB evaluation, bytes, preparation and error of every method: the
/// formula, batches per instruction set, lookup tables and best fits; and marks the Pareto front.
///
/// Writes speed-error.json, speed-error.md and a picture per material. Times are of this machine
/// and of this run.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  sgdbake speed-error --material gold-paint -o report --quick")]
pub struct Arguments {
    #[command(flatten)]
    materials: Materials,
    /// The folder to write
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Fewer methods and rounds
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    writing: Writing,
    /// Machine-readable report on stdout too
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report {
    schema: &'static str,
    machine: Machine,
    front_rule: &'static str,
    materials: Vec<SpeedError>,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let materials = arguments.materials.load(output)?;
    let names = materials.iter().map(|material| material.name.as_str());
    let pictures = file_names(names, ["speed-error-", ".svg"], &[]);
    let files = [JSON, PAGE].into_iter().chain(pictures.iter().map(String::as_str));
    let paths: Vec<PathBuf> = files.map(|file| arguments.output.join(file)).collect();
    let inputs: Vec<&Path> = arguments.materials.inputs().collect();
    arguments.writing.check(paths.iter().map(PathBuf::as_path), &inputs)?;
    if arguments.writing.dry_run {
        return paths.iter().try_for_each(|path| output.written(path, arguments.writing));
    }
    let machine = Machine::this();
    if machine.assertions {
        output.note("this is a build with assertions: its times say little");
    }
    let effort = if arguments.quick { Effort::Quick } else { Effort::Full };
    let bar = output.progress(materials.len() as u64, "materials");
    let reports: Vec<SpeedError> = materials
        .iter()
        // One after the other: they are timed.
        .map(|material| speed_error(material, effort))
        .inspect(|_| bar.inc(1))
        .collect::<Result<_, _>>()
        .map_err(Failure::job)?;
    bar.finish_and_clear();
    let page = markdown(&reports, &machine, &pictures);
    let pictures: Vec<String> = reports.iter().map(picture).collect();
    let schema = "sgdbake/speed-error/1";
    let report = Report { schema, machine, front_rule: RULE, materials: reports };
    let json = serde_json::to_string_pretty(&report).map_err(Failure::job)?;
    let texts = [json + "\n", page].into_iter().chain(pictures);
    let new: Vec<NewFile<'_>> =
        paths.iter().zip(texts).map(|(path, text)| NewFile::of_bytes(path, text)).collect();
    arguments.writing.write_all(&new, &inputs)?;
    if arguments.json {
        return output.json(&report);
    }
    paths.iter().try_for_each(|path| output.written(path, arguments.writing))
}

/// The report for programs.
const JSON: &str = "speed-error.json";
/// The report for people.
const PAGE: &str = "speed-error.md";
