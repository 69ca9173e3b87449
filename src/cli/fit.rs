//! `sgdbake fit`: the best fits, how far they are and how far they look.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::measured;
use crate::cli::output::Output;
use crate::cli::selection::Subjects;
use sgdbake::brdf::{Brdf, OneLobe, Reflectance};
use sgdbake::fit::gltf::GltfFit;
use sgdbake::fit::mixture::{MAX_COMPONENTS, MixtureFit, Objective};
use sgdbake::fit::one_lobe::OneLobeFit;
use sgdbake::fit::target::Residuals;
use sgdbake::fit::{
    Metric, Reason, Target, gltf, gltf_measured, mixture, one_lobe, one_lobe_measured,
};
use sgdbake::material::Material;
use sgdbake::measurement::Filled;
use sgdbake::microfacet::Family;
use sgdbake::report::appearance::{Appearance, ReferenceBall, evaluation_ns};
use sgdbake::report::distance::Distance;
use sgdbake::report::surface::{Surface, evaluated};

/// Fits simpler models to materials and prints their parameters, residuals, the colour difference
/// of a ball under one light, and what an evaluation costs.
///
/// Of a measurement, each model is fitted to the measurement itself, and beside that to the SGD
/// material that is fitted to it.
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
    /// Machine-readable output, one JSON object a line
    #[arg(long)]
    json: bool,
}

/// A model to fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Model {
    /// One Beckmann lobe, per channel and with one width for all three
    Beckmann,
    /// One GGX lobe, per channel and with one width for all three
    Ggx,
    /// Several Beckmann distributions with widths shared by the lobes
    Mixture,
    /// A glTF 2.0 material
    Gltf,
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

/// The result of a fit.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
enum Fit {
    OneLobe(Box<OneLobeFit>),
    Joint(Box<JointFit>),
    Mixture(MixtureFit),
    Gltf(GltfFit),
}

/// One lobe of one width, fitted to a measurement.
#[derive(Clone, Debug, Serialize)]
struct JointFit {
    joint: OneLobe,
    joint_residuals: Residuals,
    reasons: Vec<Reason>,
}

/// What a fit is made to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum FittedTo {
    Measurement,
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
    let of_material = |material: &Material| Ok(Study::of_material(material, arguments));
    let of_measurement = |path: &PathBuf| Study::of_measurement(path, arguments);
    let step = |_: &Result<Study, Failure>| progress.inc(1);
    let studies = materials.par_iter().map(of_material).inspect(step);
    let mut studies: Vec<Study> = studies.collect::<Result<_, _>>()?;
    // One after the other: each may take as much memory as two of its files.
    let measured = subjects.measured.iter().map(of_measurement).inspect(step);
    studies.extend(measured.collect::<Result<Vec<_>, _>>()?);
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
    /// The fit to the SGD material of a measurement, beside that to the measurement.
    of_sgd: Option<(Fit, Vec<Pictured>)>,
}

/// A reflectance of a fit, and how different its ball is.
struct Pictured {
    of: &'static str,
    reflectance: Box<dyn Reflectance + Send>,
    residuals: Residuals,
    delta_e: [f64; 2],
    /// From a measurement.
    distance: Option<Distance>,
}

/// Every so many of the target's pairs is evaluated for the time of an evaluation.
const TIMED: usize = 4;

impl Study {
    fn of_material(material: &Material, arguments: &Arguments) -> Self {
        let target = Target::new(material);
        let ball = ReferenceBall::new(material);
        let fit = |model: &Model| {
            let fit = model.fit(&target, arguments.components, arguments.objective.into());
            let pictured = fit.pictured(material, &ball, None);
            Fitted { model: *model, fit, pictured, fitted_to: FittedTo::Sgd, of_sgd: None }
        };
        let fits = arguments.model.iter().map(fit).collect();
        Self { name: material.name.clone(), pairs: timed(&target), fits, sgd: None }
    }

    fn of_measurement(path: &Path, arguments: &Arguments) -> Result<Self, Failure> {
        let (measurement, surface, sgd) = measured::surface_and_fit(path)?;
        let material = &sgd.material;
        let target = Target::new(material);
        let ball = ReferenceBall::of(&Filled(&measurement.averaged()));
        let fit = |model: &Model| {
            let of_sgd = model.fit(&target, arguments.components, arguments.objective.into());
            let of_sgd = (of_sgd.pictured(material, &ball, Some(&surface)), of_sgd);
            let (fitted_to, (pictured, fit), of_sgd) = match model.fit_measured(&surface) {
                Some(fit) => {
                    let pictured = fit.pictured(material, &ball, Some(&surface));
                    let (of_pictured, of_fit) = of_sgd;
                    (FittedTo::Measurement, (pictured, fit), Some((of_fit, of_pictured)))
                }
                None => (FittedTo::Sgd, of_sgd, None),
            };
            Fitted { model: *model, fit, pictured, fitted_to, of_sgd }
        };
        Ok(Self {
            name: material.name.clone(),
            pairs: timed(&target),
            fits: arguments.model.iter().map(fit).collect(),
            sgd: Some(surface.reference.distance(&evaluated(material))),
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
                    FittedTo::Measurement => name.to_owned(),
                    FittedTo::Sgd => format!("{name}, {} of SGD", pictured.of),
                };
                output.line(measured::error_row(&row, distance))?;
            }
        }
        Ok(())
    }
}

/// The pairs that evaluations are timed on.
fn timed(target: &Target) -> Vec<[DVec3; 2]> {
    target.pairs.iter().step_by(TIMED).map(|pair| [pair.wi, pair.wo]).collect()
}

