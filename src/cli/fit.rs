//! `sgdbake fit`: the best fits, how far they are and how far they look.

use std::path::Path;

use clap::ValueEnum;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::measured;
use crate::cli::model_fit::{Carried, Fit, Model};
use crate::cli::output::Output;
use crate::cli::selection::Subjects;
use sgdbake::asset::direct_fits_of;
use sgdbake::brdf::Reflectance;
use sgdbake::fit::mixture::{MAX_COMPONENTS, Objective};
use sgdbake::fit::target::Residuals;
use sgdbake::fit::{Metric, Target};
use sgdbake::material::Material;
use sgdbake::measurement::Filled;
use sgdbake::report::appearance::{Appearance, ReferenceBall, evaluation_ns};
use sgdbake::report::distance::Distance;
use sgdbake::report::surface::{Surface, evaluated};

/// Fits simpler models to materials and prints their parameters, residuals, the colour difference
/// of a ball under one light, and what an evaluation costs.
///
/// Of a measurement, each model is fitted to the measurement itself, and beside that to the SGD
/// material that is fitted to it. Of a refitted material of the catalogue, the fits to its
/// measurement are shown; a mixture is then fitted to the SGD.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  sgdbake fit --material gold-paint --model ggx,gltf\n  sgdbake fit --all --model mixture --components 8 --json\n  sgdbake fit --measured paint.binary --model gltf --json"
)]
pub struct Arguments {
    #[command(flatten)]
    subjects: Subjects,
    /// The models to fit
    #[arg(
        long,
        value_enum,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "beckmann,ggx,mixture,gltf"
    )]
    model: Vec<Model>,
    /// Beckmann distributions of the model 'mixture', from 1 to 32
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = component_count)]
    components: usize,
    /// The measure of the errors of the model 'mixture'
    #[arg(long, value_enum, default_value_t)]
    objective: ObjectiveChoice,
    /// What the models are fitted to
    #[arg(long, value_enum, default_value_t)]
    to: FittedTo,
    /// Machine-readable output, one JSON object a line
    #[arg(long)]
    json: bool,
}

/// The measure of a mixture's errors by its name on the command line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum ObjectiveChoice {
    /// The sum of their squares
    LeastSquares,
    /// The largest of them
    #[default]
    Minimax,
}

impl From<ObjectiveChoice> for Objective {
    fn from(choice: ObjectiveChoice) -> Self {
        match choice {
            ObjectiveChoice::LeastSquares => Self::LeastSquares,
            ObjectiveChoice::Minimax => Self::Minimax,
        }
    }
}

/// What a fit is made to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
enum FittedTo {
    /// The measured surface where one is known, else the SGD material
    #[default]
    Measurement,
    /// The SGD material
    Sgd,
}

/// How far a fit is from a measurement.
#[derive(Serialize)]
struct AgainstMeasurement<'a> {
    fitted_to: FittedTo,
    distance: Distance,
    /// The fit to the SGD material of the measurement, where `fitted_to` is the measurement.
    #[serde(skip_serializing_if = "Option::is_none")]
    of_sgd: Option<OfSgd<'a>>,
}

#[derive(Serialize)]
struct OfSgd<'a> {
    fit: &'a Fit,
    distance: Distance,
}

/// A material's fit in one model.
#[derive(Serialize)]
struct Line<'a> {
    schema: &'static str,
    material: &'a str,
    model: &'static str,
    fit: &'a Fit,
    appearance: Vec<Appearance>,
    #[serde(skip_serializing_if = "Option::is_none")]
    measured: Option<AgainstMeasurement<'a>>,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let subjects = &arguments.subjects;
    let materials = subjects.materials(output)?;
    let count = materials.len() + subjects.measured.len();
    let progress = output.progress(count as u64, "fitting");
    let studies = materials.par_iter().map(|material| Study::of_material(material, arguments));
    let mut studies: Vec<Study> = studies.inspect(|_| progress.inc(1)).collect();
    // One after the other: each may take as much memory as two of its files.
    for path in &subjects.measured {
        studies.push(Study::of_measurement(path, arguments)?);
        progress.inc(1);
    }
    progress.finish_and_clear();
    if !arguments.json {
        output.line(HEADER)?;
    }
    studies.iter().try_for_each(|study| study.print(arguments.json, output))
}

/// The fits to a material or a measurement, and their pictures.
struct Study {
    name: String,
    pairs: Vec<[DVec3; 2]>,
    fits: Vec<Fitted>,
    /// The SGD material of a measurement.
    sgd: Option<Distance>,
}

