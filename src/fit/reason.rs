//! Remarks on a fit whose parameters alone would surprise.

use std::fmt;

use serde::{Serialize, Serializer};

use crate::brdf::model::fresnel;
use crate::material::{Channel, LobeParams, Material};

/// A remark on a fit. Written to JSON as its sentence.
#[derive(Clone, Debug, PartialEq)]
pub enum Reason {
    /// The channel's lobe is below what 16 bits show: its width is arbitrary.
    NoVisibleLobe(Channel),
    /// The published Fresnel factor goes below 0; the fit's never does.
    NegativeFresnel(Channel, f64),
    /// The published specular factor exceeds 1, so it reflects more than arrives.
    FresnelAboveOne(Channel, f64),
    /// The best width is the widest that the model has.
    WidestLobe(Channel),
    /// The glTF material is a metal: only core properties.
    Metal,
    /// Core properties alone leave this weighted residual; the specular extension lowers it.
    SpecularExtension {
        /// √∫(Δg)² with core properties alone.
        core: f64,
    },
    /// A glTF parameter is at the end of its range.
    AtRangeEnd(&'static str),
    /// A second lobe lowered the weighted residual from this value.
    Clearcoat {
        /// √∫(Δg)² without it.
        without: f64,
    },
}

impl fmt::Display for Reason {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoVisibleLobe(c) => {
                write!(out, "{}: no visible lobe; its width is the other channels'", c.name())
            }
            Self::NegativeFresnel(c, least) => write!(
                out,
                "{}: the published Fresnel factor falls to {least:.3}; the fit stays at or above 0",
                c.name()
            ),
            Self::FresnelAboveOne(c, most) => write!(
                out,
                "{}: the published specular factor rises to {most:.2}, above all light that arrives",
                c.name()
            ),
            Self::WidestLobe(c) => {
                write!(out, "{}: as wide as the model can be", c.name())
            }
            Self::Metal => {
                out.write_str("a metal: core properties alone come within 5 % of the best residual")
            }
            Self::SpecularExtension { core } => {
                write!(out, "core properties alone leave a weighted error of {core:.4}")
            }
            Self::AtRangeEnd(parameter) => write!(out, "{parameter} is at the end of its range"),
            Self::Clearcoat { without } => {
                write!(out, "without the clearcoat the weighted error is {without:.4}")
            }
        }
    }
}

impl Serialize for Reason {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// The albedo 4ρs·F of a colour's lobes up to which they are invisible next to 16-bit white.
const MIN_VISIBLE_ALBEDO: f64 = 1.0 / 65535.0;

/// Returns true if the specular term of a colour is visible: ∫ of a lobe is at most 4ρs·max F, D
/// only says how it is spread.
#[must_use]
pub fn has_visible_lobe(material: &Material, c: usize) -> bool {
    material.lobes().iter().map(|lobe| largest_albedo(lobe, c)).sum::<f64>() > MIN_VISIBLE_ALBEDO
}

/// 4 ρs max F.
fn largest_albedo(lobe: &LobeParams, c: usize) -> f64 {
    // A Fresnel factor that is negative everywhere darkens; it shows no lobe.
    4.0 * lobe.rho_s()[c] * fresnel(lobe)[c].range()[1].max(0.0)
}

/// The oddities of a material that bear on every fit.
#[must_use]
pub fn of_material(material: &Material) -> Vec<Reason> {
    Channel::ALL.into_iter().flat_map(|channel| of_channel(channel, material)).collect()
}

/// The remarks on one colour of a material.
fn of_channel(channel: Channel, material: &Material) -> Vec<Reason> {
    let c = channel as usize;
    // An invisible lobe's Fresnel range would be a remark on nothing.
    if !has_visible_lobe(material, c) {
        return vec![Reason::NoVisibleLobe(channel)];
    }
    let colouring = material.lobes().iter().filter(|lobe| lobe.rho_s()[c] > 0.0);
    colouring.flat_map(|lobe| of_fresnel(channel, lobe)).collect()
}

/// The remarks on the ranges of a lobe's Fresnel factor and of its specular factor 4ρs F/π.
fn of_fresnel(channel: Channel, lobe: &LobeParams) -> impl Iterator<Item = Reason> {
    let c = channel as usize;
    let [least, most] = fresnel(lobe)[c].range();
    let scaled = most * 4.0 * lobe.rho_s()[c] / std::f64::consts::PI;
    let negative = (least < 0.0).then_some(Reason::NegativeFresnel(channel, least));
    let above = (scaled > 1.0).then_some(Reason::FresnelAboveOne(channel, scaled));
    negative.into_iter().chain(above)
}
