//! The command line: arguments (raw) → request (checked) → one file per command. Only here does
//! anything print, pick paths or know of exit codes.

pub mod assignment;
pub mod failure;
pub mod inspect;
pub mod output;
pub mod ownership;
pub mod selection;
pub mod terminal;

mod audit;
mod bake;
mod completions;
mod eval;
mod evaluator;
mod export;
mod file_names;
mod fit;
mod input;
mod man;
mod materials;
mod measure;
mod measured;
mod model_fit;
mod preview;
mod restore;
mod sample;
mod scene_file;
mod sheet;
mod slice;
mod speed_error;
mod tabulate;
mod view;

use std::process::ExitCode;
#[cfg(unix)]
use std::sync::Arc;

use clap::{Parser, Subcommand};

pub use failure::Failure;
use output::Output;

/// Measured materials for engines: exact SGD evaluation, lookup textures, best fits and glTF
/// export, each with a stated error.
#[derive(Debug, Parser)]
#[command(name = "sgdbake", version, max_term_width = 100, after_help = EXIT_CODES)]
pub struct Cli {
    /// Threads to use, 1 to 512; all cores by default
    #[arg(
        long,
        global = true,
        value_name = "N",
        value_parser = clap::value_parser!(u16).range(1..=512),
        help_heading = "Global options"
    )]
    threads: Option<u16>,
    /// No progress bars and no notes on stderr
    #[arg(long, global = true, help_heading = "Global options")]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "\
Exit codes: 0 done; 1 the job failed (I/O, an invalid scene); 2 wrong usage; 3 a stated check or \
tolerance is not met.";

/// Every command; its own module holds its arguments and what it does.
#[derive(Debug, Subcommand)]
enum Command {
    /// The catalogue of measured materials, or one material's parameters
    Materials(materials::Arguments),
    /// The reflectance and its factors for pairs of directions
    Eval(eval::Arguments),
    /// The factors D, Λ, G1 and F against one angle
    Slice(slice::Arguments),
    /// The albedo, estimated by sampling and by quadrature
    Sample(sample::Arguments),
    /// A measurement as a material file: SGD lobes fitted to it, with the errors
    Measure(measure::Arguments),
    /// Lookup textures and the manifest that tells how to decode them
    Bake(bake::Arguments),
    /// The best Beckmann, GGX, few-lobe and glTF fits, with their errors
    Fit(fit::Arguments),
    /// A scene with measured materials in its slots: fitted, with parameters and textures
    Export(export::Arguments),
    /// The extension of an exported scene, rebuilt from its extras after a tool dropped it
    Restore(restore::Arguments),
    /// The contents of a scene, a manifest or a lookup texture
    Inspect(inspect::Arguments),
    /// An audit of materials: reciprocity, energy, Fresnel and half-float ranges
    Audit(audit::Arguments),
    /// A picture of a ball or a mesh
    Preview(preview::Arguments),
    /// The material sheet of the paper's supplement, as HTML
    Sheet(sheet::Arguments),
    /// A page to look at a scene or balls: exact beside glTF, in any browser, offline
    View(view::Arguments),
    /// A material or a measurement as a file of measured reflectance: MERL or RGL
    Tabulate(tabulate::Arguments),
    /// Speed against error of every way to evaluate a material
    SpeedError(speed_error::Arguments),
    /// Completions for a shell
    Completions(completions::Arguments),
    /// Manual pages
    Man(man::Arguments),
}

/// Parses the process's arguments, runs the command and reports its exit code.
#[must_use]
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    if let Some(threads) = cli.threads {
        // Fails only where a pool exists already, which nothing before this line builds.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
    }
    fail_at_size_limits();
    let mut output = Output::new(cli.quiet);
    let result = run(&cli.command, &mut output).and_then(|()| output.finish());
    result.map_or_else(Failure::report, |()| ExitCode::SUCCESS)
}

/// A file that would exceed the process's size limit is a failed write, which names the file, and
/// not the end of the process, which leaves half of it.
fn fail_at_size_limits() {
    #[cfg(unix)]
    {
        // Fails only for signals that no process may handle.
        // With any handler in place the write fails instead; nobody reads the flag.
        let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
    }
}

fn run(command: &Command, output: &mut Output) -> Result<(), Failure> {
    match command {
        Command::Materials(arguments) => materials::run(arguments, output),
        Command::Eval(arguments) => eval::run(arguments, output),
        Command::Slice(arguments) => slice::run(arguments, output),
        Command::Sample(arguments) => sample::run(arguments, output),
        Command::Measure(arguments) => measure::run(arguments, output),
        Command::Bake(arguments) => bake::run(arguments, output),
        Command::Fit(arguments) => fit::run(arguments, output),
        Command::Export(arguments) => export::run(arguments, output),
        Command::Restore(arguments) => restore::run(arguments, output),
        Command::Inspect(arguments) => inspect::run(arguments, output),
        Command::Audit(arguments) => audit::run(arguments, output),
        Command::Preview(arguments) => preview::run(arguments, output),
        Command::Sheet(arguments) => sheet::run(arguments, output),
        Command::View(arguments) => view::run(arguments, output),
        Command::Tabulate(arguments) => tabulate::run(arguments, output),
        Command::SpeedError(arguments) => speed_error::run(arguments, output),
        Command::Completions(arguments) => completions::run(arguments, output),
        Command::Man(arguments) => man::run(arguments, output),
    }
}
