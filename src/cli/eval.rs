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
use sgdbake::brdf::{LobeTerms, Terms};
use sgdbake::material::{Channel, Material};

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
struct Line<'a> {
    schema: &'static str,
    wi: [f64; 3],
    wo: [f64; 3],
    r: ChannelTerms,
    g: ChannelTerms,
    b: ChannelTerms,
    /// Of a material where more than one lobe colours a channel.
    #[serde(skip_serializing_if = "Option::is_none")]
    lobes: Option<&'a [LobeTerms]>,
}

/// The terms of one channel.
#[derive(Serialize)]
struct ChannelTerms {
    /// Of the lobe that alone colours the channel.
    #[serde(flatten)]
    factors: Option<Factors>,
    specular: f64,
    diffuse: f64,
    brdf: f64,
}

/// The factors of a lobe in one colour.
#[derive(Clone, Copy, Serialize)]
struct Factors {
    ndf: f64,
    g1_i: f64,
    g1_o: f64,
    fresnel: f64,
}

impl Factors {
    fn of(terms: &LobeTerms, colour: usize) -> Self {
        let LobeTerms { ndf, g1_i, g1_o, fresnel } = *terms;
        Self { ndf, g1_i, g1_o, fresnel: fresnel[colour] }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let material = selection::material(&arguments.material)?;
    let evaluator = arguments.evaluation.of(&material);
    let mut print = |wi, wo| print_pair(&material, &evaluator, [wi, wo], arguments.json, output);
    match (arguments.wi, arguments.wo, &arguments.pairs) {
        (Some(wi), Some(wo), None) => print(wi.0, wo.0),
        (_, _, Some(path)) => each_pair(path, print),
        (None, None, None) => Err(Failure::usage("no directions")
            .help("give --wi X,Y,Z and --wo X,Y,Z, or --pairs FILE.csv")),
        (None, _, None) => Err(Failure::usage("--wi is missing: a pair has two directions")),
        (_, None, None) => Err(Failure::usage("--wo is missing: a pair has two directions")),
    }
}

fn print_pair(
    material: &Material,
    evaluator: &Evaluator,
    [wi, wo]: [DVec3; 2],
    json: bool,
    output: &mut Output,
) -> Result<(), Failure> {
    let terms = evaluator.terms(wi, wo);
    let lobes = &terms.lobes[..material.lobes().len()];
    let of_channel = material.channel_lobes();
    if json {
        let factors = |c: usize| of_channel.map(|of| Factors::of(&lobes[of[c]], c));
        let [r, g, b] = [0, 1, 2].map(|c| ChannelTerms {
            factors: factors(c),
            specular: terms.specular[c],
            diffuse: terms.diffuse[c],
            brdf: terms.brdf[c],
        });
        let (wi, wo) = (wi.to_array(), wo.to_array());
        let lobes = of_channel.is_none().then_some(lobes);
        return output.json(&Line { schema: "sgdbake/eval/1", wi, wo, r, g, b, lobes });
    }
    output.line(format!("wi {wi}  wo {wo}"))?;
    match of_channel {
        Some(of) => print_channels(&terms, of, output),
        None => print_lobes(&terms, lobes, output),
    }
}

/// A line of numbers after a name.
fn columns(name: &str, numbers: &[f64]) -> String {
    numbers.iter().fold(name.to_owned(), |line, n| format!("{line} {n:>12.6e}"))
}

/// A line for each channel, with the factors of its lobe.
fn print_channels(terms: &Terms, of: [usize; 3], output: &mut Output) -> Result<(), Failure> {
    output.line("           ndf         g1_i         g1_o      fresnel     specular      diffuse         brdf")?;
    for (c, channel) in Channel::ALL.into_iter().enumerate() {
        let Factors { ndf, g1_i, g1_o, fresnel } = Factors::of(&terms.lobes[of[c]], c);
        let Terms { specular, diffuse, brdf, .. } = terms;
        let numbers = [ndf, g1_i, g1_o, fresnel, specular[c], diffuse[c], brdf[c]];
        output.line(columns(channel.name(), &numbers))?;
    }
    Ok(())
}

/// A line for each lobe, and one for each channel.
fn print_lobes(terms: &Terms, lobes: &[LobeTerms], output: &mut Output) -> Result<(), Failure> {
    output
        .line("           ndf         g1_i         g1_o    fresnel r    fresnel g    fresnel b")?;
    for (j, LobeTerms { ndf, g1_i, g1_o, fresnel: [r, g, b] }) in lobes.iter().enumerate() {
        output.line(columns(&(j + 1).to_string(), &[*ndf, *g1_i, *g1_o, *r, *g, *b]))?;
    }
    output.line("      specular      diffuse         brdf")?;
    for (c, channel) in Channel::ALL.into_iter().enumerate() {
        let numbers = [terms.specular[c], terms.diffuse[c], terms.brdf[c]];
        output.line(columns(channel.name(), &numbers))?;
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
                return Err(refusal(format!("found the header `{line}`; it must be `{HEADER}`")));
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
    let split = split.ok_or_else(|| format!("found `{line}`; a pair is six numbers {HEADER}"))?;
    let direction = |text: &str| {
        text.parse::<Direction>().map(|direction| direction.0).map_err(|error| error.to_string())
    };
    Ok((direction(&line[..split])?, direction(&line[split + 1..])?))
}
