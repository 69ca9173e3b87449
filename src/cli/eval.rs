//! `sgdbake eval`: f and its factors for pairs of directions.

use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Serialize;

use crate::cli::evaluator::{Evaluation, Evaluator};
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::selection::{self, Direction};
use sgdbake::brdf::Terms;
use sgdbake::material::Channel;

/// Evaluates the reflectance for pairs of directions, one result a line.
///
/// Directions are in the frame n = +z, wi towards the light, wo towards the viewer; they are
/// normalised. Below the horizon everything is 0.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  sgdbake eval --material gold-paint --wi 0.3,0,1 --wo=-0.3,0,1 --json"
)]
pub struct Arguments {
    /// A catalogue name or the path of a material file
    #[arg(long, value_name = "MATERIAL")]
    material: String,
    /// Direction to the light
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    wi: Option<Direction>,
    /// Direction to the viewer
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    wo: Option<Direction>,
    /// A CSV file with the header wi_x,wi_y,wi_z,wo_x,wo_y,wo_z
    #[arg(long, value_name = "FILE", conflicts_with_all = ["wi", "wo"])]
    pairs: Option<PathBuf>,
    #[command(flatten)]
    evaluation: Evaluation,
    /// Machine-readable output, one JSON object a line
    #[arg(long)]
    json: bool,
}

/// One pair's result.
#[derive(Serialize)]
struct Line {
    schema: &'static str,
    wi: [f64; 3],
    wo: [f64; 3],
    r: Terms,
    g: Terms,
    b: Terms,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let evaluator = arguments.evaluation.of(&selection::material(&arguments.material)?);
    match (arguments.wi, arguments.wo, &arguments.pairs) {
        (Some(wi), Some(wo), None) => print_pair(&evaluator, wi.0, wo.0, arguments.json, output),
        (_, _, Some(path)) => {
            each_pair(path, |wi, wo| print_pair(&evaluator, wi, wo, arguments.json, output))
        }
        (None, None, None) => Err(Failure::usage("no directions")
            .help("give --wi X,Y,Z and --wo X,Y,Z, or --pairs FILE.csv")),
        (None, _, None) => Err(Failure::usage("--wi is missing: a pair has two directions")),
        (_, None, None) => Err(Failure::usage("--wo is missing: a pair has two directions")),
    }
}

fn print_pair(
    evaluator: &Evaluator,
    wi: DVec3,
    wo: DVec3,
    json: bool,
    output: &mut Output,
) -> Result<(), Failure> {
    let [r, g, b] = evaluator.terms(wi, wo);
    if json {
        let (wi, wo) = (wi.to_array(), wo.to_array());
        return output.json(&Line { schema: "sgdbake/eval/1", wi, wo, r, g, b });
    }
    output.line(format!("wi {wi}  wo {wo}"))?;
    output.line("           ndf         g1_i         g1_o      fresnel     specular      diffuse         brdf")?;
    for (channel, terms) in Channel::ALL.into_iter().zip([r, g, b]) {
        let Terms { ndf, g1_i, g1_o, fresnel, specular, diffuse, brdf } = terms;
        let numbers = [ndf, g1_i, g1_o, fresnel, specular, diffuse, brdf];
        let columns = numbers.map(|n| format!("{n:>12.6e}")).join(" ");
        output.line(format!("{} {columns}", channel.name()))?;
    }
    Ok(())
}

const HEADER: &str = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z";

/// Calls `action` with every pair of a CSV file, reading one line at a time.
fn each_pair(
    path: &Path,
    mut action: impl FnMut(DVec3, DVec3) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let unreadable =
        |error: std::io::Error| Failure::job(format!("cannot read {}: {error}", path.display()));
    let file = File::open(path).map_err(unreadable)?;
    for (index, line) in BufReader::new(file).lines().enumerate() {
        let line = line.map_err(unreadable)?;
        let refusal =
            |what: String| Failure::usage(format!("{}:{}: {what}", path.display(), index + 1));
        if index == 0 {
            if line.trim_start_matches('\u{feff}').trim() != HEADER {
                return Err(refusal(format!("the header is '{line}'; accepted is '{HEADER}'")));
            }
        } else if !line.trim().is_empty() {
            let (wi, wo) = pair(&line).map_err(refusal)?;
            action(wi, wo)?;
        }
    }
    Ok(())
}

fn pair(line: &str) -> Result<(DVec3, DVec3), String> {
    let split = line.match_indices(',').nth(2).map(|(at, _)| at);
    let split = split.ok_or_else(|| format!("'{line}' is no pair: give six numbers {HEADER}"))?;
    let direction = |text: &str| {
        text.parse::<Direction>().map(|direction| direction.0).map_err(|error| error.to_string())
    };
    Ok((direction(&line[..split])?, direction(&line[split + 1..])?))
}
