//! `sgdbake eval`: f and its factors for pairs of directions.

use std::fmt;
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Serialize;

use crate::cli::evaluator::{Evaluated, Evaluation, columns};
use crate::cli::failure::Failure;
use crate::cli::input::{self, next_line};
use crate::cli::output::Output;
use crate::cli::selection::{Direction, Materials};
use crate::cli::terminal::name;
use sgdbake::brdf::{LobeTerms, Terms};
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
    /// Only where there are several materials.
    #[serde(skip_serializing_if = "Option::is_none")]
    material: Option<&'a str>,
    wi: [f64; 3],
    wo: [f64; 3],
    r: ChannelTerms,
    g: ChannelTerms,
    b: ChannelTerms,
    /// Only for a material in which more than one lobe colours a channel.
    #[serde(skip_serializing_if = "Option::is_none")]
    lobes: Option<&'a [LobeTerms]>,
}

/// The terms of one channel.
#[derive(Serialize)]
struct ChannelTerms {
    /// Those of the lobe, where a single one colours the channel.
    #[serde(flatten)]
    factors: Option<LobeFactors>,
    specular: f64,
    diffuse: f64,
    brdf: f64,
}

/// The factors of a lobe in one colour.
#[derive(Clone, Copy, Serialize)]
struct LobeFactors {
    ndf: f64,
    g1_i: f64,
    g1_o: f64,
    fresnel: f64,
}

impl LobeFactors {
    fn of(terms: &LobeTerms, colour: usize) -> Self {
        let LobeTerms { ndf, g1_i, g1_o, fresnel } = *terms;
        Self { ndf, g1_i, g1_o, fresnel: fresnel[colour] }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let materials = arguments.materials.load(output)?;
    let evaluated = arguments.evaluation.of_all(&materials);
    match (arguments.wi, arguments.wo, &arguments.pairs) {
        (Some(wi), Some(wo), None) => print_pair(&evaluated, [wi.0, wo.0], arguments.json, output),
        // clap refuses --pairs together with --wi or --wo.
        (_, _, Some(path)) => {
            each_pair(path, |pair| print_pair(&evaluated, pair, arguments.json, output))
        }
        (None, None, None) => Err(Failure::usage("no directions")
            .help("give --wi X,Y,Z and --wo X,Y,Z, or --pairs FILE.csv")),
        (None, _, None) => Err(Failure::usage("--wi is missing; a pair has two directions")),
        (_, None, None) => Err(Failure::usage("--wo is missing; a pair has two directions")),
    }
}

/// The results of all materials for a pair.
fn print_pair(
    evaluated: &[Evaluated<'_>],
    pair: [DVec3; 2],
    json: bool,
    output: &mut Output,
) -> Result<(), Failure> {
    evaluated.iter().try_for_each(|evaluated| print(evaluated, pair, json, output))
}

fn print(
    Evaluated { material, name: named, evaluator }: &Evaluated<'_>,
    [wi, wo]: [DVec3; 2],
    json: bool,
    output: &mut Output,
) -> Result<(), Failure> {
    let terms = evaluator.terms(wi, wo);
    // The terms have room for the most lobes that a material may have.
    let lobes = &terms.lobes[..material.lobes().len()];
    let of_channel = material.channel_lobes();
    if json {
        let [r, g, b] = [0, 1, 2].map(|c| ChannelTerms {
            factors: of_channel.map(|of| LobeFactors::of(&lobes[of[c]], c)),
            specular: terms.specular[c],
            diffuse: terms.diffuse[c],
            brdf: terms.brdf[c],
        });
        let (wi, wo) = (wi.to_array(), wo.to_array());
        let lobes = of_channel.is_none().then_some(lobes);
        let (schema, material) = ("sgdbake/eval/1", *named);
        return output.json(&Line { schema, material, wi, wo, r, g, b, lobes });
    }
    let of = named.map_or(String::new(), |named| format!("{}  ", name(named)));
    output.line(format!("{of}wi {wi}  wo {wo}"))?;
    match of_channel {
        Some(of) => print_channels(&terms, of, output),
        None => print_lobes(&terms, lobes, output),
    }
}

/// A line for each channel, with the factors of its lobe.
fn print_channels(terms: &Terms, of: [usize; 3], output: &mut Output) -> Result<(), Failure> {
    output.line("           ndf         g1_i         g1_o      fresnel     specular      diffuse         brdf")?;
    for (c, channel) in Channel::ALL.into_iter().enumerate() {
        let LobeFactors { ndf, g1_i, g1_o, fresnel } = LobeFactors::of(&terms.lobes[of[c]], c);
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
    mut action: impl FnMut([DVec3; 2]) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut input = input::open(path)?;
    let mut line = String::new();
    for number in 1.. {
        // Line by line: a pipe of pairs may have no end.
        match next_line(&mut *input, &mut line, LONGEST_LINE) {
            Ok(true) => {}
            Ok(false) if number == 1 => return Err(refused(path, number, wrong_header(""))),
            Ok(false) => break,
            // Too long or not UTF-8: the fault of the line, which is named; others are of the disk.
            Err(error) if error.kind() == std::io::ErrorKind::InvalidData => {
                return Err(refused(path, number, error));
            }
            Err(error) => return Err(input::unreadable(path, &error)),
        }
        if number == 1 {
            // Spreadsheets put a byte order mark before the header.
            if line.trim_start_matches('\u{feff}').trim() != HEADER {
                return Err(refused(path, number, wrong_header(&line)));
            }
        } else if !line.trim().is_empty() {
            action(pair(&line).map_err(|error| refused(path, number, error))?)?;
        }
    }
    Ok(())
}

/// The failure of a line of a file.
fn refused(path: &Path, line: usize, what: impl fmt::Display) -> Failure {
    Failure::usage(format!("{}:{line}: {what}", path.display()))
}

fn wrong_header(line: &str) -> String {
    format!("the header is '{line}'; it must be '{HEADER}'")
}

fn pair(line: &str) -> Result<[DVec3; 2], String> {
    // At the third comma, so that each direction reports its own error.
    let split = line.match_indices(',').nth(2).map(|(at, _)| at);
    let split =
        split.ok_or_else(|| format!("'{line}' is not a pair; give six numbers {HEADER}"))?;
    Ok([direction(&line[..split])?, direction(&line[split + 1..])?])
}

/// The direction that three numbers name.
fn direction(text: &str) -> Result<DVec3, String> {
    text.parse::<Direction>().map(|direction| direction.0).map_err(|error| error.to_string())
}
