//! The numbers that describe a material, and the ranges in which they mean something.

use serde::{Deserialize, Serialize};

/// A colour channel of linear RGB.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Channel {
    /// Red.
    R,
    /// Green.
    G,
    /// Blue.
    B,
}

impl Channel {
    /// The channels in the order of every `[T; 3]`.
    pub const ALL: [Self; 3] = [Self::R, Self::G, Self::B];

    /// The one-letter name used in files: `r`, `g`, `b`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::R => "r",
            Self::G => "g",
            Self::B => "b",
        }
    }
}

/// Parameters of the published masking fit (Bagher et al. 2012, equation 15).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaskingParams {
    /// Amplitude λ > 0; not Smith's Λ.
    pub lambda: f64,
    /// Rate c > 0.
    pub c: f64,
    /// Exponent k > 0.
    pub k: f64,
}

/// SGD parameters of one colour channel.
///
/// Ranges: `rho_d`, `rho_s`, `p` ≥ 0; `alpha` > 0; `f0`, `f1` any finite number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelParams {
    /// Diffuse albedo ρd.
    pub rho_d: f64,
    /// Specular scale ρs; 4ρs/π is the scale of the usual D·F·G/(4 cosθi cosθo).
    pub rho_s: f64,
    /// Width α of the distribution: a *squared* Beckmann width.
    pub alpha: f64,
    /// Exponent p of the power-law factor t^{−p}.
    pub p: f64,
    /// Fresnel parameter f0.
    pub f0: f64,
    /// Fresnel parameter f1; F(0°) = f0 − f1.
    pub f1: f64,
    /// The masking fit; fitted from the exact masking where absent.
    #[serde(flatten)]
    pub masking: Option<MaskingParams>,
}

/// A material: a name and its three channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Catalogue name, or the name given in its file.
    pub name: String,
    /// Parameters per channel, in the order r, g, b.
    pub channels: [ChannelParams; 3],
}

/// A parameter outside the range in which the model is defined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} = {value} is out of range: accepted is {accepted}")]
pub struct ParameterError {
    /// The key as it stands in a file, e.g. `alpha`.
    pub key: &'static str,
    /// The value found.
    pub value: f64,
    /// The accepted range, in words.
    pub accepted: &'static str,
}

/// The range a parameter must lie in.
#[derive(Clone, Copy)]
enum Range {
    Finite,
    NonNegative,
    Positive,
}

impl Range {
    fn contains(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Finite => true,
                Self::NonNegative => value >= 0.0,
                Self::Positive => value > 0.0,
            }
    }

    fn in_words(self) -> &'static str {
        match self {
            Self::Finite => "a finite number",
            Self::NonNegative => "a finite number ≥ 0",
            Self::Positive => "a finite number > 0",
        }
    }

    fn check(self, key: &'static str, value: f64) -> Result<(), ParameterError> {
        if self.contains(value) {
            Ok(())
        } else {
            Err(ParameterError { key, value, accepted: self.in_words() })
        }
    }
}

impl ChannelParams {
    /// Checks every parameter against its range.
    ///
    /// # Errors
    ///
    /// The first parameter that is NaN, infinite or outside its range.
    pub fn validate(&self) -> Result<(), ParameterError> {
        Range::NonNegative.check("rho_d", self.rho_d)?;
        Range::NonNegative.check("rho_s", self.rho_s)?;
        Range::Positive.check("alpha", self.alpha)?;
        Range::NonNegative.check("p", self.p)?;
        Range::Finite.check("f0", self.f0)?;
        Range::Finite.check("f1", self.f1)?;
        self.masking.as_ref().map_or(Ok(()), MaskingParams::validate)
    }
}

impl MaskingParams {
    /// Checks that every parameter is finite and positive.
    ///
    /// # Errors
    ///
    /// The first parameter that is not.
    pub fn validate(&self) -> Result<(), ParameterError> {
        Range::Positive.check("lambda", self.lambda)?;
        Range::Positive.check("c", self.c)?;
        Range::Positive.check("k", self.k)
    }
}
