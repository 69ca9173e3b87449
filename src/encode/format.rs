//! The texture file formats.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A texture file format.
///
/// # Example
///
/// ```
/// use sgdbake::Format;
///
/// assert_eq!("exr".parse(), Ok(Format::Exr));
/// assert_eq!(Format::Ktx2.extension(), "ktx2");
/// assert!("jpg".parse::<Format>().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// OpenEXR.
    Exr,
    /// KTX 2.
    Ktx2,
    /// 16-bit PNG.
    Png,
}

/// A name that no format has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown texture format '{0}'; use exr, ktx2 or png")]
pub struct UnknownFormat(String);

impl FromStr for Format {
    type Err = UnknownFormat;

    fn from_str(name: &str) -> Result<Self, UnknownFormat> {
        Self::ALL
            .into_iter()
            .find(|format| format.extension() == name)
            .ok_or_else(|| UnknownFormat(name.to_owned()))
    }
}

/// The name as people write it: `KTX 2`.
impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Exr => "EXR",
            Self::Ktx2 => "KTX 2",
            Self::Png => "PNG",
        })
    }
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 3] = [Self::Exr, Self::Ktx2, Self::Png];

    /// The format of a file, by its first bytes.
    #[must_use]
    pub fn of(start: &[u8]) -> Option<Self> {
        Self::ALL.into_iter().find(|format| start.starts_with(format.signature()))
    }

    /// The bytes that every file of the format starts with.
    #[must_use]
    pub const fn signature(self) -> &'static [u8] {
        match self {
            Self::Exr => b"\x76\x2f\x31\x01",
            Self::Ktx2 => &ktx2::MAGIC,
            Self::Png => b"\x89PNG\r\n\x1a\n",
        }
    }

    /// The name, which is also the file extension.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Ktx2 => "ktx2",
            Self::Png => "png",
        }
    }

    /// The media type.
    #[must_use]
    pub fn mime_type(self) -> &'static str {
        match self {
            Self::Exr => "image/x-exr",
            Self::Ktx2 => "image/ktx2",
            Self::Png => "image/png",
        }
    }
}
