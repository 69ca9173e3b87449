//! `sgdbake measure`: a measurement → a material file, with its errors against the data.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::measured;
use crate::cli::output::{NewFile, Output, Writing};
use sgdbake::asset::{Measured, Parameters};
use sgdbake::brdf::GltfBrdf;
use sgdbake::fit::gltf_measured;
use sgdbake::fit::sgd::{Energy, Lobes, Options};
use sgdbake::fit::sgd_model::SgdLobe;
use sgdbake::fit::uncertainty::Uncertainty;
use sgdbake::material::MaterialError;
use sgdbake::report::distance::Distance;
use sgdbake::report::number::six_digits;
use sgdbake::report::surface::{Surface, SurfaceFit};

/// Fits a material to a measurement: a diffuse colour and one or two SGD lobes that colour all
/// three channels, and a glTF material beside them.
///
/// Prints the parameters with their standard errors, and how far both are from the measurement.
/// The material file keeps the errors, the source and the glTF material, which bake and export
/// then use.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  sgdbake measure paint.binary -o paint.toml
  sgdbake measure fabric.bsdf -o fabric.toml --lobes 1 --energy free --json")]
pub struct Arguments {
    /// The measurement: MERL .binary, RGL .bsdf or .csv of samples
    #[arg(value_name = "FILE")]
    measurement: PathBuf,
    /// The material file to write
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// The lobes of the fit
    #[arg(long, value_enum, default_value_t, conflicts_with = "per_channel")]
    lobes: LobesChoice,
    /// The paper's form: a lobe for each channel
    #[arg(long)]
    per_channel: bool,
    /// Whether the material may reflect more than arrives
    #[arg(long, value_enum, default_value_t)]
    energy: EnergyChoice,
    #[command(flatten)]
    writing: Writing,
    /// Machine-readable report
    #[arg(long)]
    json: bool,
}

/// A number of lobes by its name on the command line.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum LobesChoice {
    /// One lobe
    #[value(name = "1")]
    One,
    /// Two lobes
    #[value(name = "2")]
    Two,
    /// Two where the second lowers the colour difference by more than a tenth
    #[default]
    Auto,
}

/// A limit by its name on the command line.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum EnergyChoice {
    /// No negative reflectance, and an albedo of at most 1 at every angle
    #[default]
    Conserve,
    /// Whatever is nearest to the measurement
    Free,
}

/// A difference in ΔE2000 that conserving energy may cost without a word: it would be printed as
/// 0.00.
const NOTICED: f64 = 0.005;
/// ΔE2000 from which the model does not follow the surface.
const FAR: f64 = 3.0;

/// The object that `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    schema: &'static str,
    dry_run: bool,
    path: &'a Path,
    source: &'a str,
    energy: Energy,
    material: Parameters,
    uncertainty: &'a Uncertainty,
    error: Distance,
    /// The fit without a limit, where the limit costs.
    #[serde(skip_serializing_if = "Option::is_none")]
    free_error: Option<Distance>,
    gltf: GltfBrdf,
    gltf_error: Distance,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let inputs = [arguments.measurement.as_path()];
    // An output that is in the way is refused before the fits, which take long.
    arguments.writing.check([arguments.output.as_path()], &inputs)?;
    let bar = output.progress(STEPS, "fitting");
    let path = &arguments.measurement;
    let measurement = measured::read(path)?;
    bar.inc(1);
    let surface = Surface::new(&measurement.averaged())
        .map_err(|error| measured::unfit(path, &error.into()))?;
    bar.inc(1);
    let fits = Fits::new(&surface, &measured::name(path), arguments.options(), &|| bar.inc(1));
    let fits = fits.map_err(|error| measured::unfit(path, &error.into()))?;
    bar.finish_and_clear();
    let source = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let about = Measured {
        source,
        energy: arguments.options().energy,
        error: fits.chosen.distance.into(),
        gltf: fits.gltf,
        gltf_error: fits.gltf_distance.into(),
    };
    let file = NewFile::of_bytes(&arguments.output, about.to_text(&fits.chosen.material));
    arguments.writing.write_all(&[file], &inputs)?;
    fits.report(arguments, &about, output)
}

/// Steps of the progress bar: reading, preparing the target, and the three fits.
const STEPS: u64 = 5;

impl Arguments {
    fn options(&self) -> Options {
        let lobes = match self.lobes {
            _ if self.per_channel => Lobes::PerChannel,
            LobesChoice::One => Lobes::One,
            LobesChoice::Two => Lobes::Two,
            LobesChoice::Auto => Lobes::Auto,
        };
        let energy = match self.energy {
            EnergyChoice::Conserve => Energy::Conserve,
            EnergyChoice::Free => Energy::Free,
        };
        Options { lobes, energy }
    }
}

