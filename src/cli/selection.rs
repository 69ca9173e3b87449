//! Materials, directions and angles as they are named on the command line.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser};
use glam::DVec3;

use crate::cli::failure::Failure;
use crate::cli::input::check_text;
use crate::cli::measured;
use crate::cli::output::Output;
use sgdbake::asset::{Measured, Subject};
use sgdbake::brdf::MaskingKind;
use sgdbake::fit::gltf_measured;
use sgdbake::fit::sgd::Energy;
use sgdbake::lut::{Depths, Extent, Quantity, Request};
use sgdbake::material::{Edition, Material, MaterialFileError, find, load, named, refit_of};
use sgdbake::math::direction::normalised;
use sgdbake::report::surface::{Surface, SurfaceFit};

/// The size of lookup textures.
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

/// The lookup textures of the extension.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct TextureArguments {
    /// The masking function to store
    #[arg(long, value_enum, default_value_t)]
    masking: MaskingKind,
    #[command(flatten)]
    extent: ExtentArguments,
}

impl From<TextureArguments> for Request {
    fn from(TextureArguments { masking, extent }: TextureArguments) -> Self {
        Self {
            quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
            masking,
            extent: extent.into(),
            depths: Depths::Smallest,
        }
    }
}

impl From<ExtentArguments> for Extent {
    fn from(arguments: ExtentArguments) -> Self {
        arguments.size.map_or(Self::Tolerance(arguments.tolerance), Self::Size)
    }
}

/// A material and, where it was fitted to a measurement, what is known from that.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// The material.
    pub material: Material,
    /// From the measurement.
    pub measured: Option<Measured>,
}

impl From<Material> for Chosen {
    fn from(material: Material) -> Self {
        Self { material, measured: None }
    }
}

impl Chosen {
    /// What is fitted to the measurement at `path`: the material, and the glTF material.
    #[must_use]
    pub fn fitted(path: &Path, surface: &Surface, fit: SurfaceFit) -> Self {
        let gltf = gltf_measured::fit(&surface.target).material;
        let measured = Measured {
            source: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            energy: Energy::Conserve,
            error: fit.distance.into(),
            gltf,
            gltf_error: surface.reference.distance(&gltf).into(),
        };
        Self { material: fit.material, measured: Some(measured) }
    }

    /// The material as it is built.
    #[must_use]
    pub fn subject(&self) -> Subject<'_> {
        Subject { material: &self.material, measured: self.measured.as_ref() }
    }
}

/// As [`material`], with the glTF material that is fitted to the measurement itself.
///
/// # Errors
///
/// As [`material`].
pub fn chosen(name: &str, output: &Output) -> Result<Chosen, Failure> {
    let path = Path::new(name);
    if named(name).is_err() && measured::is_named_so(path) {
        let (surface, fit) = measured::fitted(path, output)?;
        return Ok(Chosen::fitted(path, &surface, fit));
    }
    let material = material(name, output)?;
    // As in `material`, a catalogue name goes before a file of that name.
    let is_file = named(name).is_err() && path.is_file();
    let text = is_file.then(|| std::fs::read_to_string(path).ok()).flatten();
    let measured = text.and_then(|text| Measured::of_text(&text, &material));
    Ok(Chosen { material, measured })
}

/// The material that `name` names: a catalogue name, the path of a material file, or that of a
/// measurement, which is fitted.
///
/// # Errors
///
/// A name that is none of these: the nearest names. A file that cannot be read or is not a
/// material: file, line and key.
pub fn material(name: &str, output: &Output) -> Result<Material, Failure> {
    let unknown = match named(name) {
        Ok(material) => return Ok(material.clone()),
        Err(unknown) => unknown,
    };
    let path = Path::new(name);
    if measured::is_named_so(path) {
        return Ok(measured::fitted(path, output)?.1.material);
    }
    // What looks like a path fails as a file that is missing, the rest as an unknown name.
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
        let editions = Edition::Published.materials().chain(Edition::Refit.materials());
        Some(Box::new(editions.map(|material| PossibleValue::new(material.name.as_str()))))
    }
}

