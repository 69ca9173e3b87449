//! The models of `sgdbake fit`: each fitted to a material or to a measurement.

use clap::ValueEnum;
use serde::Serialize;

use sgdbake::asset::{Distances, GltfAt, OneLobeAt, direct_fits_of};
use sgdbake::brdf::{Brdf, OneLobe, Reflectance};
use sgdbake::fit::gltf::GltfFit;
use sgdbake::fit::mixture::{MixtureFit, Objective};
use sgdbake::fit::mixture_measured::MeasuredMixture;
use sgdbake::fit::one_lobe::OneLobeFit;
use sgdbake::fit::target::Residuals;
use sgdbake::fit::{
    Metric, Reason, Target, gltf, gltf_measured, mixture, mixture_measured, one_lobe,
    one_lobe_measured,
};
use sgdbake::material::Material;
use sgdbake::microfacet::Family;
use sgdbake::report::surface::Surface;

/// A model to fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Model {
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
// Untagged, as a line of the report has the name of the model already.
#[serde(untagged)]
pub enum Fit {
    /// One lobe.
    OneLobe(Box<OneLobeFit>),
    /// One lobe of one width, as the catalogue holds it.
    Joint(Box<JointFit>),
    /// A mixture in place of the distributions of a material.
    Mixture(MixtureFit),
    /// A mixture, its colours fitted to a measurement too.
    MeasuredMixture(Box<MeasuredMixtureFit>),
    /// A glTF material.
    Gltf(GltfFit),
}

/// One lobe of one width.
#[derive(Clone, Debug, Serialize)]
pub struct JointFit {
    joint: OneLobe,
    joint_residuals: Residuals,
    reasons: Vec<Reason>,
}

/// A mixture that was fitted to a measurement.
#[derive(Clone, Debug, Serialize)]
pub struct MeasuredMixtureFit {
    #[serde(flatten)]
    mixture: MeasuredMixture,
    residuals: Residuals,
    reasons: Vec<Reason>,
}

/// A fit that the catalogue holds.
pub struct Carried {
    /// The fit.
    pub fit: Fit,
    /// Its distance from the measurement.
    pub distance: Distances,
}

impl Carried {
    /// A lobe of the catalogue; its residuals are those to the material.
    fn one_lobe(OneLobeAt { lobe, error }: &OneLobeAt, target: &Target) -> Self {
        let joint_residuals = target.residuals(&lobe.brdf());
        let fit = JointFit { joint: *lobe, joint_residuals, reasons: Vec::new() };
        Self { fit: Fit::Joint(Box::new(fit)), distance: *error }
    }
}

/// A name, residuals and a reflectance of a fit.
pub type Named = (&'static str, Residuals, Box<dyn Reflectance + Send>);

impl Model {
    /// The model's name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Beckmann => "beckmann",
            Self::Ggx => "ggx",
            Self::Mixture => "mixture",
            Self::Gltf => "gltf",
        }
    }

    /// The fit to a material.
    #[must_use]
    pub fn fit(self, target: &Target, components: usize, objective: Objective) -> Fit {
        match self {
            Self::Beckmann => Fit::one_lobe_of_sgd(target, Family::Beckmann),
            Self::Ggx => Fit::one_lobe_of_sgd(target, Family::Ggx),
            Self::Mixture => Fit::Mixture(mixture::fit_target(target, components, objective)),
            Self::Gltf => Fit::Gltf(gltf::fit_target(target, Metric::default())),
        }
    }

    /// The fit to a measurement; `of_sgd` is the one to `material`, the SGD of that measurement,
    /// where a mixture starts from.
    #[must_use]
    pub fn fit_measured(self, surface: &Surface, material: &Material, of_sgd: &Fit) -> Fit {
        match (self, of_sgd) {
            (Self::Ggx, _) => Fit::one_lobe(surface, Family::Ggx),
            (Self::Mixture, Fit::Mixture(of_sgd)) => {
                let start = MeasuredMixture::of_material(material, of_sgd.mixture.clone());
                let mixture = mixture_measured::fit(&surface.target, &start);
                let residuals = surface.reference.residuals(&mixture.brdf());
                let fit = MeasuredMixtureFit { mixture, residuals, reasons: Vec::new() };
                Fit::MeasuredMixture(Box::new(fit))
            }
            // `of_sgd` is the fit in the same model, so a mixture is always caught above.
            (Self::Beckmann | Self::Mixture, _) => Fit::one_lobe(surface, Family::Beckmann),
            (Self::Gltf, _) => {
                let material = gltf_measured::fit(&surface.target).material;
                let residuals = surface.reference.residuals(&material);
                Fit::Gltf(GltfFit { material, residuals, reasons: Vec::new() })
            }
        }
    }

    /// The fit to the measurement of a refitted material, as the catalogue holds it; its residuals
    /// are those to the material.
    #[must_use]
    pub fn carried(self, target: &Target) -> Option<Carried> {
        let fits = direct_fits_of(&target.material)?;
        match self {
            Self::Beckmann => Some(Carried::one_lobe(&fits.beckmann.measured, target)),
            Self::Ggx => Some(Carried::one_lobe(&fits.ggx.measured, target)),
            // The measurement is not at hand, and no mixture is in the catalogue.
            Self::Mixture => None,
            Self::Gltf => {
                let GltfAt { material, error, .. } = fits.gltf.measured;
                let residuals = target.residuals(&material);
                let fit = GltfFit { material, residuals, reasons: Vec::new() };
                Some(Carried { fit: Fit::Gltf(fit), distance: error })
            }
        }
    }
}

