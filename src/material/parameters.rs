//! The numbers that describe a material, and the ranges in which they mean something.
//!
//! A [`Material`] is valid by construction: everything that is made of one cannot fail.

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

/// The lobes that a material may have: a texel holds a number for each.
pub const MAX_LOBES: usize = 3;

/// Parameters of the published masking fit (Bagher et al. 2012, equation 15).
///
/// # Example
///
/// ```
/// use sgdbake::{MaskingParams, named};
///
/// let masking = named("gold-paint")?.lobes()[0].masking();
/// let MaskingParams { lambda, c, k } = masking.expect("the paper prints one");
/// assert!(lambda > 0.0 && c > 0.0 && k > 0.0);
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaskingParams {
    /// Amplitude λ > 0; not Smith's Λ.
    pub lambda: f64,
    /// Rate c > 0.
    pub c: f64,
    /// Exponent k > 0.
    pub k: f64,
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

/// A lobe: one distribution of normals, hence one D and one G1, with the colour that it reflects.
///
/// Its share of f is (ρs/π) F D G/(cosθi cosθo) per colour, F(cosθd) = f0 + (1−f0)(1−cosθd)⁵ −
/// f1·cosθd (Bagher et al. 2012, equations 8 and 9).
///
/// # Example
///
/// ```
/// use sgdbake::{LobeFields, LobeParams, Material};
///
/// let lobe = LobeParams::new(LobeFields {
///     alpha: 0.1, p: 0.8, masking: None, rho_s: [0.2; 3], f0: [0.04; 3], f1: [0.0; 3],
/// })?;
/// let material = Material::new("my-plastic".to_owned(), [0.3, 0.1, 0.1], vec![lobe])?;
/// assert_eq!(material.lobes()[0].alpha(), 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "LobeFields")]
pub struct LobeParams {
    alpha: f64,
    p: f64,
    masking: Option<MaskingParams>,
    rho_s: [f64; 3],
    f0: [f64; 3],
    f1: [f64; 3],
}

/// The fields of a [`LobeParams`] before they are checked.
///
/// # Example
///
/// ```
/// use sgdbake::{LobeFields, LobeParams};
///
/// let fields = LobeFields {
///     alpha: -0.1, p: 0.8, masking: None, rho_s: [0.2; 3], f0: [0.04; 3], f1: [0.0; 3],
/// };
/// let refused = LobeParams::new(fields).expect_err("a width is positive");
/// assert!(refused.to_string().contains("alpha"));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct LobeFields {
    /// Width α of the distribution: a *squared* Beckmann width.
    pub alpha: f64,
    /// Exponent p of the power-law factor t^{−p}.
    pub p: f64,
    /// The masking fit; fitted from the exact masking where absent.
    #[serde(default)]
    pub masking: Option<MaskingParams>,
    /// Specular scale ρs per colour.
    pub rho_s: [f64; 3],
    /// Fresnel parameter f0 per colour.
    pub f0: [f64; 3],
    /// Fresnel parameter f1 per colour.
    pub f1: [f64; 3],
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

/// A parameter outside the range in which the model is defined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} = {} is out of range; it must be {accepted}", written(*.value))]
pub struct ParameterError {
    /// The key as it stands in a file, e.g. `alpha`.
    pub key: &'static str,
    /// The value found.
    pub value: f64,
    /// The accepted range, in words.
    pub accepted: &'static str,
}

/// A number as one writes it: 1e308 without its zeros.
fn written(value: f64) -> String {
    let short = value == 0.0 || !value.is_finite() || (1e-4..1e6).contains(&value.abs());
    if short { value.to_string() } else { format!("{value:e}") }
}

/// The range a parameter must lie in.
#[derive(Clone, Copy)]
struct Range {
    lowest: f64,
    highest: f64,
    words: &'static str,
}

/// Widths from a lobe that is a mirror for every picture to slopes that no surface has.
const ALPHA: Range = Range { lowest: 1e-8, highest: 100.0, words: "between 1e-8 and 100" };
/// Exponents; the published ones end at 1.8. Beyond, the masking loses digits: at 20 its error is
/// 3e-10 where 1e-12 is promised, and 2e-3 where 1e-3 is asked for.
const P: Range = Range { lowest: 0.0, highest: 10.0, words: "between 0 and 10" };
/// Diffuse and specular scales; the published ones end below 5. Beyond, f32 textures overflow.
const SCALE: Range = Range { lowest: 0.0, highest: 1e4, words: "between 0 and 1e4" };
/// Fresnel parameters; the published ones end at 5.
const FRESNEL: Range = Range { lowest: -1e4, highest: 1e4, words: "between -1e4 and 1e4" };
/// Masking parameters; c of the published ones reaches 1e109.
const MASKING: Range =
    Range { lowest: f64::MIN_POSITIVE, highest: f64::MAX, words: "a finite number above 0" };

impl Range {
    fn check(self, key: &'static str, value: f64) -> Result<(), ParameterError> {
        // A NaN lies in no range.
        if (self.lowest..=self.highest).contains(&value) {
            Ok(())
        } else {
            Err(ParameterError { key, value, accepted: self.words })
        }
    }

    fn check_all(self, key: &'static str, values: [f64; 3]) -> Result<(), ParameterError> {
        values.into_iter().try_for_each(|value| self.check(key, value))
    }
}

impl MaskingParams {
    /// Checks that every parameter is finite and positive.
    ///
    /// # Errors
    ///
    /// The first parameter that is not.
    pub fn validate(&self) -> Result<(), ParameterError> {
        MASKING.check("lambda", self.lambda)?;
        MASKING.check("c", self.c)?;
        MASKING.check("k", self.k)
    }
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

impl LobeParams {
    /// The lobe of these parameters.
    ///
    /// # Errors
    ///
    /// The first parameter that is NaN or outside its range.
    pub fn new(fields: LobeFields) -> Result<Self, ParameterError> {
        let LobeFields { alpha, p, masking, rho_s, f0, f1 } = fields;
        SCALE.check_all("rho_s", rho_s)?;
        ALPHA.check("alpha", alpha)?;
        P.check("p", p)?;
        FRESNEL.check_all("f0", f0)?;
        FRESNEL.check_all("f1", f1)?;
        masking.as_ref().map_or(Ok(()), MaskingParams::validate)?;
        Ok(Self { alpha, p, masking, rho_s, f0, f1 })
    }

    /// Width α of the distribution: a *squared* Beckmann width.
    #[must_use]
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    /// Exponent p of the power-law factor t^{−p}.
    #[must_use]
    pub fn p(&self) -> f64 {
        self.p
    }

    /// The masking fit, if one was given.
    #[must_use]
    pub fn masking(&self) -> Option<MaskingParams> {
        self.masking
    }

    /// Specular scale ρs per colour; 4ρs/π is the scale of the usual D·F·G/(4 cosθi cosθo).
    #[must_use]
    pub fn rho_s(&self) -> [f64; 3] {
        self.rho_s
    }

    /// Fresnel parameter f0 per colour.
    #[must_use]
    pub fn f0(&self) -> [f64; 3] {
        self.f0
    }

    /// Fresnel parameter f1 per colour; F(0°) = f0 − f1.
    #[must_use]
    pub fn f1(&self) -> [f64; 3] {
        self.f1
    }

    /// The same lobe with this masking fit.
    #[must_use]
    pub fn with_masking(self, masking: MaskingParams) -> Self {
        Self { masking: Some(masking), ..self }
    }

    /// Returns true if both lobes have one distribution and one masking.
    fn has_shape_of(&self, other: &Self) -> bool {
        (self.alpha, self.p, self.masking) == (other.alpha, other.p, other.masking)
    }
}

impl TryFrom<LobeFields> for LobeParams {
    type Error = ParameterError;

    fn try_from(fields: LobeFields) -> Result<Self, ParameterError> {
        Self::new(fields)
    }
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
