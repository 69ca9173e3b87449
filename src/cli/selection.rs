//! Materials, directions and angles as they are named on the command line.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::builder::{PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser};
use glam::DVec3;

use crate::cli::failure::Failure;
use crate::cli::input::check_text;
use sgdbake::lut::Extent;
use sgdbake::material::{Material, MaterialFileError, catalog, find, load};
use sgdbake::math::direction::normalised;

/// How large lookup textures become.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct ExtentArguments {
    /// The error to keep, 1e-6 to 0.5: |f_lut − f|cosθi relative to its maximum for the viewer plus
    /// f·cosθi
    #[arg(
        long,
        value_name = "E",
        default_value_t = 1e-3,
        conflicts_with = "size",
        allow_negative_numbers = true
    )]
    tolerance: f64,
    /// Texels along each axis that is not a row, 2 to 16384, in place of a tolerance
    #[arg(long, value_name = "N")]
    size: Option<usize>,
}

impl From<ExtentArguments> for Extent {
    fn from(arguments: ExtentArguments) -> Self {
        arguments.size.map_or(Self::Tolerance(arguments.tolerance), Self::Size)
    }
}

/// The material that `name` names: a catalogue name, or the path of a material file.
///
/// # Errors
///
/// Neither: the nearest names. A file that cannot be read or is no material: file, line and key.
pub fn material(name: &str) -> Result<Material, Failure> {
    let unknown = match find(name) {
        Ok(entry) => return Ok(entry.material.clone()),
        Err(unknown) => unknown,
    };
    let path = Path::new(name);
    if path.exists() || name.contains(std::path::MAIN_SEPARATOR) || name.ends_with(".toml") {
        check_text(path)?;
        return load(path).map_err(Failure::from);
    }
    Err(Failure::usage(&unknown).help(format!(
        "did you mean {}? 'sgdbake materials' lists all; a material file is named by its path",
        unknown.nearest.join(", ")
    )))
}

/// Takes any text as a material, and tells shells the names of the catalogue.
#[derive(Clone, Copy, Debug)]
pub struct MaterialParser;

impl TypedValueParser for MaterialParser {
    type Value = String;

    fn parse_ref(
        &self,
        command: &clap::Command,
        argument: Option<&clap::Arg>,
        value: &OsStr,
    ) -> Result<String, clap::Error> {
        StringValueParser::new().parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let names = catalog().iter().map(|entry| entry.material.name.as_str());
        Some(Box::new(names.map(PossibleValue::new)))
    }
}

/// Takes one of these names and nothing else; help and shells list them.
pub fn one_of<T>(names: impl IntoIterator<Item = &'static str>) -> impl TypedValueParser<Value = T>
where
    T: FromStr<Err: std::error::Error + Send + Sync + 'static> + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names).try_map(|name| name.parse::<T>())
}

/// Materials and measurements that a command works on.
#[derive(Debug, clap::Args)]
#[group(required = true, multiple = true)]
pub struct Subjects {
    /// A catalogue name or the path of a material file. Repeat for more
    #[arg(
        long,
        value_name = "MATERIAL",
        value_parser = MaterialParser,
        hide_possible_values = true,
        conflicts_with = "all"
    )]
    material: Vec<String>,
    /// The whole catalogue
    #[arg(long)]
    all: bool,
    /// A measurement: MERL .binary, RGL .bsdf or .csv of samples. Repeat for more
    #[arg(long, value_name = "FILE")]
    pub measured: Vec<PathBuf>,
}

impl Subjects {
    /// The paths that the names may be.
    pub fn inputs(&self) -> impl Iterator<Item = &Path> {
        self.material.iter().map(Path::new).chain(self.measured.iter().map(PathBuf::as_path))
    }

    /// The materials named, or all.
    ///
    /// # Errors
    ///
    /// As [`material`].
    pub fn materials(&self) -> Result<Vec<Material>, Failure> {
        materials(&self.material, self.all)
    }
}

/// The materials that a command works on.
#[derive(Debug, clap::Args)]
#[group(required = true, multiple = false)]
pub struct Materials {
    /// A catalogue name or the path of a material file. Repeat for more
    #[arg(
        long,
        value_name = "MATERIAL",
        value_parser = MaterialParser,
        hide_possible_values = true
    )]
    material: Vec<String>,
    /// The whole catalogue
    #[arg(long)]
    all: bool,
}

impl Materials {
    /// The paths that the names may be.
    pub fn inputs(&self) -> impl Iterator<Item = &Path> {
        self.material.iter().map(Path::new)
    }

    /// The materials named, or all.
    ///
    /// # Errors
    ///
    /// As [`material`].
    pub fn load(&self) -> Result<Vec<Material>, Failure> {
        materials(&self.material, self.all)
    }
}

/// The materials named, or the whole catalogue.
///
/// # Errors
///
/// As [`material`].
pub fn materials(names: &[String], all: bool) -> Result<Vec<Material>, Failure> {
    if all {
        return Ok(catalog().iter().map(|entry| entry.material.clone()).collect());
    }
    names.iter().map(|name| material(name)).collect()
}

impl From<MaterialFileError> for Failure {
    fn from(error: MaterialFileError) -> Self {
        match error {
            MaterialFileError::Unreadable { .. } => {
                Self::job(error).help("'sgdbake materials' lists the catalogue's names")
            }
            MaterialFileError::Invalid { .. } => {
                Self::usage(error).help("README.md shows a complete material file")
            }
        }
    }
}

/// A direction given as `x,y,z`, normalised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction(pub DVec3);

/// Why three numbers are no direction.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DirectionError {
    /// Not three comma-separated numbers.
    #[error("'{0}' is not a direction; give three numbers x,y,z")]
    Syntax(String),
    /// Zero, NaN or infinite.
    #[error("'{0}' is not a direction; its numbers must be finite and not all zero")]
    Degenerate(String),
}

impl FromStr for Direction {
    type Err = DirectionError;

    fn from_str(text: &str) -> Result<Self, DirectionError> {
        let numbers: Vec<f64> = text
            .split(',')
            .map(|number| number.trim().parse())
            .collect::<Result<_, _>>()
            .map_err(|_| DirectionError::Syntax(text.to_owned()))?;
        let [x, y, z] = numbers[..] else {
            return Err(DirectionError::Syntax(text.to_owned()));
        };
        normalised(DVec3::new(x, y, z))
            .map(Direction)
            .ok_or_else(|| DirectionError::Degenerate(text.to_owned()))
    }
}
