//! `sgdbake slice`: the factors D, Λ, G1 and F against one angle.

use serde::Serialize;

use crate::cli::evaluator::{Evaluation, Evaluator};
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::selection;
use sgdbake::brdf::Factors;
use sgdbake::material::Channel;

/// Prints the factors of the model against an angle: D and G1 at θ, the Fresnel factor at θd = θ.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  sgdbake slice --material chrome --theta-deg 0,1,20,70,89.99 --json"
)]
pub struct Arguments {
    /// A catalogue name or the path of a material file
    #[arg(long, value_name = "MATERIAL")]
    material: String,
    /// Angles in degrees, from 0 to 90
    #[arg(long, value_name = "LIST", value_delimiter = ',', required = true, value_parser = theta)]
    theta_deg: Vec<f64>,
    #[command(flatten)]
    evaluation: Evaluation,
    /// Machine-readable output, one JSON object a line
    #[arg(long)]
    json: bool,
}

/// One angle's result. Λ is null at 90°, where it is infinite.
#[derive(Serialize)]
struct Line {
    schema: &'static str,
    theta_deg: f64,
    r: Factors,
    g: Factors,
    b: Factors,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let evaluator = arguments.evaluation.of(&selection::material(&arguments.material)?);
    if !arguments.json {
        output.line("theta_deg channel          ndf       lambda           g1      fresnel")?;
    }
    arguments
        .theta_deg
        .iter()
        .try_for_each(|theta| print_angle(&evaluator, *theta, arguments.json, output))
}

fn print_angle(
    evaluator: &Evaluator,
    theta_deg: f64,
    json: bool,
    output: &mut Output,
) -> Result<(), Failure> {
    let [r, g, b] = evaluator.factors(theta_deg);
    if json {
        return output.json(&Line { schema: "sgdbake/slice/1", theta_deg, r, g, b });
    }
    for (channel, Factors { ndf, lambda, g1, fresnel }) in Channel::ALL.into_iter().zip([r, g, b]) {
        let columns = [ndf, lambda, g1, fresnel].map(|n| format!("{n:>12.6e}")).join(" ");
        output.line(format!("{theta_deg:>9} {:<7} {columns}", channel.name()))?;
    }
    Ok(())
}

fn theta(text: &str) -> Result<f64, String> {
    match text.trim().parse() {
        Ok(theta) if (0.0..=90.0).contains(&theta) => Ok(theta),
        _ => Err("accepted are angles from 0 to 90 degrees".to_owned()),
    }
}
