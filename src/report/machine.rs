//! The machine that measurements were made on.

use serde::Serialize;

use crate::brdf::batch::InstructionSet;

/// The machine that a measured time depends on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Machine {
    /// The processor's name, where the system tells it.
    pub processor: String,
    /// The architecture, e.g. `x86_64`.
    pub architecture: &'static str,
    /// Hardware threads.
    pub threads: usize,
    /// The widest vector instructions in use.
    pub instructions: InstructionSet,
    /// True if the program checks its assertions while it runs, which costs time.
    pub assertions: bool,
}

impl Machine {
    /// This machine.
    #[must_use]
    pub fn this() -> Self {
        Self {
            processor: processor().unwrap_or_else(|| "unknown processor".to_owned()),
            architecture: std::env::consts::ARCH,
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            instructions: InstructionSet::widest(),
            assertions: cfg!(debug_assertions),
        }
    }

    /// The machine in one sentence.
    #[must_use]
    pub fn describe(&self) -> String {
        let build =
            if self.assertions { "built with assertions" } else { "built without assertions" };
        format!(
            "{}, {}, {} hardware threads, {}; {build}, measured on one thread",
            self.processor,
            self.architecture,
            self.threads,
            self.instructions.name()
        )
    }
}

/// The first `model name` of Linux's description of its processors.
fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}
