//! Why a command ended without its result, and the exit code that says so.

use std::error::Error;
use std::fmt;
use std::io;
use std::process::ExitCode;

use crate::cli::terminal::printable;

/// The exit codes of the command line contract.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// The job failed: I/O, an invalid scene.
    Job = 1,
    /// Wrong usage: an unknown material or slot, a parameter out of range.
    Usage = 2,
    /// A stated check or tolerance is not met.
    Check = 3,
}

/// A command's failure.
#[derive(Debug)]
pub enum Failure {
    /// A failure to report to the user.
    Reported(Reported),
    /// The reader of stdout has gone; nothing to say to anybody.
    ClosedPipe,
}

/// A failure as the user sees it: what is wrong and what to do.
#[derive(Debug)]
pub struct Reported {
    exit: Exit,
    message: String,
    help: Option<String>,
}

impl Failure {
    /// A failure of the job (exit 1).
    pub fn job(error: impl fmt::Display) -> Self {
        Self::new(Exit::Job, error)
    }

    /// Wrong usage (exit 2).
    pub fn usage(error: impl fmt::Display) -> Self {
        Self::new(Exit::Usage, error)
    }

    /// A stated check or tolerance that is not met (exit 3).
    pub fn check(error: impl fmt::Display) -> Self {
        Self::new(Exit::Check, error)
    }

    fn new(exit: Exit, error: impl fmt::Display) -> Self {
        Self::Reported(Reported { exit, message: error.to_string(), help: None })
    }

    /// Adds what the user can do about it.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        if let Self::Reported(reported) = &mut self {
            reported.help = Some(help.into());
        }
        self
    }

    /// Prints the failure to stderr and gives its exit code.
    #[must_use]
    pub fn report(self) -> ExitCode {
        match self {
            // The reader, such as `head`, has what it wanted.
            Self::ClosedPipe => ExitCode::SUCCESS,
            Self::Reported(reported) => {
                let exit = ExitCode::from(reported.exit as u8);
                // One line a message, so that it can be searched; a second call changes nothing.
                let _ = miette::set_hook(Box::new(|_| {
                    Box::new(miette::MietteHandlerOpts::new().wrap_lines(false).build())
                }));
                // miette prints its report through `Debug`.
                eprintln!("{:?}", miette::Report::new(reported));
                exit
            }
        }
    }
}

/// A failure while writing to stdout: a closed pipe is not an error.
impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        if error.kind() == io::ErrorKind::BrokenPipe {
            Self::ClosedPipe
        } else {
            Self::job(format!("cannot write the result: {error}"))
        }
    }
}

impl fmt::Display for Reported {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&printable(&self.message))
    }
}

impl Error for Reported {}

impl miette::Diagnostic for Reported {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(printable(help)) as Box<dyn fmt::Display>)
    }
}
