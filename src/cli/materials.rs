//! `sgdbake materials`: the catalogue, or one material's table as the paper prints it.

use serde_json::{Map, Value, json};

use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::selection;
use sgdbake::asset::{Parameters, stated_error};
use sgdbake::lut::row::with_masking_fits;
use sgdbake::material::{Edition, Material, find, refit_of};
use sgdbake::report::number::six_digits;
use sgdbake::report::parameters::{COLUMNS, Row, rows};

/// Lists the measured materials, or prints one material's full table.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  sgdbake materials gold-paint")]
pub struct Arguments {
    /// A catalogue name, or the path of a material file or of a measurement
    #[arg(
        value_name = "MATERIAL",
        value_parser = selection::MaterialParser,
        hide_possible_values = true
    )]
    name: Option<String>,
    /// The edition of the catalogue to list
    #[arg(long, value_enum, default_value_t, conflicts_with = "name")]
    edition: selection::EditionChoice,
    /// Machine-readable output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    match &arguments.name {
        None => list(arguments.edition.into(), arguments.json, output),
        Some(name) => show(&selection::material(name, output)?, arguments.json, output),
    }
}

fn list(edition: Edition, json: bool, output: &mut Output) -> Result<(), Failure> {
    let mut names = edition.materials().map(|material| material.name.as_str());
    if json {
        let names: Vec<&str> = names.collect();
        return output.json(&json!({"schema": "sgdbake/materials/1", "materials": names}));
    }
    names.try_for_each(|name| output.line(name))
}

/// A material's table, and after a published one that of its refit.
fn show(material: &Material, json: bool, output: &mut Output) -> Result<(), Failure> {
    if json {
        return output.json(&table_json(material, &rows(material)));
    }
    table(material, output)?;
    // A material file may bear a catalogue name with other parameters.
    let published = find(&material.name).is_ok_and(|entry| entry.material == *material);
    match refit_of(&material.name).filter(|_| published) {
        Some(refit) => {
            output.line("")?;
            table(&refit.material, output)
        }
        None => Ok(()),
    }
}

/// The table of one material under its name and its distance from the surface.
fn table(material: &Material, output: &mut Output) -> Result<(), Failure> {
    let rows = rows(material);
    match stated_error(material) {
        Some(error) => output.line(format_args!(
            "{}, mean ΔE2000 to the measured surface {:.2}",
            material.name, error.delta_e
        ))?,
        None => output.line(&material.name)?,
    }
    output.line(header(&rows))?;
    rows.iter().try_for_each(|(name, row)| output.line(table_line(name, row)))
}

/// The width of the longest name of a row.
fn name_width(rows: &[(String, Row)]) -> usize {
    rows.iter().map(|(name, _)| name.len()).max().unwrap_or(1)
}

fn header(rows: &[(String, Row)]) -> String {
    let corner = " ".repeat(name_width(rows));
    COLUMNS.iter().fold(corner, |line, column| format!("{line} {column:>12}"))
}

fn table_line(name: &str, row: &Row) -> String {
    row.iter().fold(name.to_owned(), |line, number| {
        format!("{line} {:>12}", number.map_or_else(|| "-".to_owned(), six_digits))
    })
}

fn table_json(material: &Material, rows: &[(String, Row)]) -> Value {
    let name = &material.name;
    // The form of the paper: a lobe for each channel.
    if material.channel_lobes().is_some() {
        let channels: Map<String, Value> =
            rows.iter().map(|(channel, row)| (channel.clone(), row_json(row))).collect();
        return json!({"schema": "sgdbake/material/1", "name": name, "channels": channels});
    }
    let parameters = Parameters::of(&with_masking_fits(material));
    let Parameters { name, diffuse, lobes } = parameters;
    json!({"schema": "sgdbake/material/1", "name": name, "diffuse": diffuse, "lobes": lobes})
}

/// Keys as in a material file, and what follows from them: `K`, `theta0`, `error`.
fn row_json(row: &Row) -> Value {
    let keys = COLUMNS.map(|column| match column {
        "F0" => "f0",
        "F1" => "f1",
        other => other,
    });
    Value::Object(keys.into_iter().zip(row).map(|(key, n)| (key.to_owned(), json!(n))).collect())
}
