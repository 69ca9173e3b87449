//! Tables of a TOML file, read with the place of everything that is wrong.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::material::file_error::{Located, Problem};
use crate::material::lobe::MaskingParams;
use crate::material::range::ParameterError;

/// Keys of the masking fit.
pub const MASKING: [&str; 3] = ["lambda", "c", "k"];

/// The number of a value.
fn number(value: &Spanned<DeValue<'_>>) -> Option<f64> {
    match value.get_ref() {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok(),
        // TOML also writes integers as 0xff, 0o377 and 0b1111.
        DeValue::Integer(integer) => {
            i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|n| n as f64)
        }
        _ => None,
    }
}

/// A table of the file, its name and its place.
pub struct Section<'t> {
    /// Its keys and values.
    pub entries: &'t DeTable<'t>,
    /// Empty for the file itself.
    pub name: String,
    /// Its bytes in the text.
    pub span: Range<usize>,
}

impl<'t> Section<'t> {
    /// The string of a key.
    pub fn string(&self, key: &str) -> Result<String, Located> {
        self.value(key, "a string", |value| Some(value.get_ref().as_str()?.to_owned()))
    }

    /// The number of a key.
    pub fn number(&self, key: &str) -> Result<f64, Located> {
        self.value(key, "a number", number)
    }

    /// The three numbers of a key.
    pub fn colour(&self, key: &str) -> Result<[f64; 3], Located> {
        self.value(key, "three numbers [r, g, b]", |value| {
            let numbers =
                value.get_ref().as_array()?.iter().map(number).collect::<Option<Vec<_>>>()?;
            numbers.try_into().ok()
        })
    }

    /// The masking fit, if any of its three keys is there.
    pub fn masking(&self) -> Result<Option<MaskingParams>, Located> {
        if !MASKING.iter().any(|key| self.has(key)) {
            return Ok(None);
        }
        let [lambda, c, k] = MASKING.map(|key| self.number(key));
        Ok(Some(MaskingParams { lambda: lambda?, c: c?, k: k? }))
    }

    /// The table of a key.
    pub fn section(&self, name: &str) -> Result<Section<'t>, Located> {
        self.value(name, "a table", |value| {
            let entries = value.get_ref().as_table()?;
            Some(Section { entries, name: name.to_owned(), span: value.span() })
        })
    }

    /// The tables of an array of tables; none where the key is missing.
    pub fn sections(&self, name: &str) -> Result<Vec<Section<'t>>, Located> {
        if !self.has(name) {
            return Ok(Vec::new());
        }
        self.value(name, "an array of tables", |value| {
            let mut sections = Vec::new();
            for (i, table) in value.get_ref().as_array()?.iter().enumerate() {
                let entries = table.get_ref().as_table()?;
                let name = format!("{name} {}", i + 1);
                sections.push(Section { entries, name, span: table.span() });
            }
            Some(sections)
        })
    }

    /// Returns whether a key is there.
    pub fn has(&self, key: &str) -> bool {
        self.entries.contains_key(key)
    }

    /// The place of a key, or of the whole table without it.
    pub fn span_of(&self, key: &str) -> Range<usize> {
        self.entries.get(key).map_or(self.span.clone(), Spanned::span)
    }

    /// The problem of a number out of its range.
    pub fn out_of_range(&self, error: ParameterError) -> Located {
        let span = self.span_of(error.key);
        (Problem::OutOfRange { section: self.name.clone(), error }, span)
    }

    /// The value of a key as `read` understands it.
    fn value<T>(
        &self,
        key: &str,
        accepted: &'static str,
        read: impl FnOnce(&'t Spanned<DeValue<'t>>) -> Option<T>,
    ) -> Result<T, Located> {
        // A missing key has no place of its own: the place is the table's.
        let Some(value) = self.entries.get(key) else {
            return Err((Problem::MissingKey(self.dotted(key)), self.span.clone()));
        };
        read(value).ok_or_else(|| {
            let (key, found) = (self.dotted(key), value.get_ref().type_str());
            (Problem::WrongType { key, found, accepted }, value.span())
        })
    }

    /// Refuses keys that are not accepted.
    pub fn refuse_all_but(&self, accepted: &[&str]) -> Result<(), Located> {
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
