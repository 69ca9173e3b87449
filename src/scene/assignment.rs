//! Assignments: which material goes to which slot, as the command line and assignment files say it.

use std::str::FromStr;

/// A slot and its material, as they were given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assignment {
    /// The slot's pattern.
    pub slot: String,
    /// The material's name or path.
    pub material: String,
}

/// Text that is not an assignment.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AssignmentError {
    /// One side is missing.
    #[error("'{0}' is not an assignment; give a slot and a material as SLOT=MATERIAL")]
    Syntax(String),
    /// A file that is not TOML.
    #[error("not valid TOML: {0}")]
    Toml(#[from] toml::de::Error),
    /// A value of another type.
    #[error("slot {slot:?} has a value of type {found}; give the material as a string")]
    Type {
        /// The slot's pattern.
        slot: String,
        /// The type found.
        found: &'static str,
    },
}

impl FromStr for Assignment {
    type Err = AssignmentError;

    /// Splits at the last `=`: slot names may hold one.
    fn from_str(text: &str) -> Result<Self, AssignmentError> {
        match text.rsplit_once('=') {
            Some((slot, material)) if !slot.is_empty() && !material.is_empty() => {
                Ok(Self { slot: slot.to_owned(), material: material.to_owned() })
            }
            _ => Err(AssignmentError::Syntax(text.to_owned())),
        }
    }
}

impl Assignment {
    /// Reads the lines `"SLOT" = "MATERIAL"` of a TOML file, in their order.
    ///
    /// # Errors
    /// Text that is not TOML, and values that are not strings.
    pub fn parse_file(text: &str) -> Result<Vec<Self>, AssignmentError> {
        let table: toml::Table = text.trim_start_matches('\u{feff}').parse()?;
        // In the order of the file (toml's `preserve_order`), which decides between equal patterns.
        table.into_iter().map(Self::from_entry).collect()
    }

    fn from_entry((slot, value): (String, toml::Value)) -> Result<Self, AssignmentError> {
        match value {
            toml::Value::String(material) => Ok(Self { slot, material }),
            other => Err(AssignmentError::Type { slot, found: other.type_str() }),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::*;

    #[test]
    fn slots_may_hold_an_equals_sign() {
        let Assignment { slot, material } = "a=b=gold-paint".parse().unwrap();
        assert_eq!((slot, material), ("a=b".into(), "gold-paint".into()));
        assert!("=x".parse::<Assignment>().is_err() && "x".parse::<Assignment>().is_err());
    }

    #[test]
    fn files_keep_their_order() {
        let text = "\u{feff}\"b*\" = 'chrome'\n\"#0\" = \"x\" # comment\n\"a\" = 'y'\n";
        let slots: Vec<_> =
            Assignment::parse_file(text).unwrap().into_iter().map(|a| a.slot).collect();
        assert_eq!(slots, ["b*", "#0", "a"]);
        let error = Assignment::parse_file("a = 1").unwrap_err().to_string();
        assert_eq!(error, "slot \"a\" has a value of type integer; give the material as a string");
        assert!(Assignment::parse_file("a").is_err());
    }
}
