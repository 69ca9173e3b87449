//! `sgdbake audit`: the model's laws, and what the published numbers do beyond them.

use rayon::prelude::*;
use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::measured;
use crate::cli::output::Output;
use crate::cli::selection::Subjects;
use sgdbake::report::audit::{Audit, audit};
use sgdbake::report::audit_page::markdown;
use sgdbake::report::measured::{MeasuredAudit, audit_measured};
use sgdbake::report::measured_page;

/// Checks the laws of the model for materials, and reports where their numbers gain energy, leave
/// [0, 1] or the range of half floats.
///
/// A law that is not kept is exit code 3; what a fit or a measurement breaks is a finding, and exit
/// code 0.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  sgdbake audit --material white-paint --json")]
pub struct Arguments {
    #[command(flatten)]
    subjects: Subjects,
    /// Machine-readable report
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report {
    schema: &'static str,
    materials: Vec<Audit>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    measurements: Vec<MeasuredAudit>,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let subjects = &arguments.subjects;
    let materials = subjects.materials(output)?;
    let bar = output.progress((materials.len() + subjects.measured.len()) as u64, "audit");
    let audits: Vec<Audit> = materials.par_iter().map(audit).inspect(|_| bar.inc(1)).collect();
    let measurements: Vec<MeasuredAudit> = subjects
        .measured
        .iter()
        // One after the other: each may take as much memory as two of its files.
        .map(|path| Ok(audit_measured(&measured::name(path), &measured::read(path)?)))
        .inspect(|_| bar.inc(1))
        .collect::<Result<_, Failure>>()?;
    bar.finish_and_clear();
    let broken = broken(&audits);
    if arguments.json {
        output.json(&Report { schema: "sgdbake/audit/1", materials: audits, measurements })?;
    } else {
        if !audits.is_empty() {
            output.line(markdown(&audits).trim_end())?;
        }
        if !measurements.is_empty() {
            output.line(measured_page::markdown(&measurements).trim_end())?;
        }
    }
    // The report goes out before the failure, as `main` flushes only after a success.
    output.finish()?;
    broken.map_or(Ok(()), |law| Err(Failure::check(law)))
}

/// The first law that is not kept, in words.
fn broken(audits: &[Audit]) -> Option<String> {
    audits.iter().find_map(|audit| {
        audit.channels.iter().find_map(|channel| {
            let check = channel.laws.iter().find(|check| !check.holds())?;
            Some(format!(
                "{} {}: {} is off by {:e}, more than the {:e} allowed",
                audit.material,
                channel.channel.name(),
                check.law.describe(),
                check.deviation,
                check.bound
            ))
        })
    })
}
