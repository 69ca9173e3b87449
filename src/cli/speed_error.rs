//! `sgdbake speed-error`: every way to evaluate a material, timed and measured in one run.

use std::path::PathBuf;

use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::output::{Output, Writing, refuse_foreign, write_file};
use crate::cli::selection::Materials;
use sgdbake::report::front::RULE;
use sgdbake::report::machine::Machine;
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
    let materials = arguments.materials.load()?;
    let names = materials.iter().map(|material| picture_name(&material.name));
    let names: Vec<String> = ["speed-error.json".to_owned(), "speed-error.md".to_owned()]
        .into_iter()
        .chain(names)
        .collect();
    let paths: Vec<PathBuf> = names.iter().map(|name| arguments.output.join(name)).collect();
    paths.iter().try_for_each(|path| refuse_foreign(path, arguments.writing.force))?;
    if arguments.writing.dry_run {
        return paths.iter().try_for_each(|path| output.line(path.display()));
    }
    let machine = Machine::this();
    if machine.assertions {
        output.note("this is a build with assertions: its times say little");
    }
    let effort = if arguments.quick { Effort::Quick } else { Effort::Full };
    let bar = output.progress(materials.len() as u64, "materials");
    let reports: Vec<SpeedError> = materials
        .iter()
        .map(|material| speed_error(material, effort))
        .inspect(|_| bar.inc(1))
        .collect::<Result<_, _>>()
        .map_err(Failure::job)?;
    bar.finish_and_clear();
    let page = markdown(&reports, &machine, picture_name);
    let pictures: Vec<String> = reports.iter().map(picture).collect();
    let schema = "sgdbake/speed-error/1";
    let report = Report { schema, machine, front_rule: RULE, materials: reports };
    let json = serde_json::to_string_pretty(&report).map_err(Failure::job)?;
    let texts = [json + "\n", page].into_iter().chain(pictures);
    for (path, text) in paths.iter().zip(texts) {
        write_file(path, text.as_bytes(), arguments.writing.force)?;
        if !arguments.json {
            output.line(path.display())?;
        }
    }
    if arguments.json { output.json(&report) } else { Ok(()) }
}

/// The file of a material's picture; letters, digits, dots, - and _ of its name remain.
fn picture_name(material: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    format!("speed-error-{}.svg", material.chars().map(plain).collect::<String>())
}
