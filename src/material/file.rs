//! Material files: TOML with a name and three channels.
//!
//! ```toml
//! name = "my-paint"
//! [r]                  # and [g], [b]
//! rho_d = 0.14
//! rho_s = 0.16
//! alpha = 0.12
//! p = 0.79
//! f0 = 9.2e-12
//! f1 = -0.6
//! lambda = 2.65        # masking fit: all three or none
//! c = 9.3e-8
//! k = 24.4
//! ```

use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::material::parameters::{
    Channel, ChannelParams, MaskingParams, Material, ParameterError,
};

/// The largest material file that is read; a real one has under 1 KiB.
const MOST_BYTES: u64 = 1 << 20;

/// Why a material file was refused.
#[derive(Debug, thiserror::Error)]
pub enum MaterialFileError {
    /// The file cannot be read.
    #[error("cannot read the material file {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file's content is not a material.
    #[error("{}:{line}: {problem}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// 1-based line of the problem.
        line: usize,
        /// What is wrong there.
        problem: Problem,
    },
}

/// What is wrong in a material file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Problem {
    /// Not TOML.
    #[error("not valid TOML: {0}")]
    Syntax(String),
    /// A key that no material has.
    #[error("unknown key '{key}'; accepted are {accepted}")]
    UnknownKey {
        /// The key, with its channel.
        key: String,
        /// Accepted keys.
        accepted: String,
    },
    /// A key that every material has is not there.
    #[error("the key '{0}' is missing")]
    MissingKey(String),
    /// A value of another type.
    #[error("'{key}' is {found}; accepted is {accepted}")]
    WrongType {
        /// The key.
        key: String,
        /// The type found.
        found: &'static str,
        /// The type accepted.
        accepted: &'static str,
    },
    /// A number outside its range.
    #[error("[{channel}] {error}", channel = channel.name())]
    OutOfRange {
        /// The channel it stands in.
        channel: Channel,
        /// The key, value and range.
        error: ParameterError,
    },
    /// The file is too large to be a material.
    #[error("{0} bytes are too many for a material file; accepted are up to 1 MiB")]
    TooLarge(u64),
}

/// A problem and the bytes of the text it concerns.
type Located = (Problem, Range<usize>);

const REQUIRED: [&str; 6] = ["rho_d", "rho_s", "alpha", "p", "f0", "f1"];
const MASKING: [&str; 3] = ["lambda", "c", "k"];

/// Reads a material file.
///
/// # Errors
///
/// The file, the line, what was found and what is accepted.
pub fn load(path: &Path) -> Result<Material, MaterialFileError> {
    let unreadable = |source| MaterialFileError::Unreadable { path: path.to_owned(), source };
    let size = std::fs::metadata(path).map_err(unreadable)?.len();
    if size > MOST_BYTES {
        let problem = Problem::TooLarge(size);
        return Err(MaterialFileError::Invalid { path: path.to_owned(), line: 1, problem });
    }
    let text = std::fs::read_to_string(path).map_err(unreadable)?;
    parse(&text, path)
}

/// Parses the text of a material file; `path` is what errors name.
///
/// # Errors
///
/// The line, what was found there and what is accepted.
pub fn parse(text: &str, path: &Path) -> Result<Material, MaterialFileError> {
    material(text).map_err(|(problem, span)| MaterialFileError::Invalid {
        path: path.to_owned(),
        line: text.as_bytes()[..span.start.min(text.len())].iter().filter(|b| **b == b'\n').count()
            + 1,
        problem,
    })
}

fn material(text: &str) -> Result<Material, Located> {
    let table = DeTable::parse(text).map_err(|error| {
        (Problem::Syntax(error.message().to_owned()), error.span().unwrap_or(0..0))
    })?;
    let file = Section { entries: table.get_ref(), name: "", span: 0..0 };
    file.refuse_all_but(&["name", "r", "g", "b"])?;
    let name = file.string("name")?;
    let [r, g, b] = Channel::ALL.map(|channel| params(&file.section(channel.name())?, channel));
    Ok(Material { name, channels: [r?, g?, b?] })
}

fn params(section: &Section<'_>, channel: Channel) -> Result<ChannelParams, Located> {
    section.refuse_all_but(&[&REQUIRED[..], &MASKING].concat())?;
    let number = |key| section.number(key);
    let fitted = MASKING.iter().any(|key| section.entries.contains_key(*key));
    let masking = || -> Result<_, Located> {
        Ok(MaskingParams { lambda: number("lambda")?, c: number("c")?, k: number("k")? })
    };
    let params = ChannelParams {
        masking: fitted.then(masking).transpose()?,
        rho_d: number("rho_d")?,
        rho_s: number("rho_s")?,
        alpha: number("alpha")?,
        p: number("p")?,
        f0: number("f0")?,
        f1: number("f1")?,
    };
    params.validate().map_err(|error| {
        let span = section.entries.get(error.key).map_or(section.span.clone(), Spanned::span);
        (Problem::OutOfRange { channel, error }, span)
    })?;
    Ok(params)
}

