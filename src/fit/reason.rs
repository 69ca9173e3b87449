//! Why a fit is the way it is, where its parameters alone would surprise.

use std::fmt;

use serde::{Serialize, Serializer};

use crate::material::{Channel, ChannelParams, Material};
use crate::microfacet::Fresnel;

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
    /// A glTF parameter stands at the end of its range.
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
                write!(out, "core properties alone leave an error of {core:.4} in lightness")
            }
            Self::AtRangeEnd(parameter) => write!(out, "{parameter} is at the end of its range"),
            Self::Clearcoat { without } => {
                write!(out, "without the clearcoat the error in lightness is {without:.4}")
            }
        }
    }
}

impl Serialize for Reason {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Specular scale 4ρs/π · peak of F · D(0) below which a channel's lobe is invisible next to
/// 16-bit white.
const INVISIBLE: f64 = 1.0 / 65535.0;

/// Whether a channel's specular term is visible anywhere near its peak.
#[must_use]
pub fn has_visible_lobe(channel: &ChannelParams) -> bool {
    // ∫ of the lobe is at most 4ρs/π·F·π; D only says how it is spread.
    let (_, most) = fresnel_range(channel);
    4.0 * channel.rho_s * most.max(0.0) > INVISIBLE
}

/// What is odd about the published channels and bears on every fit.
#[must_use]
pub fn of_material(material: &Material) -> Vec<Reason> {
    let channels = Channel::ALL.into_iter().zip(&material.channels);
    channels.flat_map(|(name, params)| of_channel(name, params)).collect()
}

fn of_channel(name: Channel, params: &ChannelParams) -> Vec<Reason> {
    if !has_visible_lobe(params) {
        return vec![Reason::NoVisibleLobe(name)];
    }
    let (least, most) = fresnel_range(params);
    let scaled = most * 4.0 * params.rho_s / std::f64::consts::PI;
    let negative = (least < 0.0).then_some(Reason::NegativeFresnel(name, least));
    let above = (scaled > 1.0).then_some(Reason::FresnelAboveOne(name, scaled));
    negative.into_iter().chain(above).collect()
}

/// The least and largest F over cosθd in \[0, 1\].
fn fresnel_range(params: &ChannelParams) -> (f64, f64) {
    let fresnel = Fresnel { f0: params.f0, f1: params.f1 };
    let values = (0..=64).map(|i| fresnel.eval(f64::from(i) / 64.0));
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (l.min(v), m.max(v)))
}
