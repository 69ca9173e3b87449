//! `sgdbake preview`: a picture of materials on a ball or a mesh.

use std::path::{Path, PathBuf};

use crate::brdf::{Reflectance, Sampler};
use crate::cli::failure::Failure;
use crate::cli::measured;
use crate::cli::output::{Output, refuse_foreign, write_file};
use crate::cli::selection;
use crate::lut::BakeError;
use crate::material::Material;
use crate::measurement::{Filled, Measurement};
use crate::preview::environment::EnvironmentError;
use crate::preview::render::{Quality, Render, drawn_from, drawn_like, render};
use crate::preview::shape::Mesh;
use crate::preview::{Environment, Film, Model, Shape};
use crate::scene::Scene;

/// Renders materials or measurements on a ball or a mesh, under the built-in lights or an environment image.
///
/// Several materials stand side by side. The picture is converged by importance sampling of both
/// the lights and the surface; the remaining noise is stated. A PNG is tone-mapped, an EXR linear.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  sgdbake preview --material gold-paint --environment studio.hdr -o gold.png"
)]
pub struct Arguments {
    /// A catalogue name or the path of a material file; may be given more than once
    #[arg(long, value_name = "MATERIAL", required_unless_present = "measured")]
    material: Vec<String>,
    /// A measurement, shown as it is: MERL .binary, RGL .bsdf or .csv of samples; what was not
    /// measured takes the nearest value. May be given more than once, and beside materials
    #[arg(long, value_name = "FILE")]
    measured: Vec<PathBuf>,
    /// The picture to write, .png or .exr
    #[arg(short, long, value_name = "IMAGE")]
    output: PathBuf,
    /// The model to show
    #[arg(long, value_enum, default_value_t)]
    model: Model,
    /// An equirectangular .hdr or .exr image in place of the built-in lights
    #[arg(long, value_name = "FILE")]
    environment: Option<PathBuf>,
    /// A .obj, .gltf or .glb in place of the ball
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Width and height of each picture in pixels
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u16).range(1..=8192))]
    size: u16,
    /// Directions to the light per pixel
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    samples: u32,
    /// Start of the random numbers: the same seed gives the same bytes
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Say what would be written, and write nothing
    #[arg(long)]
    dry_run: bool,
    /// Overwrite a file that sgdbake did not write
    #[arg(long)]
    force: bool,
}

/// The image formats, by the file's ending.
#[derive(Clone, Copy)]
enum ImageFormat {
    Png,
    Exr,
}

impl ImageFormat {
    fn of(path: &Path) -> Result<Self, Failure> {
        match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            _ => Err(Failure::usage(format!("{} is no picture's name", path.display()))
                .help("accepted endings are .png (tone-mapped) and .exr (linear)")),
        }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let format = ImageFormat::of(&arguments.output)?;
    let materials: Vec<Material> = arguments
        .material
        .iter()
        .map(|name| selection::material(name))
        .collect::<Result<_, _>>()?;
    let measurements: Vec<Measurement> =
        arguments.measured.iter().map(|path| measured::read(path)).collect::<Result<_, _>>()?;
    refuse_foreign(&arguments.output, arguments.force)?;
    let shape = shape(arguments.mesh.as_deref(), output)?;
    let environment =
        arguments.environment.as_deref().map_or_else(|| Ok(Environment::studio()), environment)?;
    if arguments.dry_run {
        return output.line(arguments.output.display());
    }
    let count = materials.len() + measurements.len();
    let bar = output.progress(u64::from(arguments.size) * count as u64, "rows");
    let picture = |surface: &Sampler, shown: &dyn Reflectance| {
        let quality = arguments.quality();
        let [picture] = render(&shape, &environment, surface, [shown], quality, &|| bar.inc(1));
        picture
    };
    let of_material = |material| {
        let reflectance = arguments.model.reflectance(material)?;
        Ok(picture(&drawn_from(material), reflectance.as_ref()))
    };
    let of_measurement = |measurement| {
        let filled = Filled(measurement);
        picture(&drawn_like(&filled), &filled)
    };
    let mut pictures: Vec<Render> =
        materials.iter().map(of_material).collect::<Result<_, BakeError>>()?;
    pictures.extend(measurements.iter().map(|measurement| of_measurement(measurement)));
    bar.finish_and_clear();
    let noise = pictures.iter().map(|picture| picture.noise).fold(0.0, f64::max);
    let films: Vec<Film> = pictures.into_iter().map(|picture| picture.film).collect();
    let film = Film::beside(&films);
    let bytes = match format {
        ImageFormat::Png => film.to_png(),
        ImageFormat::Exr => film.to_exr(),
    };
    write_file(&arguments.output, &bytes.map_err(Failure::job)?, arguments.force)?;
    output.line(arguments.output.display())?;
    output.note(format!("noise of a pixel: at most {:.2} % of the mean luminance", 100.0 * noise));
    Ok(())
}

impl Arguments {
    fn quality(&self) -> Quality {
        Quality { size: self.size.into(), samples: self.samples as usize, seed: self.seed }
    }
}

pub(super) fn environment(path: &Path) -> Result<Environment, Failure> {
    Environment::load(path).map_err(|error| match error {
        EnvironmentError::Dark => Failure::job(format!("{}: {error}", path.display())),
        EnvironmentError::Unreadable { .. } => Failure::job(error).help(
            "accepted are equirectangular .hdr and .exr images; without one, built-in lights",
        ),
    })
}

fn shape(path: Option<&Path>, output: &Output) -> Result<Shape, Failure> {
    let Some(path) = path else { return Ok(Shape::Ball) };
    let unusable = |reason: &dyn std::fmt::Display| {
        Failure::job(format!("{}: {reason}", path.display()))
            .help("accepted are .obj, .gltf and .glb with uncompressed triangles")
    };
    let scene = Scene::open(path).map_err(|error| unusable(&error))?;
    scene.warnings().iter().for_each(|warning| output.note(warning));
    let triangles = scene.triangles().map_err(|error| unusable(&error))?;
    let mesh = Mesh::new(triangles.into_iter().map(Into::into).collect());
    mesh.map(Shape::Mesh).ok_or_else(|| unusable(&"no triangle of finite size"))
}
