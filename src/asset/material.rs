//! A material in files: the part that manifest and glTF extension share.

use serde::{Deserialize, Serialize};

use crate::brdf::lobes::Lobes;
use crate::lut::Placed;
use crate::material::{ChannelParams, MaskingParams};

/// The parameters of a material.
///
/// # Formula
///
/// f = diffuse/π + Σ_lobes (rho_s/π) F D G/(cosθi cosθo), all of it per colour, linear RGB.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// The material's name.
    pub name: String,
    /// Diffuse albedo ρd.
    pub diffuse: [f64; 3],
    /// None to three lobes.
    pub lobes: Vec<LobeEntry>,
}

/// The parameters of a lobe: one distribution and its masking, Fresnel and scale per colour.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LobeEntry {
    /// Width α of the distribution: a *squared* Beckmann width.
    pub alpha: f64,
    /// Exponent p of the power-law factor t^{−p}.
    pub p: f64,
    /// The published form of the masking function.
    pub masking: MaskingParams,
    /// Specular scale ρs.
    pub rho_s: [f64; 3],
    /// Fresnel parameter f0.
    pub f0: [f64; 3],
    /// Fresnel parameter f1; F(0°) = f0 − f1.
    pub f1: [f64; 3],
}

/// A material with what a renderer needs beside its parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaterialEntry {
    /// Its parameters.
    #[serde(flatten)]
    pub parameters: Parameters,
    /// D(0) of each lobe \[1/sr\].
    pub ndf_peak: Vec<f64>,
    /// The distribution of each lobe as a Beckmann mixture.
    pub mixture: MixtureEntry,
    /// Its row in the `ndf` and `masking` textures, a third of its first row in `albedo`; `None`
    /// without a visible lobe.
    pub row: Option<usize>,
    /// The row of each lobe in the `fresnel` texture; empty without a visible lobe.
    pub fresnel_rows: Vec<usize>,
    /// How far the parameters are from the measurement.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<StatedError>,
}

/// Beckmann mixtures that share their widths:
/// D_j = Σ_i weights\[i\]\[j\] · D_beckmann(alpha\[i\]) for lobe j.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MixtureEntry {
    /// Beckmann widths, ascending.
    pub alpha: Vec<f64>,
    /// The weight of each width, one per lobe; a lobe's weights are ≥ 0 and sum to 1.
    pub weights: Vec<Vec<f64>>,
}

/// The distance of a material from the measurement that it describes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StatedError {
    /// ΔE2000 of a ball under one light.
    pub delta_e: f64,
    /// The measurement.
    pub source: String,
}

impl MaterialEntry {
    /// The entry of a baked material and its mixture: a lobe for each channel, of that colour
    /// alone; the three share their row of Fresnel curves.
    #[must_use]
    pub fn new(placed: &Placed, mixture: &Lobes) -> Self {
        let lobes: Vec<LobeEntry> = (0..3).map(|c| lobe(&placed.channels[c], c)).collect();
        Self {
            parameters: Parameters {
                name: placed.name.clone(),
                diffuse: placed.channels.map(|channel| channel.rho_d),
                lobes,
            },
            ndf_peak: placed.ndf_peak.to_vec(),
            mixture: MixtureEntry {
                alpha: mixture.alpha.clone(),
                weights: mixture.weights.iter().map(|weights| weights.to_vec()).collect(),
            },
            row: placed.row,
            fresnel_rows: placed.row.map_or_else(Vec::new, |row| vec![row; 3]),
            error: None,
        }
    }
}

/// The lobe of one channel, which colours nothing else.
fn lobe(channel: &ChannelParams, c: usize) -> LobeEntry {
    let of_channel = |value: f64| std::array::from_fn(|i| if i == c { value } else { 0.0 });
    LobeEntry {
        alpha: channel.alpha,
        p: channel.p,
        masking: channel
            .masking
            .expect("the bake completes the masking of every channel it places"),
        rho_s: of_channel(channel.rho_s),
        f0: of_channel(channel.f0),
        f1: of_channel(channel.f1),
    }
}
