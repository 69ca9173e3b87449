//! `sgdbake fit`: the best fits, how far they are and how far they look.

use clap::ValueEnum;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::selection::Materials;
use sgdbake::brdf::{Brdf, OneLobe, Reflectance};
use sgdbake::fit::gltf::GltfFit;
use sgdbake::fit::mixture::{MAX_COMPONENTS, MixtureFit};
use sgdbake::fit::one_lobe::OneLobeFit;
use sgdbake::fit::target::Residuals;
use sgdbake::fit::{Metric, Reason, Target, gltf, mixture, one_lobe};
use sgdbake::material::Material;
use sgdbake::microfacet::Family;
use sgdbake::report::appearance::{Appearance, ReferenceBall, evaluation_ns};

/// Fits simpler models to materials and prints their parameters, residuals, the colour difference
/// of a ball under one light, and what an evaluation costs.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  sgdbake fit --material gold-paint --model ggx,gltf\n  sgdbake fit --all --model mixture --components 8 --json"
)]
pub struct Arguments {
    #[command(flatten)]
    materials: Materials,
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

/// The result of a fit.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
enum Fit {
    OneLobe(Box<OneLobeFit>),
    Mixture(MixtureFit),
    Gltf(GltfFit),
}

/// A material's fit in one model.
#[derive(Serialize)]
struct Line<'a> {
    schema: &'static str,
    material: &'a str,
    model: &'static str,
    fit: &'a Fit,
    appearance: Vec<Appearance>,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let materials = arguments.materials.load()?;
    let progress = output.progress(materials.len() as u64, "fitting");
    let studies: Vec<Study<'_>> = materials
        .par_iter()
        .map(|material| {
            let study = Study::new(material, arguments);
            progress.inc(1);
            study
        })
        .collect();
    progress.finish_and_clear();
    if !arguments.json {
        output.line(HEADER)?;
    }
    studies.iter().try_for_each(|study| study.print(arguments.json, output))
}

/// A material's fits and their pictures.
struct Study<'a> {
    material: &'a Material,
    pairs: Vec<[DVec3; 2]>,
    fits: Vec<(Model, Fit, Vec<Pictured>)>,
}

/// A reflectance of a fit, and how different its ball is.
struct Pictured {
    of: &'static str,
    reflectance: Box<dyn Reflectance + Send>,
    residuals: Residuals,
    delta_e: [f64; 2],
}

/// Every so many of the target's pairs is evaluated for the time of an evaluation.
const TIMED: usize = 4;

impl<'a> Study<'a> {
    fn new(material: &'a Material, arguments: &Arguments) -> Self {
        let target = Target::new(material);
        let ball = ReferenceBall::new(material);
        let fit = |model: &Model| {
            let fit = model.fit(&target, arguments.components);
            let pictured = fit.reflectances(material);
            let pictured = pictured.into_iter().map(|(of, residuals, reflectance)| {
                let delta_e = ball.delta_e(&*reflectance);
                Pictured { of, reflectance, residuals, delta_e }
            });
            (*model, fit.clone(), pictured.collect())
        };
        let fits = arguments.model.iter().map(fit).collect();
        let pairs = target.pairs.iter().step_by(TIMED).map(|pair| [pair.wi, pair.wo]).collect();
        Self { material, pairs, fits }
    }

    fn print(&self, json: bool, output: &mut Output) -> Result<(), Failure> {
        for (model, fit, pictured) in &self.fits {
            let appearance: Vec<Appearance> =
                pictured.iter().map(|pictured| pictured.appearance(&self.pairs)).collect();
            let (material, model) = (self.material.name.as_str(), model.name());
            if json {
                let schema = "sgdbake/fit/1";
                output.json(&Line { schema, material, model, fit, appearance })?;
                continue;
            }
            for (pictured, appearance) in pictured.iter().zip(&appearance) {
                output.line(row(material, model, pictured, appearance))?;
            }
            output.line(format!("{:>24} {}", "", fit.parameters()))?;
            for reason in fit.reasons() {
                output.line(format!("{:>24} {reason}", ""))?;
            }
        }
        Ok(())
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

    fn fit(self, target: &Target, count: usize) -> Fit {
        let one_lobe = |family| {
            Fit::OneLobe(Box::new(one_lobe::fit_target(target, family, Metric::default())))
        };
        match self {
            Self::Beckmann => one_lobe(Family::Beckmann),
            Self::Ggx => one_lobe(Family::Ggx),
            Self::Mixture => Fit::Mixture(mixture::fit_target(target, count)),
            Self::Gltf => Fit::Gltf(gltf::fit_target(target, Metric::default())),
        }
    }
}

type Named = (&'static str, Residuals, Box<dyn Reflectance + Send>);

impl Fit {
    /// Each reflectance that the fit offers.
    fn reflectances(&self, material: &Material) -> Vec<Named> {
        match self {
            Self::OneLobe(fit) => vec![
                ("per channel", fit.per_channel_residuals, Box::new(fit.per_channel.brdf())),
                ("joint", fit.joint_residuals, Box::new(fit.joint.brdf())),
            ],
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
