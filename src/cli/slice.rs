//! `sgdbake slice`: the factors D, Λ, G1 and F against one angle.

use serde::Serialize;

use crate::cli::evaluator::{Evaluated, Evaluation, columns};
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::selection::Materials;
use crate::cli::terminal::name;
use sgdbake::brdf::LobeCurves;
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
    /// Only where there are several materials.
    #[serde(skip_serializing_if = "Option::is_none")]
    material: Option<&'a str>,
    theta_deg: f64,
    #[serde(flatten)]
    channels: Option<Channels>,
    /// Only for a material in which more than one lobe colours a channel.
    #[serde(skip_serializing_if = "Option::is_none")]
    lobes: Option<&'a [LobeCurves]>,
}

/// The factors of the lobe that alone colours each channel.
#[derive(Clone, Copy, Serialize)]
struct Channels {
    r: CurveFactors,
    g: CurveFactors,
    b: CurveFactors,
}

/// The factors of a lobe in one colour.
#[derive(Clone, Copy, Serialize)]
struct CurveFactors {
    ndf: f64,
    lambda: f64,
    g1: f64,
    fresnel: f64,
}

impl Channels {
    fn of(lobes: &[LobeCurves], of_channel: [usize; 3]) -> Self {
        let [r, g, b] = [0, 1, 2].map(|c| {
            let LobeCurves { ndf, lambda, g1, fresnel } = lobes[of_channel[c]];
            CurveFactors { ndf, lambda, g1, fresnel: fresnel[c] }
        });
        Self { r, g, b }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let materials = arguments.materials.load(output)?;
    let evaluated = arguments.evaluation.of_all(&materials);
    evaluated.iter().try_for_each(|evaluated| print(arguments, evaluated, output))
}

fn print(
    arguments: &Arguments,
    evaluated: &Evaluated<'_>,
    output: &mut Output,
) -> Result<(), Failure> {
    if !arguments.json {
        if let Some(named) = evaluated.name {
            output.line(name(named))?;
        }
        output.line(match evaluated.material.channel_lobes() {
            Some(_) => "theta_deg channel          ndf       lambda           g1      fresnel",
            None => "theta_deg lobe             ndf       lambda           g1    fresnel r    fresnel g    fresnel b",
        })?;
    }
    let angles = arguments.theta_deg.iter();
    angles.copied().try_for_each(|theta| print_angle(evaluated, theta, arguments.json, output))
}

fn print_angle(
    Evaluated { material, name, evaluator }: &Evaluated<'_>,
    theta_deg: f64,
    json: bool,
    output: &mut Output,
) -> Result<(), Failure> {
    let lobes = evaluator.curves(theta_deg);
    let channels = material.channel_lobes().map(|of| Channels::of(&lobes, of));
    if json {
        let lobes = channels.is_none().then_some(&lobes[..]);
        let (schema, material) = ("sgdbake/slice/1", *name);
        return output.json(&Line { schema, material, theta_deg, channels, lobes });
    }
    if let Some(Channels { r, g, b }) = channels {
        let channels = Channel::ALL.into_iter().zip([r, g, b]);
        for (channel, CurveFactors { ndf, lambda, g1, fresnel }) in channels {
            let start = format!("{theta_deg:>9} {:<7}", channel.name());
            output.line(columns(&start, &[ndf, lambda, g1, fresnel]))?;
        }
        return Ok(());
    }
    for (j, LobeCurves { ndf, lambda, g1, fresnel: [r, g, b] }) in lobes.iter().enumerate() {
        let start = format!("{theta_deg:>9} {:<7}", j + 1);
        output.line(columns(&start, &[*ndf, *lambda, *g1, *r, *g, *b]))?;
    }
    Ok(())
}

fn theta(text: &str) -> Result<f64, String> {
    match text.trim().parse() {
        Ok(theta) if (0.0..=90.0).contains(&theta) => Ok(theta),
        _ => Err("must be an angle from 0 to 90 degrees".to_owned()),
    }
}
