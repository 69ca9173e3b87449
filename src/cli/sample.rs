//! `sgdbake sample`: the Monte Carlo albedo estimate beside the quadrature value.

use clap::ValueEnum;
use glam::DVec3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use serde::Serialize;

use crate::brdf::sampler::{Sampler, Strategy, published_sample};
use crate::brdf::{SgdBrdf, directional_albedo};
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::selection::{self, Direction};
use crate::material::{Channel, Material};
use crate::microfacet::masking::MaskingKind;

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
    /// A catalogue name or the path of a material file
    #[arg(long, value_name = "MATERIAL")]
    material: String,
    /// Direction to the viewer
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    wo: Direction,
    /// Number of samples
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
struct Report {
    schema: &'static str,
    material: String,
    wo: [f64; 3],
    n: u64,
    strategy: StrategyChoice,
    seed: u64,
    r: Estimate,
    g: Estimate,
    b: Estimate,
}

#[derive(Clone, Copy, Serialize)]
struct Estimate {
    mean: f64,
    standard_error: f64,
    quadrature: f64,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let material = selection::material(&arguments.material)?;
    let wo = arguments.wo.0;
    let brdf = SgdBrdf::new(&material, arguments.masking);
    let quadrature = directional_albedo(&brdf, wo.z);
    let sums =
        estimator(arguments, &material, &brdf, |draw| sums(draw, arguments.n, arguments.seed));
    let [r, g, b] = std::array::from_fn(|c| sums[c].estimate(arguments.n, quadrature[c]));
    if arguments.json {
        let Arguments { n, strategy, seed, .. } = *arguments;
        let material = material.name;
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

/// Runs `estimate` on the chosen strategy's draw: three uniform numbers to a value per channel.
fn estimator<T>(
    arguments: &Arguments,
    material: &Material,
    brdf: &SgdBrdf,
    estimate: impl Fn(&(dyn Fn([f64; 3]) -> [f64; 3] + Sync)) -> T,
) -> T {
    let wo: DVec3 = arguments.wo.0;
    let strategy = match arguments.strategy {
        StrategyChoice::Vndf => Strategy::Vndf,
        StrategyChoice::Ggx => Strategy::Ggx,
        StrategyChoice::Published => {
            let channels = brdf.channels.each_ref();
            return estimate(&move |u| channels.map(|c| published_sample(c, wo, u).printed));
        }
    };
    let sampler = Sampler::new(material, arguments.masking, strategy);
    estimate(&|u| sampler.sample_with_weight(wo, u).map_or([0.0; 3], |sample| sample.weight))
}

/// Running mean and sum of squared deviations of one channel's draws.
#[derive(Clone, Copy, Default)]
struct Moments {
    count: f64,
    mean: f64,
    squares: f64,
}

impl Moments {
    /// The moments of two sets of draws together (Chan, Golub and LeVeque 1983).
    fn with(self, other: Self) -> Self {
        let count = self.count + other.count;
        let difference = other.mean - self.mean;
        Self {
            count,
            mean: self.mean + difference * other.count / count,
            squares: self.squares
                + other.squares
                + difference * difference * self.count * other.count / count,
        }
    }

    fn estimate(self, n: u64, quadrature: f64) -> Estimate {
        let n = n as f64;
        let standard_error = (self.squares / (n - 1.0) / n).sqrt();
        Estimate { mean: self.mean, standard_error, quadrature }
    }
}

/// The moments of `n` draws. One stream of random numbers, cut at fixed places and summed in
/// order: the result does not depend on the number of threads.
fn sums(draw: &(dyn Fn([f64; 3]) -> [f64; 3] + Sync), n: u64, seed: u64) -> [Moments; 3] {
    const CHUNK: u64 = 1 << 14;
    /// Chunks in flight at once, so that memory does not grow with n.
    const ROUND: u64 = 256;
    let chunk = |index: u64| {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        rng.advance(3 * u128::from(index * CHUNK));
        let mut sums = [Moments::default(); 3];
        for _ in 0..CHUNK.min(n - index * CHUNK) {
            let values = draw(rng.random());
            sums = std::array::from_fn(|c| {
                sums[c].with(Moments { count: 1.0, mean: values[c], squares: 0.0 })
            });
        }
        sums
    };
    let chunks = n.div_ceil(CHUNK);
    let mut total = [Moments::default(); 3];
    for start in (0..chunks).step_by(ROUND as usize) {
        let round: Vec<[Moments; 3]> =
            (start..chunks.min(start + ROUND)).into_par_iter().map(chunk).collect();
        for sums in round {
            total = std::array::from_fn(|c| total[c].with(sums[c]));
        }
    }
    total
}