/// Takes one of these names and nothing else; help and shells list them.
pub fn one_of<T>(names: impl IntoIterator<Item = &'static str>) -> impl TypedValueParser<Value = T>
where
    T: FromStr<Err: std::error::Error + Send + Sync + 'static> + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names).try_map(|name| name.parse::<T>())
}

/// An edition of the catalogue by its name on the command line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum EditionChoice {
    /// The fits of the paper
    #[default]
    Published,
    /// Lobes that colour all channels, fitted to the measurements
    Refit,
}

impl From<EditionChoice> for Edition {
    fn from(choice: EditionChoice) -> Self {
        match choice {
            EditionChoice::Published => Self::Published,
            EditionChoice::Refit => Self::Refit,
        }
    }
}

/// ΔE2000 from the surface above which a published fit is worth a note.
const FAR: f64 = 2.0;

/// A note for each published fit that is far from its surface, naming the refit.
pub fn note_far_fits<'a>(materials: impl IntoIterator<Item = &'a Material>, output: &Output) {
    for material in materials {
        let Ok(published) = find(&material.name) else { continue };
        let Some(refit) = refit_of(&material.name) else { continue };
        // A material file may bear a catalogue name with other parameters.
        if published.material == *material && refit.published_delta_e > FAR {
            output.note(format_args!(
                "note: the published fit of {} is {:.1} ΔE2000 from the measured surface; {} is {:.1}",
                material.name, refit.published_delta_e, refit.material.name, refit.error.delta_e
            ));
        }
    }
}

/// Materials and measurements that a command works on.
#[derive(Debug, clap::Args)]
#[group(required = true, multiple = true)]
pub struct Subjects {
    /// A catalogue name, or the path of a material file or of a measurement. Repeat for more
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
    /// The edition of the catalogue that --all means
    #[arg(long, value_enum, default_value_t, requires = "all")]
    edition: EditionChoice,
    /// A measurement: MERL .binary, RGL .bsdf or .csv of samples. Repeat for more
    #[arg(long, value_name = "FILE")]
    pub measured: Vec<PathBuf>,
}

impl Subjects {
    /// The arguments as paths, as each may name a file that is read.
    pub fn inputs(&self) -> impl Iterator<Item = &Path> {
        self.material.iter().map(Path::new).chain(self.measured.iter().map(PathBuf::as_path))
    }

    /// The materials named, or all.
    ///
    /// # Errors
    ///
    /// As [`material`].
    pub fn materials(&self, output: &Output) -> Result<Vec<Material>, Failure> {
        materials(&self.material, self.all.then(|| self.edition.into()), output)
    }
}

/// The materials that a command works on.
#[derive(Debug, clap::Args)]
#[group(required = true, multiple = true)]
pub struct Materials {
    /// A catalogue name, or the path of a material file or of a measurement. Repeat for more
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
    /// The edition of the catalogue that --all means
    #[arg(long, value_enum, default_value_t, requires = "all")]
    edition: EditionChoice,
}

impl Materials {
    /// The arguments as paths, as each may name a file that is read.
    pub fn inputs(&self) -> impl Iterator<Item = &Path> {
        self.material.iter().map(Path::new)
    }

    /// The materials named, or all.
    ///
    /// # Errors
    ///
    /// As [`material`].
    pub fn load(&self, output: &Output) -> Result<Vec<Material>, Failure> {
        materials(&self.material, self.all.then(|| self.edition.into()), output)
    }
}

/// The materials named, or all of an edition.
///
/// # Errors
///
/// As [`material`].
pub fn materials(
    names: &[String],
    all: Option<Edition>,
    output: &Output,
) -> Result<Vec<Material>, Failure> {
    if let Some(edition) = all {
        return Ok(edition.materials().cloned().collect());
    }
    names.iter().map(|name| material(name, output)).collect()
}

impl From<MaterialFileError> for Failure {
    fn from(error: MaterialFileError) -> Self {
        match error {
            MaterialFileError::Unreadable { .. } => {
                Self::job(error).help("'sgdbake materials' lists the catalogue's names")
            }
            MaterialFileError::Invalid { .. } => {
                Self::usage(error).help("docs/materials.md shows complete material files")
            }
        }
    }
}

/// A direction given as `x,y,z`, normalised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction(pub DVec3);

/// The reason why three numbers are not a direction.
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
