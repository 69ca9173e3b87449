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
    let table = table.get_ref();
    refuse_unknown_keys(table, "", &["name", "r", "g", "b"])?;
    let name = match entry(table, "name", 0..0, "")? {
        (DeValue::String(name), _) => name.clone().into_owned(),
        (other, span) => return Err(wrong_type("name", other, "a string", span)),
    };
    let [r, g, b] = Channel::ALL.map(|channel| parse_channel(table, channel));
    Ok(Material { name, channels: [r?, g?, b?] })
}

fn parse_channel(table: &DeTable<'_>, channel: Channel) -> Result<ChannelParams, Located> {
    let name = channel.name();
    let (DeValue::Table(keys), span) = entry(table, name, 0..0, "")? else {
        let (other, span) = entry(table, name, 0..0, "")?;
        return Err(wrong_type(name, other, "a table", span));
    };
    let accepted: Vec<&str> = REQUIRED.into_iter().chain(MASKING).collect();
    refuse_unknown_keys(keys, &format!("{name}."), &accepted)?;
    let number = |key: &'static str| number(keys, key, span.clone(), name);
    let masking = if MASKING.iter().any(|key| keys.get(*key).is_some()) {
        Some(MaskingParams { lambda: number("lambda")?, c: number("c")?, k: number("k")? })
    } else {
        None
    };
    let params = ChannelParams {
        rho_d: number("rho_d")?,
        rho_s: number("rho_s")?,
        alpha: number("alpha")?,
        p: number("p")?,
        f0: number("f0")?,
        f1: number("f1")?,
        masking,
    };
    params.validate().map_err(|error| {
        let span = keys.get(error.key).map_or(span.clone(), Spanned::span);
        (Problem::OutOfRange { channel, error }, span)
    })?;
    Ok(params)
}

fn number(
    keys: &DeTable<'_>,
    key: &str,
    table_span: Range<usize>,
    channel: &str,
) -> Result<f64, Located> {
    let (value, span) = entry(keys, key, table_span, channel)?;
    let text = match value {
        DeValue::Float(float) => float.as_str().to_owned(),
        DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().to_owned(),
        other => return Err(wrong_type(&format!("{channel}.{key}"), other, "a number", span)),
    };
    text.parse().map_err(|_| wrong_type(&format!("{channel}.{key}"), value, "a number", span))
}

/// The value of a key and where it stands.
fn entry<'t, 'i>(
    table: &'t DeTable<'i>,
    key: &str,
    table_span: Range<usize>,
    channel: &str,
) -> Result<(&'t DeValue<'i>, Range<usize>), Located> {
    let dotted = if channel.is_empty() { key.to_owned() } else { format!("{channel}.{key}") };
    let value = table.get(key).ok_or((Problem::MissingKey(dotted), table_span))?;
    Ok((value.get_ref(), value.span()))
}

fn refuse_unknown_keys(
    table: &DeTable<'_>,
    prefix: &str,
    accepted: &[&str],
) -> Result<(), Located> {
    match table.keys().find(|key| !accepted.contains(&key.get_ref().as_ref())) {
        None => Ok(()),
        Some(key) => Err((
            Problem::UnknownKey {
                key: format!("{prefix}{}", key.get_ref()),
                accepted: accepted.join(", "),
            },
            key.span(),
        )),
    }
}

fn wrong_type(
    key: &str,
    found: &DeValue<'_>,
    accepted: &'static str,
    span: Range<usize>,
) -> Located {
    (Problem::WrongType { key: key.to_owned(), found: found.type_str(), accepted }, span)
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
