//! The parameters of a lobe, valid by construction.

use serde::{Deserialize, Serialize};

use crate::material::range::{ALPHA, FRESNEL, MASKING, P, ParameterError, SCALE};

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
    pub(super) alpha: f64,
    pub(super) p: f64,
    pub(super) masking: Option<MaskingParams>,
    pub(super) rho_s: [f64; 3],
    pub(super) f0: [f64; 3],
    pub(super) f1: [f64; 3],
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

impl LobeParams {
    /// The lobe of these parameters.
    ///
    /// # Errors
    ///
    /// The first parameter that is NaN or outside its range.
    pub fn new(fields: LobeFields) -> Result<Self, ParameterError> {
        let LobeFields { alpha, p, masking, rho_s, f0, f1 } = fields;
        // Once here for every way in, `Deserialize` included; evaluators check nothing.
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
    pub(super) fn has_shape_of(&self, other: &Self) -> bool {
        (self.alpha, self.p, self.masking) == (other.alpha, other.p, other.masking)
    }
}

impl TryFrom<LobeFields> for LobeParams {
    type Error = ParameterError;

    fn try_from(fields: LobeFields) -> Result<Self, ParameterError> {
        Self::new(fields)
    }
}
