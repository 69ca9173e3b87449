//! Refusals of material files: the file, the line, and what is wrong there.

use std::ops::Range;
use std::path::PathBuf;

use crate::material::lobe::MAX_LOBES;
use crate::material::range::ParameterError;

/// The refusal of a material file.
#[derive(Debug, thiserror::Error)]
pub enum MaterialFileError {
    /// The file cannot be read.
    #[error("cannot read the material file {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// The file's content is not a material.
    #[error("{}:{line}: {problem}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// 1-based line of the problem.
        line: usize,
        /// The problem.
        problem: Problem,
    },
}

/// Problems in a material file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Problem {
    /// Not TOML.
    #[error("not valid TOML: {0}")]
    Syntax(String),
    /// A key that no material has.
    #[error("unknown key `{key}`; use one of {accepted}")]
    UnknownKey {
        /// The key, with its channel.
        key: String,
        /// Accepted keys.
        accepted: String,
    },
    /// A key that every material has is not there.
    #[error(
        "`{0}` is missing. A material needs [r], [g] and [b], or rho_d = [r, g, b] and [[lobe]]; see docs/materials.md"
    )]
    MissingKey(String),
    /// The file mixes the two forms.
    #[error(
        "found `{0}` together with rho_d and [[lobe]]; use either [r], [g], [b] or rho_d and [[lobe]]"
    )]
    BothForms(String),
    /// The name is empty.
    #[error("`name` is empty; give the material a name")]
    EmptyName,
    /// More lobes than a material can have.
    #[error("found {0} [[lobe]] tables; a material has at most {MAX_LOBES}")]
    TooManyLobes(usize),
    /// A value of another type.
    #[error("`{key}` is of type {found}; it must be {accepted}")]
    WrongType {
        /// The key.
        key: String,
        /// The type found.
        found: &'static str,
        /// The type accepted.
        accepted: &'static str,
    },
    /// A number outside its range.
    #[error("{section}.{error}")]
    OutOfRange {
        /// The table it stands in: `r` or `lobe 1`.
        section: String,
        /// The key, value and range.
        error: ParameterError,
    },
    /// The file is too large to be a material.
    #[error("the file has {0} bytes; a material file has at most 1 MiB")]
    TooLarge(u64),
}

/// A problem and the bytes of the text it concerns.
pub type Located = (Problem, Range<usize>);