impl Fitted {
    fn print(&self, study: &Study, json: bool, output: &mut Output) -> Result<(), Failure> {
        let Self { model, fit, pictured, .. } = self;
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
        // The last reflectance of a fit is the one with a single width, which engines take.
        let distance = |pictured: &[Pictured]| pictured.last()?.distance;
        let of_sgd = self
            .of_sgd
            .as_ref()
            .and_then(|(fit, pictured)| Some(OfSgd { fit, distance: distance(pictured)? }));
        let distance = distance(&self.pictured)?;
        Some(AgainstMeasurement { fitted_to: self.fitted_to, distance, of_sgd })
    }
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

impl Model {
    fn name(self) -> &'static str {
        match self {
            Self::Beckmann => "beckmann",
            Self::Ggx => "ggx",
            Self::Mixture => "mixture",
            Self::Gltf => "gltf",
        }
    }

    fn fit(self, target: &Target, count: usize, objective: Objective) -> Fit {
        let one_lobe = |family| {
            Fit::OneLobe(Box::new(one_lobe::fit_target(target, family, Metric::default())))
        };
        match self {
            Self::Beckmann => one_lobe(Family::Beckmann),
            Self::Ggx => one_lobe(Family::Ggx),
            Self::Mixture => Fit::Mixture(mixture::fit_target(target, count, objective)),
            Self::Gltf => Fit::Gltf(gltf::fit_target(target, Metric::default())),
        }
    }

    /// The fit to a measurement itself; none of a mixture, which describes an SGD lobe.
    fn fit_measured(self, surface: &Surface) -> Option<Fit> {
        let residuals = |fit: &dyn Reflectance| surface.reference.residuals(fit);
        let one_lobe = |family| {
            let joint = one_lobe_measured::fit(&surface.target, family);
            let joint_residuals = residuals(&joint.brdf());
            Fit::Joint(Box::new(JointFit { joint, joint_residuals, reasons: Vec::new() }))
        };
        match self {
            Self::Beckmann => Some(one_lobe(Family::Beckmann)),
            Self::Ggx => Some(one_lobe(Family::Ggx)),
            Self::Mixture => None,
            Self::Gltf => {
                let material = gltf_measured::fit(&surface.target).material;
                let residuals = residuals(&material);
                Some(Fit::Gltf(GltfFit { material, residuals, reasons: Vec::new() }))
            }
        }
    }
}

type Named = (&'static str, Residuals, Box<dyn Reflectance + Send>);

impl Fit {
    /// Each reflectance that the fit offers, with its picture and its distance from a surface.
    fn pictured(
        &self,
        material: &Material,
        ball: &ReferenceBall,
        surface: Option<&Surface>,
    ) -> Vec<Pictured> {
        let pictured = |(of, residuals, reflectance): Named| {
            let delta_e = ball.delta_e(&*reflectance);
            let distance = surface.map(|surface| surface.reference.distance(&*reflectance));
            Pictured { of, reflectance, residuals, delta_e, distance }
        };
        self.reflectances(material).into_iter().map(pictured).collect()
    }

    /// Each reflectance that the fit offers.
    fn reflectances(&self, material: &Material) -> Vec<Named> {
        match self {
            Self::OneLobe(fit) => vec![
                ("per channel", fit.per_channel_residuals, Box::new(fit.per_channel.brdf())),
                ("joint", fit.joint_residuals, Box::new(fit.joint.brdf())),
            ],
            Self::Joint(fit) => vec![("joint", fit.joint_residuals, Box::new(fit.joint.brdf()))],
            Self::Mixture(fit) => {
                let brdf = Brdf::of_mixture(material, &fit.mixture);
                vec![("mixture", fit.residuals, Box::new(brdf))]
            }
            Self::Gltf(fit) => vec![("material", fit.residuals, Box::new(fit.material))],
        }
    }

    fn reasons(&self) -> &[Reason] {
        match self {
            Self::OneLobe(fit) => &fit.reasons,
            Self::Joint(fit) => &fit.reasons,
            Self::Mixture(fit) => &fit.reasons,
            Self::Gltf(fit) => &fit.reasons,
        }
    }

    /// The parameters in words.
    fn parameters(&self) -> String {
        match self {
            Self::OneLobe(fit) => {
                let alpha = |fit: &OneLobe| fit.channels.map(|c| c.alpha);
                let [r, g, b] = alpha(&fit.per_channel);
                format!("alpha {r:.4} {g:.4} {b:.4}; joint {:.4}", fit.joint.channels[0].alpha)
            }
            Self::Joint(fit) => format!("alpha {:.4}", fit.joint.channels[0].alpha),
            Self::Mixture(fit) => {
                let numbers = |digits: usize, numbers: &[f64]| -> String {
                    let texts: Vec<String> =
                        numbers.iter().map(|n| format!("{n:.digits$}")).collect();
                    texts.join(" ")
                };
                let (alpha, error) = (numbers(4, &fit.mixture.alpha), numbers(5, &fit.ndf_error));
                format!("alpha {alpha}; error of D {error}")
            }
            Self::Gltf(fit) => {
                let m = &fit.material;
                let coat =
                    m.clearcoat.zip(m.clearcoat_roughness).map_or_else(String::new, |(c, r)| {
                        format!(", clearcoat {c:.3} roughness {r:.3}")
                    });
                format!(
                    "base {:.3?}, metallic {:.3}, roughness {:.3}, specular {:.3} {:.3?}{coat}",
                    m.base_color, m.metallic, m.roughness, m.specular_factor, m.specular_color
                )
            }
        }
    }
}

fn component_count(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (1..=MAX_COMPONENTS).contains(&count) => Ok(count),
        _ => Err(format!("must be between 1 and {MAX_COMPONENTS}")),
    }
}