/// A fit in one model.
struct Fitted {
    model: Model,
    fit: Fit,
    pictured: Vec<Pictured>,
    fitted_to: FittedTo,
    /// The fit to the SGD material of a measurement, in addition to the one to the measurement.
    of_sgd: Option<(Fit, Vec<Pictured>)>,
}

/// A reflectance of a fit, and how different its ball is.
struct Pictured {
    of: &'static str,
    reflectance: Box<dyn Reflectance + Send>,
    residuals: Residuals,
    delta_e: [f64; 2],
    /// Its distance from a measurement.
    distance: Option<Distance>,
}

/// Step through the target's pairs to those that evaluations are timed on.
const TIMED: usize = 4;

impl Study {
    fn of_material(material: &Material, arguments: &Arguments) -> Self {
        let target = Target::new(material);
        let ball = ReferenceBall::new(material);
        let fits = arguments.model.iter().map(|model| arguments.fit(*model, &target, &ball));
        let fits: Vec<Fitted> = fits.collect();
        let known = fits.iter().any(|fitted| fitted.fitted_to == FittedTo::Measurement);
        // The distance of the SGD itself is shown beside that of a fit to the measurement only.
        let known = direct_fits_of(material).filter(|_| known);
        Self {
            name: material.name.clone(),
            pairs: timed(&target),
            fits,
            sgd: known.map(|fits| fits.refit.into()),
        }
    }

    fn of_measurement(path: &Path, arguments: &Arguments) -> Result<Self, Failure> {
        let (measurement, surface, sgd) = measured::surface_and_fit(path)?;
        let target = Target::new(&sgd.material);
        // A ball also shows pairs that were not measured, so the gaps are filled.
        let ball = ReferenceBall::of(&Filled(&measurement.averaged()));
        let fits = arguments.model.iter();
        let fits = fits.map(|model| arguments.fit_measured(*model, &target, &ball, &surface));
        Ok(Self {
            name: sgd.material.name.clone(),
            pairs: timed(&target),
            fits: fits.collect(),
            sgd: Some(surface.reference.distance(&evaluated(&sgd.material))),
        })
    }

    fn print(&self, json: bool, output: &mut Output) -> Result<(), Failure> {
        self.fits.iter().try_for_each(|fitted| fitted.print(self, json, output))?;
        if json { Ok(()) } else { self.print_distances(output) }
    }

    /// The distances of all models from a measurement.
    fn print_distances(&self, output: &mut Output) -> Result<(), Failure> {
        let Some(sgd) = &self.sgd else { return Ok(()) };
        output.line("")?;
        output.line(measured::ERRORS)?;
        output.line(measured::error_row("SGD", sgd))?;
        for fitted in &self.fits {
            let direct = fitted.pictured.iter().map(|pictured| (pictured, fitted.fitted_to));
            let of_sgd = fitted.of_sgd.iter().flat_map(|(_, pictured)| pictured);
            for (pictured, to) in direct.chain(of_sgd.map(|pictured| (pictured, FittedTo::Sgd))) {
                let Some(distance) = &pictured.distance else { continue };
                let name = fitted.model.name();
                let row = match to {
                    // A name tells reflectances of one fit apart; a single one needs none.
                    FittedTo::Measurement if fitted.pictured.len() == 1 => name.to_owned(),
                    FittedTo::Measurement => format!("{name}, {}", pictured.of),
                    FittedTo::Sgd => format!("{name}, {} of SGD", pictured.of),
                };
                output.line(measured::error_row(&row, distance))?;
            }
        }
        Ok(())
    }
}

impl Arguments {
    /// A model of a material: the catalogue's fit to its measurement, or one to the material.
    fn fit(&self, model: Model, target: &Target, ball: &ReferenceBall) -> Fitted {
        let material = &target.material;
        let carried = (self.to == FittedTo::Measurement).then(|| model.carried(target)).flatten();
        let Some(Carried { fit, distance }) = carried else {
            let fit = model.fit(target, self.components, self.objective.into());
            let pictured = pictured(&fit, material, ball, |_| None);
            return Fitted { model, fit, pictured, fitted_to: FittedTo::Sgd, of_sgd: None };
        };
        // A fit of the catalogue offers one reflectance, the one whose distance is stated.
        let pictured = pictured(&fit, material, ball, |_| Some(distance.into()));
        Fitted { model, fit, pictured, fitted_to: FittedTo::Measurement, of_sgd: None }
    }

