//! `sgdbake completions`: completions for a shell, from the same definitions as the help.

use clap::CommandFactory as _;
use clap_complete::Shell;

use crate::cli::Cli;
use crate::cli::failure::Failure;
use crate::cli::output::Output;

/// Prints the completions of a shell to stdout.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  sgdbake completions bash > ~/.local/share/bash-completion/completions/sgdbake"
)]
pub struct Arguments {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "sgdbake", &mut script);
    output.line(String::from_utf8_lossy(&script).trim_end())
}
