//! The command as a user runs it.

use std::process::{Command, Output};

/// Runs the command.
pub fn sgdbake(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sgdbake")).args(arguments).output().expect("the binary runs")
}

/// Runs a command that must end with exit code 0, and gives its stdout.
pub fn done(arguments: &[&str]) -> String {
    let output = sgdbake(arguments);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {message}");
    String::from_utf8(output.stdout).expect("stdout is text")
}