    /// A model of a measurement, and of the SGD material `target` of it.
    fn fit_measured(
        &self,
        model: Model,
        target: &Target,
        ball: &ReferenceBall,
        surface: &Surface,
    ) -> Fitted {
        let material = &target.material;
        let of_sgd = model.fit(target, self.components, self.objective.into());
        let (fit, of_sgd) = match self.to {
            FittedTo::Sgd => (of_sgd, None),
            FittedTo::Measurement => (model.fit_measured(surface, material, &of_sgd), Some(of_sgd)),
        };
        Fitted {
            model,
            pictured: pictured_beside(surface, &fit, material, ball),
            fit,
            fitted_to: self.to,
            of_sgd: of_sgd.map(|fit| {
                let pictured = pictured_beside(surface, &fit, material, ball);
                (fit, pictured)
            }),
        }
    }
}

/// Each reflectance that a fit offers, with its picture and its distance from a measurement.
fn pictured(
    fit: &Fit,
    material: &Material,
    ball: &ReferenceBall,
    distance: impl Fn(&dyn Reflectance) -> Option<Distance>,
) -> Vec<Pictured> {
    let reflectances = fit.reflectances(material).into_iter();
    let pictured = reflectances.map(|(of, residuals, reflectance)| Pictured {
        of,
        residuals,
        delta_e: ball.delta_e(&*reflectance),
        distance: distance(&*reflectance),
        reflectance,
    });
    pictured.collect()
}

/// The same with the distances from a measured surface.
fn pictured_beside(
    surface: &Surface,
    fit: &Fit,
    material: &Material,
    ball: &ReferenceBall,
) -> Vec<Pictured> {
    pictured(fit, material, ball, |model| Some(surface.reference.distance(model)))
}

/// The pairs that evaluations are timed on.
fn timed(target: &Target) -> Vec<[DVec3; 2]> {
    target.pairs.iter().step_by(TIMED).map(|pair| [pair.wi, pair.wo]).collect()
}

impl Fitted {
    fn print(&self, study: &Study, json: bool, output: &mut Output) -> Result<(), Failure> {
        let Self { model, fit, pictured, .. } = self;
        // Evaluations are timed here, one after the other, when no fit runs any more.
        let appearance: Vec<Appearance> =
            pictured.iter().map(|pictured| pictured.appearance(&study.pairs)).collect();
        let (material, model) = (study.name.as_str(), model.name());
        if json {
            let (schema, measured) = ("sgdbake/fit/1", self.against_measurement());
            return output.json(&Line { schema, material, model, fit, appearance, measured });
        }
        for (pictured, appearance) in pictured.iter().zip(&appearance) {
            output.line(row(material, model, pictured, appearance))?;
        }
        output.line(format!("{:>24} {}", "", fit.parameters()))?;
        for reason in fit.reasons() {
            output.line(format!("{:>24} {reason}", ""))?;
        }
        Ok(())
    }

    fn against_measurement(&self) -> Option<AgainstMeasurement<'_>> {
        let of_sgd = self
            .of_sgd
            .as_ref()
            .and_then(|(fit, pictured)| Some(OfSgd { fit, distance: engine_distance(pictured)? }));
        let distance = engine_distance(&self.pictured)?;
        Some(AgainstMeasurement { fitted_to: self.fitted_to, distance, of_sgd })
    }
}

/// The distance of the last reflectance of a fit: the one with a single width, which engines take.
fn engine_distance(pictured: &[Pictured]) -> Option<Distance> {
    pictured.last()?.distance
}

const HEADER: &str = "material                 model    reflectance residual r       g       b  \
                      ΔE mean   max ns/eval";

fn row(material: &str, model: &str, pictured: &Pictured, appearance: &Appearance) -> String {
    let [r, g, b] = pictured.residuals.in_metric(Metric::default());
    let Appearance { of, delta_e_mean, delta_e_max, evaluation_ns } = appearance;
    format!(
        "{material:<24} {model:<8} {of:<12} {r:>8.5} {g:>7.5} {b:>7.5} {delta_e_mean:>8.3} \
         {delta_e_max:>5.2} {evaluation_ns:>7.0}"
    )
}

impl Pictured {
    fn appearance(&self, pairs: &[[DVec3; 2]]) -> Appearance {
        let [delta_e_mean, delta_e_max] = self.delta_e;
        let evaluation_ns = evaluation_ns(&*self.reflectance, pairs);
        Appearance { of: self.of, delta_e_mean, delta_e_max, evaluation_ns }
    }
}

fn component_count(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (1..=MAX_COMPONENTS).contains(&count) => Ok(count),
        _ => Err(format!("must be between 1 and {MAX_COMPONENTS}")),
    }
}
