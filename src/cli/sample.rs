//! `sgdbake sample`: the albedo by Monte Carlo and by quadrature.

use clap::ValueEnum;
use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::selection::{Direction, Materials};
use crate::cli::terminal::name;
use sgdbake::brdf::MaskingKind;
use sgdbake::brdf::sampler::Strategy;
use sgdbake::material::{Channel, Material};
use sgdbake::report::estimate::{Estimate, Estimator, estimate};

/// Estimates the directional albedo ∫ f cosθi dωi by sampling, and prints it with its standard
/// error beside the value of a deterministic quadrature.
///
/// The strategy 'published' is the paper's own estimator, kept for comparison: its weight is
/// biased away from normal incidence.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  sgdbake sample --material gold-paint --wo 1,0,0.2 -n 100000 --seed 1 --json"
)]
pub struct Arguments {
    #[command(flatten)]
    materials: Materials,
    /// Direction to the viewer
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    wo: Direction,
    /// Number of samples, 2 to 1e12
    #[arg(short, value_name = "N", value_parser = clap::value_parser!(u64).range(2..=1_000_000_000_000))]
    n: u64,
    /// Where directions are drawn
    #[arg(long, value_enum, default_value_t)]
    strategy: StrategyChoice,
    /// The masking function
    #[arg(long, value_enum, default_value_t)]
    masking: MaskingKind,
    /// Start of the random numbers; equal seeds give equal results
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// Machine-readable output
    #[arg(long)]
    json: bool,
}

/// An estimator by its name on the command line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum StrategyChoice {
    /// Visible normals of the SGD distribution, exactly
    #[default]
    Vndf,
    /// Visible normals of the GGX lobe of least variance
    Ggx,
    /// The estimator printed in the paper's supplement, biased
    Published,
}

#[derive(Serialize)]
struct Report<'a> {
    schema: &'static str,
    material: &'a str,
    wo: [f64; 3],
    n: u64,
    strategy: StrategyChoice,
    seed: u64,
    r: Estimate,
    g: Estimate,
    b: Estimate,
}

impl From<StrategyChoice> for Estimator {
    fn from(choice: StrategyChoice) -> Self {
        match choice {
            StrategyChoice::Vndf => Self::Sampled(Strategy::Vndf),
            StrategyChoice::Ggx => Self::Sampled(Strategy::Ggx),
            StrategyChoice::Published => Self::Published,
        }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let materials = arguments.materials.load(output)?;
    let several = materials.len() > 1;
    materials.iter().try_for_each(|material| print(arguments, material, several, output))
}

fn print(
    arguments: &Arguments,
    material: &Material,
    named: bool,
    output: &mut Output,
) -> Result<(), Failure> {
    let Arguments { masking, n, strategy, seed, .. } = *arguments;
    let wo = arguments.wo.0;
    let [r, g, b] = estimate(material, masking, strategy.into(), wo, n, seed);
    if arguments.json {
        let material = &material.name;
        let schema = "sgdbake/sample/1";
        return output.json(&Report {
            schema,
            material,
            wo: wo.into(),
            n,
            strategy,
            seed,
            r,
            g,
            b,
        });
    }
    if named {
        output.line(name(&material.name))?;
    }
    output.line("channel         mean  standard_error   quadrature")?;
    for (channel, e) in Channel::ALL.into_iter().zip([r, g, b]) {
        let Estimate { mean, standard_error, quadrature } = e;
        output.line(format!(
            "{:<7} {mean:>12.6e} {standard_error:>15.3e} {quadrature:>12.6e}",
            channel.name()
        ))?;
    }
    Ok(())
}
