//! `sgdbake slice`: the factors D, Λ, G1 and F against one angle.

use serde::Serialize;

use crate::cli::evaluator::{Evaluation, Evaluator};
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::selection::Materials;
use crate::cli::terminal::name;
use sgdbake::brdf::LobeCurves;
use sgdbake::material::{Channel, Material};

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
    /// Of several materials.
    #[serde(skip_serializing_if = "Option::is_none")]
    material: Option<&'a str>,
    theta_deg: f64,
    #[serde(flatten)]
    channels: Option<Channels>,
    /// Of a material where more than one lobe colours a channel.
    #[serde(skip_serializing_if = "Option::is_none")]
    lobes: Option<&'a [LobeCurves]>,
}

/// The factors of the lobe that alone colours each channel.
#[derive(Clone, Copy, Serialize)]
struct Channels {
    r: Factors,
    g: Factors,
    b: Factors,
}

/// The factors of a lobe in one colour.
#[derive(Clone, Copy, Serialize)]
struct Factors {
    ndf: f64,
    lambda: f64,
    g1: f64,
    fresnel: f64,
}

impl Channels {
    fn of(lobes: &[LobeCurves], of_channel: [usize; 3]) -> Self {
        let [r, g, b] = [0, 1, 2].map(|c| {
            let LobeCurves { ndf, lambda, g1, fresnel } = lobes[of_channel[c]];
            Factors { ndf, lambda, g1, fresnel: fresnel[c] }
        });
        Self { r, g, b }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let materials = arguments.materials.load(output)?;
    // One material needs no name, as the caller gave it.
    let named = materials.len() > 1;
    materials.iter().try_for_each(|material| print(arguments, material, named, output))
}

fn print(
    arguments: &Arguments,
    material: &Material,
    named: bool,
    output: &mut Output,
) -> Result<(), Failure> {
    let evaluator = arguments.evaluation.of(material);
    if !arguments.json {
        if named {
            output.line(name(&material.name))?;
        }
        output.line(match material.channel_lobes() {
            Some(_) => "theta_deg channel          ndf       lambda           g1      fresnel",
            None => "theta_deg lobe             ndf       lambda           g1    fresnel r    fresnel g    fresnel b",
        })?;
    }
    arguments.theta_deg.iter().try_for_each(|theta| {
        print_angle(material, named, &evaluator, *theta, arguments.json, output)
    })
}

fn print_angle(
    material: &Material,
    named: bool,
    evaluator: &Evaluator,
    theta_deg: f64,
    json: bool,
    output: &mut Output,
) -> Result<(), Failure> {
    let lobes = evaluator.curves(theta_deg);
    let channels = material.channel_lobes().map(|of| Channels::of(&lobes, of));
    if json {
        let lobes = channels.is_none().then_some(&lobes[..]);
        let material = named.then_some(material.name.as_str());
        let schema = "sgdbake/slice/1";
        return output.json(&Line { schema, material, theta_deg, channels, lobes });
    }
    let mut line = |name: &str, numbers: &[f64]| {
        let columns: Vec<String> = numbers.iter().map(|n| format!("{n:>12.6e}")).collect();
        output.line(format!("{theta_deg:>9} {name:<7} {}", columns.join(" ")))
    };
    if let Some(Channels { r, g, b }) = channels {
        for (channel, Factors { ndf, lambda, g1, fresnel }) in
            Channel::ALL.into_iter().zip([r, g, b])
        {
            line(channel.name(), &[ndf, lambda, g1, fresnel])?;
        }
        return Ok(());
    }
    for (j, LobeCurves { ndf, lambda, g1, fresnel: [r, g, b] }) in lobes.iter().enumerate() {
        line(&(j + 1).to_string(), &[*ndf, *lambda, *g1, *r, *g, *b])?;
    }
    Ok(())
}

fn theta(text: &str) -> Result<f64, String> {
    match text.trim().parse() {
        Ok(theta) if (0.0..=90.0).contains(&theta) => Ok(theta),
        _ => Err("must be an angle from 0 to 90 degrees".to_owned()),
    }
}
