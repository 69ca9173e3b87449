//! `sgdbake eval`: f and its factors for pairs of directions.

use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Serialize;

use crate::cli::evaluator::{Evaluation, Evaluator};
use crate::cli::failure::Failure;
use crate::cli::input::{self, next_line};
use crate::cli::output::Output;
use crate::cli::selection::{Direction, Materials};
use crate::cli::terminal::name;
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
    #[command(flatten)]
    materials: Materials,
    /// Direction to the light
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    wi: Option<Direction>,
    /// Direction to the viewer
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    wo: Option<Direction>,
    /// A CSV file with the header wi_x,wi_y,wi_z,wo_x,wo_y,wo_z; - for stdin
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
    /// Of several materials.
    #[serde(skip_serializing_if = "Option::is_none")]
    material: Option<&'a str>,
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
    let materials = arguments.materials.load(output)?;
    let evaluators: Vec<Evaluator> =
        materials.iter().map(|material| arguments.evaluation.of(material)).collect();
    // One material needs no name, as the caller gave it.
    let named = materials.len() > 1;
    let mut print = |wi, wo| {
        materials.iter().zip(&evaluators).try_for_each(|(material, evaluator)| {
            print_pair(material, named, evaluator, [wi, wo], arguments.json, output)
        })
    };
    match (arguments.wi, arguments.wo, &arguments.pairs) {
        (Some(wi), Some(wo), None) => print(wi.0, wo.0),
        (_, _, Some(path)) => each_pair(path, print),
        (None, None, None) => Err(Failure::usage("no directions")
            .help("give --wi X,Y,Z and --wo X,Y,Z, or --pairs FILE.csv")),
        (None, _, None) => Err(Failure::usage("--wi is missing; a pair has two directions")),
        (_, None, None) => Err(Failure::usage("--wo is missing; a pair has two directions")),
    }
}

fn print_pair(
    material: &Material,
    named: bool,
    evaluator: &Evaluator,
    [wi, wo]: [DVec3; 2],
    json: bool,
    output: &mut Output,
) -> Result<(), Failure> {
    let terms = evaluator.terms(wi, wo);
    let lobes = &terms.lobes[..material.lobes().len()];
    let of_channel = material.channel_lobes();
    if json {
        let [r, g, b] = [0, 1, 2].map(|c| ChannelTerms {
            factors: of_channel.map(|of| Factors::of(&lobes[of[c]], c)),
            specular: terms.specular[c],
            diffuse: terms.diffuse[c],
            brdf: terms.brdf[c],
        });
        let (wi, wo) = (wi.to_array(), wo.to_array());
        let lobes = of_channel.is_none().then_some(lobes);
        let material = named.then_some(material.name.as_str());
        return output.json(&Line { schema: "sgdbake/eval/1", material, wi, wo, r, g, b, lobes });
    }
    let of = if named { format!("{}  ", name(&material.name)) } else { String::new() };
    output.line(format!("{of}wi {wi}  wo {wo}"))?;
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

/// Bytes of a line: many times what six numbers take.
const LONGEST_LINE: usize = 4096;

/// Calls `action` with every pair of a CSV file, reading one line at a time.
fn each_pair(
    path: &Path,
    mut action: impl FnMut(DVec3, DVec3) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut input = input::open(path)?;
    let mut line = String::new();
    for number in 1.. {
        let refusal = |what: &dyn std::fmt::Display| {
            Failure::usage(format!("{}:{number}: {what}", path.display()))
        };
        match next_line(&mut *input, &mut line, LONGEST_LINE) {
            Ok(true) => {}
            Ok(false) if number == 1 => return Err(refusal(&wrong_header(""))),
            Ok(false) => break,
            Err(error) if error.kind() == std::io::ErrorKind::InvalidData => {
                return Err(refusal(&error));
            }
            Err(error) => {
                return Err(Failure::job(format!("cannot read {}: {error}", path.display())));
            }
        }
        if number == 1 {
            if line.trim_start_matches('\u{feff}').trim() != HEADER {
                return Err(refusal(&wrong_header(&line)));
            }
        } else if !line.trim().is_empty() {
            let (wi, wo) = pair(&line).map_err(|error| refusal(&error))?;
            action(wi, wo)?;
        }
    }
    Ok(())
}

fn wrong_header(line: &str) -> String {
    format!("the header is '{line}'; it must be '{HEADER}'")
}

fn pair(line: &str) -> Result<(DVec3, DVec3), String> {
    let split = line.match_indices(',').nth(2).map(|(at, _)| at);
    let split =
        split.ok_or_else(|| format!("'{line}' is not a pair; give six numbers {HEADER}"))?;
    Ok((direction(&line[..split])?, direction(&line[split + 1..])?))
}

/// The direction that three numbers name.
fn direction(text: &str) -> Result<DVec3, String> {
    text.parse::<Direction>().map(|direction| direction.0).map_err(|error| error.to_string())
}
