//! `sgdbake man`: manual pages, from the same definitions as the help.

use std::path::PathBuf;

use clap::CommandFactory as _;

use crate::cli::Cli;
use crate::cli::failure::Failure;
use crate::cli::output::{NewFile, Output, Writing};

/// Writes a manual page for sgdbake and one for each of its commands.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  sgdbake man -o ~/.local/share/man/man1")]
pub struct Arguments {
    /// The folder to write
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    writing: Writing,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let pages = pages()?.into_iter();
    let files: Vec<NewFile<'_>> =
        pages.map(|(name, page)| NewFile::of_bytes(arguments.output.join(name), page)).collect();
    arguments.writing.write_all(&files, &[])?;
    files.iter().try_for_each(|file| output.written(&file.path, arguments.writing))
}

/// The file name and the roff text of every page.
fn pages() -> Result<Vec<(String, Vec<u8>)>, Failure> {
    // `help` would become a page of its own.
    let mut root = Cli::command().disable_help_subcommand(true);
    // Gives the subcommands their full names and the global options.
    root.build();
    let commands: Vec<clap::Command> = root.get_subcommands().cloned().collect();
    std::iter::once(root)
        .chain(commands)
        .map(|command| {
            let page = clap_mangen::Man::new(command);
            let mut text = Vec::new();
            page.render(&mut text).map_err(Failure::job)?;
            Ok((page.get_filename(), text))
        })
        .collect()
}
