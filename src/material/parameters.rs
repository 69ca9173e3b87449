//! The numbers that describe a material.
//!
//! A [`Material`] is valid by construction: everything that is made of one cannot fail.

use serde::{Deserialize, Serialize};

use crate::material::lobe::{LobeFields, LobeParams, MAX_LOBES, MaskingParams};
use crate::material::range::{ParameterError, SCALE};

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

/// SGD parameters of one colour channel: a row of the paper's table.
///
/// # Example
///
/// ```
/// use sgdbake::{ChannelParams, Material};
///
/// let red = ChannelParams {
///     rho_d: 0.3, rho_s: 0.2, alpha: 0.1, p: 0.8, f0: 0.05, f1: -0.6, masking: None,
/// };
/// let paint = Material::of_channels("my-paint", &[red, red, ChannelParams { rho_d: 0.1, ..red }])?;
/// assert_eq!(paint.rho_d(), [0.3, 0.3, 0.1]);
/// # Ok::<(), sgdbake::material::MaterialError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
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
    pub masking: Option<MaskingParams>,
}

/// A material: a name, a diffuse colour and up to three lobes.
///
/// # Formula
///
/// f = ρd/π + Σ_lobes (ρs/π) F D G/(cosθi cosθo)   \[1/sr\]
///
/// A published fit has three lobes that colour one channel each; a refitted surface has one or two
/// that colour all three, as its normals have no colour.
///
/// # Example
///
/// ```
/// use sgdbake::named;
///
/// let material = named("gold-paint")?;
/// assert_eq!(material.name, "gold-paint");
/// assert_eq!(material.lobes().len(), 3, "a lobe for each channel");
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Catalogue name, or the name given in its file.
    pub name: String,
    rho_d: [f64; 3],
    lobes: Vec<LobeParams>,
}

impl ChannelParams {
    /// Checks every parameter against its range.
    ///
    /// # Errors
    ///
    /// The first parameter that is NaN or outside its range.
    pub fn validate(&self) -> Result<(), ParameterError> {
        SCALE.check("rho_d", self.rho_d)?;
        self.lobe(0).map(|_| ())
    }

    /// The lobe that colours the channel of this index alone.
    fn lobe(&self, channel: usize) -> Result<LobeParams, ParameterError> {
        LobeParams::new(LobeFields {
            alpha: self.alpha,
            p: self.p,
            masking: self.masking,
            rho_s: alone(self.rho_s, channel),
            f0: alone(self.f0, channel),
            f1: alone(self.f1, channel),
        })
    }
}

/// A colour that is 0 but for one channel.
fn alone(value: f64, channel: usize) -> [f64; 3] {
    let mut colour = [0.0; 3];
    colour[channel] = value;
    colour
}

/// Why numbers are not a material.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MaterialError {
    /// A parameter is out of range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// More lobes than a texel has room for.
    #[error("found {0} lobes; a material has at most {MAX_LOBES}")]
    Lobes(usize),
}

impl Material {
    /// The material of a diffuse colour ρd and up to [`MAX_LOBES`] lobes.
    ///
    /// # Errors
    ///
    /// A colour that is NaN or outside its range, or too many lobes.
    pub fn new(
        name: impl Into<String>,
        rho_d: [f64; 3],
        lobes: Vec<LobeParams>,
    ) -> Result<Self, MaterialError> {
        SCALE.check_all("rho_d", rho_d)?;
        if lobes.len() > MAX_LOBES {
            return Err(MaterialError::Lobes(lobes.len()));
        }
        Ok(Self { name: name.into(), rho_d, lobes })
    }

    /// The material of three channels as the paper gives them: a lobe for each that colours it
    /// alone. Channels of equal α, p and masking share one lobe.
    ///
    /// # Errors
    ///
    /// The first parameter that is NaN or outside its range.
    pub fn of_channels(
        name: impl Into<String>,
        channels: &[ChannelParams; 3],
    ) -> Result<Self, ParameterError> {
        let rho_d = channels.map(|channel| channel.rho_d);
        SCALE.check_all("rho_d", rho_d)?;
        let mut lobes: Vec<LobeParams> = Vec::with_capacity(MAX_LOBES);
        for (c, channel) in channels.iter().enumerate() {
            let lobe = channel.lobe(c)?;
            // The lobe of a channel is black in the other two: only its own entries are taken over.
            match lobes.iter_mut().find(|known| known.has_shape_of(&lobe)) {
                Some(known) => {
                    known.rho_s[c] = lobe.rho_s[c];
                    known.f0[c] = lobe.f0[c];
                    known.f1[c] = lobe.f1[c];
                }
                None => lobes.push(lobe),
            }
        }
        Ok(Self { name: name.into(), rho_d, lobes })
    }