impl Fit {
    /// One lobe for a material.
    fn one_lobe_of_sgd(target: &Target, family: Family) -> Self {
        Self::OneLobe(Box::new(one_lobe::fit_target(target, family, Metric::default())))
    }

    /// One lobe fitted to a measurement.
    fn one_lobe(surface: &Surface, family: Family) -> Self {
        let joint = one_lobe_measured::fit(&surface.target, family);
        let per_channel = one_lobe_measured::fit_per_channel(&surface.target, &joint);
        let [joint_residuals, per_channel_residuals] =
            [joint, per_channel].map(|fit| surface.reference.residuals(&fit.brdf()));
        Self::OneLobe(Box::new(OneLobeFit {
            per_channel,
            joint,
            per_channel_residuals,
            joint_residuals,
            reasons: Vec::new(),
        }))
    }

    /// Each reflectance that the fit offers, the one that engines take last.
    #[must_use]
    pub fn reflectances(&self, material: &Material) -> Vec<Named> {
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
            Self::MeasuredMixture(fit) => {
                vec![("mixture", fit.residuals, Box::new(fit.mixture.brdf()))]
            }
            Self::Gltf(fit) => vec![("material", fit.residuals, Box::new(fit.material))],
        }
    }

    /// What is odd about the fit.
    #[must_use]
    pub fn reasons(&self) -> &[Reason] {
        match self {
            Self::OneLobe(fit) => &fit.reasons,
            Self::Joint(fit) => &fit.reasons,
            Self::Mixture(fit) => &fit.reasons,
            Self::MeasuredMixture(fit) => &fit.reasons,
            Self::Gltf(fit) => &fit.reasons,
        }
    }

    /// The parameters in words.
    #[must_use]
    pub fn parameters(&self) -> String {
        match self {
            Self::OneLobe(fit) => {
                let [r, g, b] = fit.per_channel.channels.map(|channel| channel.alpha);
                format!("alpha {r:.4} {g:.4} {b:.4}; joint {:.4}", fit.joint.channels[0].alpha)
            }
            Self::Joint(fit) => format!("alpha {:.4}", fit.joint.channels[0].alpha),
            Self::Mixture(fit) => {
                let (alpha, error) =
                    (numbers::<4>(&fit.mixture.alpha), numbers::<5>(&fit.ndf_error));
                format!("alpha {alpha}; error of D {error}")
            }
            Self::MeasuredMixture(fit) => {
                format!("alpha {}", numbers::<4>(&fit.mixture.mixture.alpha))
            }
            Self::Gltf(fit) => gltf_parameters(fit),
        }
    }
}

fn gltf_parameters(GltfFit { material: m, .. }: &GltfFit) -> String {
    let coat = m
        .clearcoat
        .zip(m.clearcoat_roughness)
        .map_or_else(String::new, |(c, r)| format!(", clearcoat {c:.3} roughness {r:.3}"));
    format!(
        "base {:.3?}, metallic {:.3}, roughness {:.3}, specular {:.3} {:.3?}{coat}",
        m.base_color, m.metallic, m.roughness, m.specular_factor, m.specular_color
    )
}

/// Numbers to so many digits.
fn numbers<const DIGITS: usize>(numbers: &[f64]) -> String {
    numbers.iter().map(|n| format!("{n:.DIGITS$}")).collect::<Vec<_>>().join(" ")
}
