//! `sgdbake preview`: a picture of materials on a ball or a mesh.

use std::fmt;
use std::path::{Path, PathBuf};

use indicatif::ProgressBar;

use crate::cli::failure::Failure;
use crate::cli::input::check_regular;
use crate::cli::measured;
use crate::cli::output::{NewFile, Output, Writing};
use crate::cli::selection::Subjects;
use sgdbake::brdf::Reflectance;
use sgdbake::brdf::batch::SamplerBatch;
use sgdbake::measurement::{Filled, Measurement};
use sgdbake::preview::environment::EnvironmentError;
use sgdbake::preview::render::{Quality, Render, drawn_from, drawn_like, render};
use sgdbake::preview::shape::Mesh;
use sgdbake::preview::{Environment, Film, Model, Shape};
use sgdbake::scene::Scene;

/// Renders materials or measurements on a ball or a mesh, under the built-in lights or an
/// environment image.
///
/// Several materials stand side by side. The picture is converged by importance sampling of both
/// the lights and the surface; the remaining noise is stated. A PNG is tone-mapped, an EXR linear.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  sgdbake preview --material gold-paint --environment studio.hdr -o gold.png"
)]
pub struct Arguments {
    #[command(flatten)]
    subjects: Subjects,
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
    /// Width and height of each picture in pixels, 1 to 8192
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u16).range(1..=8192))]
    size: u16,
    /// Directions to the light per pixel, 1 to 1048576
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    samples: u32,
    /// Start of the random numbers: the same seed gives the same bytes
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    writing: Writing,
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
            _ => {
                Err(Failure::usage(format!("{} has no file extension of an image", path.display()))
                    .help("use .png (tone-mapped) or .exr (linear)"))
            }
        }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let format = ImageFormat::of(&arguments.output)?;
    let materials = arguments.subjects.materials(output)?;
    let measured = arguments.subjects.measured.iter();
    let measurements: Vec<Measurement> =
        measured.map(|path| measured::read(path)).collect::<Result<_, _>>()?;
    let inputs = arguments.inputs();
    arguments.writing.check([arguments.output.as_path()], &inputs)?;
    let shape = shape(arguments.mesh.as_deref(), output)?;
    let environment =
        arguments.environment.as_deref().map_or_else(|| Ok(Environment::studio()), environment)?;
    // Only here, so that a dry run fails over the same inputs as a run.
    if arguments.writing.dry_run {
        return output.written(&arguments.output, arguments.writing);
    }
    let count = materials.len() + measurements.len();
    let bar = output.progress(u64::from(arguments.size) * count as u64, "rows");
    let studio = Studio { shape, environment, quality: arguments.quality(), bar: &bar };
    let mut pictures: Vec<Render> = Vec::with_capacity(count);
    // Any model is drawn from the SGD of its material: a sample is weighted by the density it was
    // drawn with, so the sampler need not match what is shown.
    for material in &materials {
        let reflectance = arguments.model.reflectance(material)?;
        pictures.push(studio.picture(&drawn_from(material), reflectance.as_ref()));
    }
    for measurement in &measurements {
        let filled = Filled(measurement);
        pictures.push(studio.picture(&drawn_like(&filled), &filled));
    }
    bar.finish_and_clear();
    let noise = pictures.iter().map(|picture| picture.noise).fold(0.0, f64::max);
    let films: Vec<Film> = pictures.into_iter().map(|picture| picture.film).collect();
    let film = Film::beside(&films);
    let bytes = match format {
        ImageFormat::Png => film.to_png(),
        ImageFormat::Exr => film.to_exr(),
    };
    let file = NewFile::of_bytes(&arguments.output, bytes.map_err(Failure::job)?);
    arguments.writing.write_all(&[file], &inputs)?;
    output.written(&arguments.output, arguments.writing)?;
    output.note(format!("noise of a pixel: at most {:.2} % of the mean luminance", 100.0 * noise));
    Ok(())
}

impl Arguments {
    /// The files that the command reads.
    fn inputs(&self) -> Vec<&Path> {
        let materials = self.subjects.inputs();
        materials.chain(self.environment.as_deref()).chain(self.mesh.as_deref()).collect()
    }

    fn quality(&self) -> Quality {
        Quality { size: self.size.into(), samples: self.samples as usize, seed: self.seed }
    }
}

/// A shape under its lights, and how it is pictured.
struct Studio<'a> {
    shape: Shape,
    environment: Environment,
    quality: Quality,
    bar: &'a ProgressBar,
}

impl Studio<'_> {
    /// The picture of a reflectance, the directions drawn from `surface`.
    fn picture(&self, surface: &SamplerBatch, shown: &dyn Reflectance) -> Render {
        let Self { shape, environment, quality, bar } = self;
        let [picture] = render(shape, environment, surface, [shown], *quality, &|| bar.inc(1));
        picture
    }
}

pub(super) fn environment(path: &Path) -> Result<Environment, Failure> {
    check_regular(path)?;
    Environment::load(path).map_err(|error| match error {
        EnvironmentError::Dark => Failure::job(format!("{}: {error}", path.display())),
        EnvironmentError::Unreadable { .. } => Failure::job(error)
            .help("use an equirectangular .hdr or .exr image, or leave it out for built-in lights"),
    })
}

fn shape(path: Option<&Path>, output: &Output) -> Result<Shape, Failure> {
    let Some(path) = path else { return Ok(Shape::Ball) };
    let scene = Scene::open(path).map_err(|error| unusable(path, error))?;
    scene.warnings().iter().for_each(|warning| output.note(warning));
    let triangles = scene.triangles().map_err(|error| unusable(path, error))?;
    let mesh = Mesh::new(triangles.into_iter().map(Into::into).collect());
    mesh.map(Shape::Mesh).ok_or_else(|| unusable(path, "no triangle of finite size"))
}

/// The failure of a mesh that cannot be shown.
fn unusable(path: &Path, reason: impl fmt::Display) -> Failure {
    Failure::job(format!("{}: {reason}", path.display()))
        .help("use a .obj, .gltf or .glb file with uncompressed triangles")
}