/// A table of the file, what it is called and where it stands.
struct Section<'t> {
    entries: &'t DeTable<'t>,
    /// Empty for the file itself.
    name: &'t str,
    span: Range<usize>,
}

impl<'t> Section<'t> {
    fn string(&self, key: &str) -> Result<String, Located> {
        self.value(key, "a string", |value| Some(value.get_ref().as_str()?.to_owned()))
    }

    fn number(&self, key: &str) -> Result<f64, Located> {
        self.value(key, "a number", |value| match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse().ok(),
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok(),
            _ => None,
        })
    }

    fn section(&self, name: &'t str) -> Result<Section<'t>, Located> {
        self.value(name, "a table", |value| {
            Some(Section { entries: value.get_ref().as_table()?, name, span: value.span() })
        })
    }

    /// What `read` makes of the value of a key.
    fn value<T>(
        &self,
        key: &str,
        accepted: &'static str,
        read: impl FnOnce(&'t Spanned<DeValue<'t>>) -> Option<T>,
    ) -> Result<T, Located> {
        let missing = || (Problem::MissingKey(self.dotted(key)), self.span.clone());
        let value = self.entries.get(key).ok_or_else(missing)?;
        read(value).ok_or_else(|| {
            let (key, found) = (self.dotted(key), value.get_ref().type_str());
            (Problem::WrongType { key, found, accepted }, value.span())
        })
    }

    fn refuse_all_but(&self, accepted: &[&str]) -> Result<(), Located> {
        let unknown = self.entries.keys().find(|key| !accepted.contains(&key.get_ref().as_ref()));
        unknown.map_or(Ok(()), |key| {
            let (key, span) = (self.dotted(key.get_ref()), key.span());
            Err((Problem::UnknownKey { key, accepted: accepted.join(", ") }, span))
        })
    }

    /// The key with its channel.
    fn dotted(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHANNELS: &str = "
[r]
rho_d = 0.14
rho_s = 0.16
alpha = 0.12
p = 0.79
f0 = 9.2e-12
f1 = -0.6
[g]
rho_d = 0
rho_s = 1
alpha = 0.1
p = 0
f0 = 0.1
f1 = 0
lambda = 2.65
c = 9.3e-8
k = 24.4
[b]
rho_d = 0.14
rho_s = 0.16
alpha = 0.12
p = 0.79
f0 = 9.2e-12
f1 = -0.6
";

    fn text() -> String {
        format!("name = \"my-paint\"{CHANNELS}")
    }

    fn refusal(text: &str) -> String {
        parse(text, Path::new("m.toml")).expect_err("must be refused").to_string()
    }

    #[test]
    fn a_full_file_parses() {
        let material = parse(&text(), Path::new("m.toml")).expect("valid");
        assert_eq!(material.name, "my-paint");
        assert_eq!(material.channels[0].masking, None);
        assert_eq!(material.channels[1].masking.expect("given").k, 24.4);
    }

    #[test]
    fn refusals_name_file_line_key_and_range() {
        let cases = [
            (
                "alpha = 0.1\n",
                "alpha = 0\n",
                "m.toml:12: [g] alpha = 0 is out of range: accepted is a finite number > 0",
            ),
            ("rho_s = 1\n", "rho_s = nan\n", "m.toml:11: [g] rho_s = NaN is out of range"),
            ("rho_s = 1\n", "rho_s = -inf\n", "m.toml:11: [g] rho_s = -inf is out of range"),
            ("p = 0\n", "p = -1\n", "m.toml:13: [g] p = -1 is out of range"),
            ("k = 24.4\n", "", "m.toml:9: the key 'g.k' is missing"),
            ("k = 24.4\n", "k = \"x\"\n", "m.toml:18: 'g.k' is string; accepted is a number"),
            ("k = 24.4\n", "kk = 1\nk = 24.4\n", "m.toml:18: unknown key 'g.kk'"),
            (
                "name = \"my-paint\"",
                "name = 3",
                "m.toml:1: 'name' is integer; accepted is a string",
            ),
            ("name = \"my-paint\"", "name = \"", "m.toml:1: not valid TOML"),
            ("[b]", "[bb]", "unknown key 'bb'"),
        ];
        for (from, to, expected) in cases {
            let message = refusal(&text().replacen(from, to, 1));
            assert!(message.starts_with(expected) || message.contains(expected), "{message}");
        }
    }
}