/// The fits to a measurement.
struct Fits {
    chosen: SurfaceFit,
    /// The one with free energy, where that is nearer.
    free: Option<Distance>,
    gltf: GltfBrdf,
    gltf_distance: Distance,
}

/// The result of a step, now counted as done.
fn counted<T>(step: &(dyn Fn() + Sync), result: T) -> T {
    step();
    result
}

impl Fits {
    fn new(
        surface: &Surface,
        name: &str,
        options: Options,
        step: &(dyn Fn() + Sync),
    ) -> Result<Self, MaterialError> {
        // The free fit only tells what conserving energy costs.
        let free = (options.energy == Energy::Conserve)
            .then_some(Options { energy: Energy::Free, ..options });
        // None of the three needs another.
        let ((chosen, free), gltf) = rayon::join(
            || {
                rayon::join(
                    || counted(step, surface.fit(name, options)),
                    || free.map(|options| counted(step, surface.fit(name, options))).transpose(),
                )
            },
            || counted(step, gltf_measured::fit(&surface.target).material),
        );
        let chosen = chosen?;
        let free = free?.map(|free| free.distance);
        Ok(Self {
            free: free.filter(|free| chosen.distance.suns - free.suns > NOTICED),
            gltf_distance: surface.reference.distance(&gltf),
            chosen,
            gltf,
        })
    }

    fn report(
        &self,
        arguments: &Arguments,
        about: &Measured,
        output: &mut Output,
    ) -> Result<(), Failure> {
        if arguments.json {
            return output.json(&Report {
                schema: "sgdbake/measure/1",
                dry_run: arguments.writing.dry_run,
                path: &arguments.output,
                source: &about.source,
                energy: about.energy,
                material: Parameters::of(&self.chosen.material),
                uncertainty: &self.chosen.fit.uncertainty,
                error: self.chosen.distance,
                free_error: self.free,
                gltf: self.gltf,
                gltf_error: self.gltf_distance,
            });
        }
        self.print_parameters(output)?;
        self.print_errors(output)?;
        output.written(&arguments.output, arguments.writing)
    }

    fn print_parameters(&self, output: &mut Output) -> Result<(), Failure> {
        let SurfaceFit { fit, material, .. } = &self.chosen;
        output.line(&material.name)?;
        output.line(format_args!("{:<8} {:>24} {:>24} {:>24}", "", "r", "g", "b"))?;
        output.line(colour("rho_d", fit.model.rho_d, fit.uncertainty.rho_d))?;
        let lobes = fit.model.lobes.iter().zip(&fit.uncertainty.lobes).zip(material.lobes());
        for (j, ((lobe, error), params)) in lobes.enumerate() {
            output.line(format_args!("lobe {}", j + 1))?;
            lobe_lines(lobe, error).iter().try_for_each(|line| output.line(line))?;
            if let Some(masking) = params.masking() {
                let [lambda, c, k] = [masking.lambda, masking.c, masking.k].map(six_digits);
                output.line(format_args!("  masking lambda {lambda}, c {c}, k {k}"))?;
            }
        }
        Ok(())
    }

    fn print_errors(&self, output: &mut Output) -> Result<(), Failure> {
        output.line("")?;
        output.line(measured::ERRORS)?;
        output.line(measured::error_row("SGD", &self.chosen.distance))?;
        if let Some(free) = &self.free {
            output.line(measured::error_row("SGD, --energy free", free))?;
        }
        output.line(measured::error_row("glTF", &self.gltf_distance))?;
        if let Some(free) = &self.free {
            output.line(format_args!(
                "Conserving energy costs {:.2} ΔE2000.",
                self.chosen.distance.suns - free.suns
            ))?;
        }
        if self.chosen.distance.suns > FAR {
            output.line(
                "No isotropic SGD lobe follows this surface: its colour or its shape changes with \
                 the angle in another way.",
            )?;
        }
        Ok(())
    }
}

/// The numbers of a colour, each with its standard error.
fn colour(name: &str, values: [f64; 3], errors: [f64; 3]) -> String {
    let [r, g, b] = [0, 1, 2].map(|c| with_error(values[c], errors[c]));
    format!("{name:<8} {r:>24} {g:>24} {b:>24}")
}

fn with_error(value: f64, error: f64) -> String {
    format!("{} ± {error:.1e}", six_digits(value))
}

/// A line with one number and its standard error.
fn scalar(name: &str, value: f64, error: f64) -> String {
    format!("  {name:<6} {:>24}", with_error(value, error))
}

fn lobe_lines(lobe: &SgdLobe, error: &SgdLobe) -> [String; 5] {
    [
        scalar("alpha", lobe.alpha, error.alpha),
        scalar("p", lobe.p, error.p),
        colour("  rho_s", lobe.rho_s, error.rho_s),
        colour("  f0", lobe.f0, error.f0),
        colour("  f1", lobe.f1, error.f1),
    ]
}
