//! The `sgdbake` command: parse, run, exit code.

use std::process::ExitCode;

fn main() -> ExitCode {
    sgdbake::cli::main()
}
