//! `sgdbake audit`: the model's laws, and what the published numbers do beyond them.

use rayon::prelude::*;
use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::selection::Materials;
use sgdbake::report::audit::{Audit, audit};
use sgdbake::report::audit_page::markdown;

/// Checks the laws of the model for materials, and reports where their numbers gain energy, leave
/// [0, 1] or the range of half floats.
///
/// A law that is not kept is exit code 3; what a fit breaks is a finding, and exit code 0.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  sgdbake audit --material white-paint --json")]
pub struct Arguments {
    #[command(flatten)]
    materials: Materials,
    /// Machine-readable report
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report {
    schema: &'static str,
    materials: Vec<Audit>,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let materials = arguments.materials.load()?;
    let bar = output.progress(materials.len() as u64, "materials");
    let audits: Vec<Audit> = materials.par_iter().map(audit).inspect(|_| bar.inc(1)).collect();
    bar.finish_and_clear();
    let broken = broken(&audits);
    if arguments.json {
        output.json(&Report { schema: "sgdbake/audit/1", materials: audits })?;
    } else {
        output.line(markdown(&audits).trim_end())?;
    }
    output.finish()?;
    broken.map_or(Ok(()), |law| Err(Failure::check(law)))
}

/// The first law that is not kept, in words.
fn broken(audits: &[Audit]) -> Option<String> {
    audits.iter().find_map(|audit| {
        audit.channels.iter().find_map(|channel| {
            let check = channel.laws.iter().find(|check| !check.holds())?;
            Some(format!(
                "{} {}: {} is off by {:e}; accepted is up to {:e}",
                audit.material,
                channel.channel.name(),
                check.law.describe(),
                check.deviation,
                check.bound
            ))
        })
    })
}