    /// Diffuse albedo ρd per colour.
    #[must_use]
    pub fn rho_d(&self) -> [f64; 3] {
        self.rho_d
    }

    /// The lobes.
    #[must_use]
    pub fn lobes(&self) -> &[LobeParams] {
        &self.lobes
    }

    /// The material with `change` made to each lobe.
    #[must_use]
    pub fn map_lobes(mut self, change: impl Fn(LobeParams) -> LobeParams) -> Self {
        self.lobes = self.lobes.into_iter().map(change).collect();
        self
    }

    /// The lobe that alone colours each channel, where no channel has two: the form of the paper's
    /// table. A channel that no lobe colours gets the lobe of its index, or the last.
    #[must_use]
    pub fn channel_lobes(&self) -> Option<[usize; 3]> {
        let last = self.lobes.len().checked_sub(1)?;
        let mut found = [0; 3];
        for (c, found) in found.iter_mut().enumerate() {
            let mut colouring = (0..=last).filter(|j| self.lobes[*j].rho_s[c] > 0.0);
            *found = colouring.next().unwrap_or(c.min(last));
            if colouring.next().is_some() {
                return None;
            }
        }
        Some(found)
    }

    /// The parameters of one channel of a material in the paper's form.
    #[must_use]
    pub fn channels(&self) -> Option<[ChannelParams; 3]> {
        let lobes = self.channel_lobes()?;
        Some([0, 1, 2].map(|c| {
            let LobeParams { alpha, p, masking, rho_s, f0, f1 } = self.lobes[lobes[c]];
            ChannelParams {
                rho_d: self.rho_d[c],
                rho_s: rho_s[c],
                alpha,
                p,
                f0: f0[c],
                f1: f1[c],
                masking,
            }
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHANNEL: ChannelParams = ChannelParams {
        rho_d: 0.2,
        rho_s: 0.3,
        alpha: 0.1,
        p: 0.5,
        f0: 0.04,
        f1: 0.0,
        masking: None,
    };

    #[test]
    fn channels_of_one_shape_share_a_lobe() {
        let other = ChannelParams { alpha: 0.2, ..CHANNEL };
        let material = Material::of_channels("m", &[CHANNEL, other, CHANNEL]).expect("in range");
        assert_eq!(material.lobes().len(), 2);
        assert_eq!(material.lobes()[0].rho_s(), [0.3, 0.0, 0.3]);
        assert_eq!(material.channel_lobes(), Some([0, 1, 0]));
        assert_eq!(material.channels(), Some([CHANNEL, other, CHANNEL]));
    }

    #[test]
    fn two_lobes_that_colour_one_channel_have_no_paper_form() {
        let lobe = Material::of_channels("m", &[CHANNEL; 3]).expect("in range").lobes()[0];
        let material = Material::new("m", [0.1; 3], vec![lobe, lobe]).expect("in range");
        assert_eq!(material.channels(), None);
        assert_eq!(
            Material::new("m", [0.1; 3], vec![lobe; 4]).expect_err("too many"),
            MaterialError::Lobes(4)
        );
    }

    #[test]
    fn parameters_out_of_range_are_refused() {
        let cases = [
            ("alpha", ChannelParams { alpha: 0.0, ..CHANNEL }),
            ("alpha", ChannelParams { alpha: 1e308, ..CHANNEL }),
            ("p", ChannelParams { p: 1e300, ..CHANNEL }),
            ("rho_d", ChannelParams { rho_d: f64::NAN, ..CHANNEL }),
            ("rho_s", ChannelParams { rho_s: -1e-9, ..CHANNEL }),
            ("f0", ChannelParams { f0: 1e308, ..CHANNEL }),
            ("f1", ChannelParams { f1: f64::INFINITY, ..CHANNEL }),
        ];
        for (key, channel) in cases {
            let error = Material::of_channels("m", &[channel; 3]).expect_err("out of range");
            assert_eq!(error.key, key);
        }
    }
}
