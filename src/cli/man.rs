//! `sgdbake man`: manual pages, from the same definitions as the help.

use std::path::PathBuf;

use clap::CommandFactory as _;

use crate::cli::Cli;
use crate::cli::failure::Failure;
use crate::cli::output::{Output, Writing, refuse_foreign, write_file};

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
    for (name, page) in pages()? {
        let path = arguments.output.join(name);
        refuse_foreign(&path, arguments.writing.force)?;
        if !arguments.writing.dry_run {
            write_file(&path, &page, arguments.writing.force)?;
        }
        output.line(path.display())?;
    }
    Ok(())
}

/// The file name and the roff text of every page.
fn pages() -> Result<Vec<(String, Vec<u8>)>, Failure> {
    let mut root = Cli::command().disable_help_subcommand(true);
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
