//! `sgdbake slice`: the factors D, Λ, G1 and F against one angle.

use serde::Serialize;

use crate::cli::evaluator::{Evaluation, Evaluator};
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::selection::Materials;
use crate::cli::terminal::name;
use sgdbake::brdf::Factors;
use sgdbake::material::Channel;

/// Prints the factors of the model against an angle: D and G1 at θ, the Fresnel factor at θd = θ.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  sgdbake slice --material chrome --theta-deg 0,1,20,70,89.99 --json"
)]
pub struct Arguments {
    #[command(flatten)]
    materials: Materials,
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
struct Line<'a> {
    schema: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    material: Option<&'a str>,
    theta_deg: f64,
    r: Factors,
    g: Factors,
    b: Factors,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let materials = arguments.materials.load()?;
    for material in &materials {
        let evaluator = arguments.evaluation.of(material);
        // One material needs no name, as the caller gave it.
        let material = (materials.len() > 1).then_some(material.name.as_str());
        if !arguments.json {
            material.map_or(Ok(()), |material| output.line(name(material)))?;
            output.line("theta_deg channel          ndf       lambda           g1      fresnel")?;
        }
        for theta in &arguments.theta_deg {
            print_angle(&evaluator, material, *theta, arguments.json, output)?;
        }
    }
    Ok(())
}

fn print_angle(
    evaluator: &Evaluator,
    material: Option<&str>,
    theta_deg: f64,
    json: bool,
    output: &mut Output,
) -> Result<(), Failure> {
    let [r, g, b] = evaluator.factors(theta_deg);
    if json {
        return output.json(&Line { schema: "sgdbake/slice/1", material, theta_deg, r, g, b });
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
        _ => Err("must be an angle from 0 to 90 degrees".to_owned()),
    }
}
