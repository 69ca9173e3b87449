//! `sgdbake materials`: the catalogue, or one material's table as the paper prints it.

use serde_json::{Map, Value, json};

use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::selection;
use sgdbake::material::{Channel, Material, catalog};
use sgdbake::report::number::six_digits;
use sgdbake::report::parameters::{COLUMNS, Row, rows};

/// Lists the measured materials, or prints one material's full table.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  sgdbake materials gold-paint")]
pub struct Arguments {
    /// A catalogue name or the path of a material file
    #[arg(
        value_name = "MATERIAL",
        value_parser = selection::MaterialParser,
        hide_possible_values = true
    )]
    name: Option<String>,
    /// Machine-readable output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    match &arguments.name {
        None => list(arguments.json, output),
        Some(name) => show(&selection::material(name)?, arguments.json, output),
    }
}

fn list(json: bool, output: &mut Output) -> Result<(), Failure> {
    let mut names = catalog().iter().map(|entry| entry.material.name.as_str());
    if json {
        let names: Vec<&str> = names.collect();
        return output.json(&json!({"schema": "sgdbake/materials/1", "materials": names}));
    }
    names.try_for_each(|name| output.line(name))
}

fn show(material: &Material, json: bool, output: &mut Output) -> Result<(), Failure> {
    let rows = rows(material);
    if json {
        return output.json(&table_json(&material.name, &rows));
    }
    output.line(&material.name)?;
    output.line(header())?;
    for (channel, row) in Channel::ALL.into_iter().zip(&rows) {
        output.line(table_line(channel, row))?;
    }
    Ok(())
}

fn header() -> String {
    COLUMNS.iter().fold(" ".to_owned(), |line, column| format!("{line} {column:>12}"))
}

fn table_line(channel: Channel, row: &Row) -> String {
    row.iter().fold(channel.name().to_owned(), |line, number| {
        format!("{line} {:>12}", number.map_or_else(|| "-".to_owned(), six_digits))
    })
}

fn table_json(name: &str, rows: &[Row; 3]) -> Value {
    let channels: Map<String, Value> = Channel::ALL
        .into_iter()
        .zip(rows)
        .map(|(channel, row)| (channel.name().to_owned(), row_json(row)))
        .collect();
    json!({"schema": "sgdbake/material/1", "name": name, "channels": channels})
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
