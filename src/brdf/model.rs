//! f(wi, wo) of a diffuse colour and lobes, in f64: the reference that everything else is measured
//! against.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use serde::Serialize;

use crate::material::{LobeParams, MAX_LOBES, Material};
use crate::math::direction::Angles;
use crate::microfacet::{
    Accuracy, BeckmannMixture, Distribution, FittedMasking, Fresnel, Sgd, SharedMixture,
};

/// The masking function that a reflectance uses.
///
/// # Example
///
/// ```
/// use sgdbake::{MaskingKind, SgdBrdf, named, spherical};
///
/// let material = named("gold-paint")?;
/// let (wi, wo) = (spherical(1.2, 0.0), spherical(1.2, std::f64::consts::PI));
/// let [exact, fitted] = [MaskingKind::Exact, MaskingKind::Fitted]
///     .map(|kind| SgdBrdf::new(material, kind).eval(wi, wo)[0]);
/// assert!(exact != fitted && (exact / fitted - 1.0).abs() < 0.01);
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum MaskingKind {
    /// Smith's masking of the distribution, exactly.
    #[default]
    Exact,
    /// The paper's three-parameter fit.
    Fitted,
}

/// A lobe of a reflectance: a distribution of normals and the colour that it reflects.
///
/// # Example
///
/// ```
/// use sgdbake::{Brdf, Fresnel, Ggx, Lobe, Reflectance, spherical};
///
/// let lobe = Lobe {
///     distribution: Ggx { alpha: 0.2 },
///     fitted: None,
///     rho_s: [std::f64::consts::FRAC_PI_4; 3], // ρs/π is the usual ¼
///     fresnel: [Fresnel { f0: 0.04, f90: 1.0, f1: 0.0 }; 3],
/// };
/// let brdf = Brdf { rho_d: [0.5, 0.1, 0.1], lobes: vec![lobe] };
/// let (wi, wo) = (spherical(0.5, 0.0), spherical(0.5, 3.0));
/// assert!(brdf.eval(wi, wo)[0] > brdf.eval(wi, wo)[1]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Lobe<D> {
    /// The distribution, with its own masking.
    pub distribution: D,
    /// The masking that is used in place of the distribution's own, if any.
    pub fitted: Option<FittedMasking>,
    /// Specular scale ρs per colour; 0 where the lobe does not colour.
    pub rho_s: [f64; 3],
    /// The Fresnel factor per colour.
    pub fresnel: [Fresnel; 3],
}

/// A diffuse colour and a sum of microfacet lobes.
///
/// # Formula
///
/// f(wi, wo) = ρd/π + Σ_lobes (ρs/π) F(wi·h) D(h) G1(wi) G1(wo)/(cosθi cosθo)   \[1/sr\]
///
/// (Bagher et al. 2012, equation 8; note that there is no ¼.)
///
/// # Example
///
/// ```
/// use sgdbake::{Brdf, MaskingKind, Sgd, SgdBrdf, named, spherical};
///
/// let brdf: Brdf<Sgd> = SgdBrdf::new(named("gold-paint")?, MaskingKind::Exact);
/// let terms = brdf.terms(spherical(0.3, 0.0), spherical(0.3, 3.0));
/// assert_eq!(terms.brdf[0], terms.diffuse[0] + terms.specular[0]);
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Brdf<D> {
    /// Diffuse albedo ρd per colour.
    pub rho_d: [f64; 3],
    /// The lobes.
    pub lobes: Vec<Lobe<D>>,
}

/// The SGD reflectance of a material.
///
/// # Example
///
/// ```
/// use sgdbake::{MaskingKind, SgdBrdf, named, spherical};
///
/// let brdf = SgdBrdf::new(named("blue-acrylic")?, MaskingKind::Exact);
/// let [r, _, b] = brdf.eval(spherical(0.2, 0.0), spherical(0.9, 1.5));
/// assert!(b > r);
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
pub type SgdBrdf = Brdf<Sgd>;

/// The factors and the value of f for one pair of directions; all 0 below the horizon.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms {
    /// The factors of each lobe; 0 beyond the material's last.
    pub lobes: [LobeTerms; MAX_LOBES],
    /// Σ_lobes ρs/π · F D G/(cosθi cosθo) per colour \[1/sr\].
    pub specular: [f64; 3],
    /// ρd/π per colour \[1/sr\].
    pub diffuse: [f64; 3],
    /// The sum of the two \[1/sr\].
    pub brdf: [f64; 3],
}

/// The factors of one lobe for one pair of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LobeTerms {
    /// D(h) \[1/sr\].
    pub ndf: f64,
    /// G1(wi).
    pub g1_i: f64,
    /// G1(wo).
    pub g1_o: f64,
    /// F(wi·h) per colour.
    pub fresnel: [f64; 3],
}

/// The factors of one lobe against one angle θ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LobeCurves {
    /// D(θ) \[1/sr\].
    pub ndf: f64,
    /// Smith's Λ(θ), or 1/G1 − 1 of a fitted G1; infinite at grazing.
    pub lambda: f64,
    /// G1(θ).
    pub g1: f64,
    /// F at θd = θ, per colour.
    pub fresnel: [f64; 3],
}

impl<D: Distribution> Lobe<D> {
    /// G1 at cotθ: of the fit where there is one, else the distribution's.
    #[must_use]
    pub fn g1(&self, cot_theta: f64) -> f64 {
        match &self.fitted {
            Some(fitted) => fitted.g1(cot_theta),
            None => self.distribution.g1(cot_theta),
        }
    }

    /// Λ = 1/G1 − 1 at cotθ.
    #[must_use]
    pub fn lambda(&self, cot_theta: f64) -> f64 {
        match &self.fitted {
            Some(fitted) => fitted.g1(cot_theta).recip() - 1.0,
            None => self.distribution.lambda(cot_theta),
        }
    }

    /// The factors for a pair of directions.
    #[must_use]
    pub fn terms(&self, angles: &Angles) -> LobeTerms {
        let [g1_i, g1_o] = angles.cot.map(|cot| self.g1(cot));
        LobeTerms {
            ndf: self.distribution.ndf(angles.tan2_h),
            g1_i,
            g1_o,
            fresnel: self.fresnel.map(|fresnel| fresnel.eval(angles.cos_d)),
        }
    }

    /// (ρs/π) F D (G1(wi)/cosθi) (G1(wo)/cosθo) per colour; 0 where the lobe does not colour.
    #[must_use]
    pub fn specular(&self, terms: &LobeTerms, angles: &Angles) -> [f64; 3] {
        // G1/cosθ stays finite down to the horizon; the product of cosines would underflow.
        let (v_i, v_o) = (terms.g1_i / angles.cos[0], terms.g1_o / angles.cos[1]);
        std::array::from_fn(|c| match self.rho_s[c] {
            0.0 => 0.0,
            rho_s => rho_s * FRAC_1_PI * terms.fresnel[c] * terms.ndf * (v_i * v_o),
        })
    }

    /// D, Λ, G1 and F against the angle with the given cosine and sine ≥ 0.
    #[must_use]
    pub fn curves(&self, cos_theta: f64, sin_theta: f64) -> LobeCurves {
        // Either may be infinite: D, Λ and G1 have their limits there.
        let (tan_theta, cot_theta) = (sin_theta / cos_theta, cos_theta / sin_theta);
        LobeCurves {
            ndf: self.distribution.ndf(tan_theta * tan_theta),
            lambda: self.lambda(cot_theta),
            g1: self.g1(cot_theta),
            fresnel: self.fresnel.map(|fresnel| fresnel.eval(cos_theta)),
        }
    }
}

impl<D: Distribution> Brdf<D> {
    /// Every factor of f for unit `wi`, `wo`.
    #[must_use]
    pub fn terms(&self, wi: DVec3, wo: DVec3) -> Terms {
        let Some(angles) = Angles::of(wi, wo) else { return Terms::default() };
        let mut terms =
            Terms { diffuse: self.rho_d.map(|rho_d| rho_d * FRAC_1_PI), ..Terms::default() };
        for (lobe, slot) in self.lobes.iter().zip(&mut terms.lobes) {
            *slot = lobe.terms(&angles);
            let specular = lobe.specular(slot, &angles);
            terms.specular = std::array::from_fn(|c| terms.specular[c] + specular[c]);
        }
        terms.brdf = std::array::from_fn(|c| terms.diffuse[c] + terms.specular[c]);
        terms
    }

    /// f(wi, wo) \[1/sr\] per colour for unit directions; 0 at and below the horizon.
    #[must_use]
    pub fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let Some(angles) = Angles::of(wi, wo) else { return [0.0; 3] };
        let mut specular = [0.0; 3];
        for lobe in &self.lobes {
            // In the order of `terms`, so that both have the same bits.
            let of_lobe = lobe.specular(&lobe.terms(&angles), &angles);
            specular = std::array::from_fn(|c| specular[c] + of_lobe[c]);
        }
        std::array::from_fn(|c| self.rho_d[c] * FRAC_1_PI + specular[c])
    }
}

impl Lobe<Sgd> {
    /// The evaluator of a lobe's parameters.
    #[must_use]
    pub fn new(params: &LobeParams, kind: MaskingKind, accuracy: Accuracy) -> Self {
        Self {
            distribution: Sgd::new(params.alpha(), params.p(), accuracy),
            fitted: (kind == MaskingKind::Fitted).then(|| FittedMasking::of(params)),
            rho_s: params.rho_s(),
            fresnel: fresnel(params),
        }
    }

    /// The same with its exact masking from a table, for many evaluations.
    #[must_use]
    pub fn tabulated(self) -> Self {
        Self { distribution: self.distribution.tabulated(), ..self }
    }
}

/// The Fresnel curves of a lobe.
#[must_use]
pub fn fresnel(params: &LobeParams) -> [Fresnel; 3] {
    std::array::from_fn(|c| Fresnel::sgd(params.f0()[c], params.f1()[c]))
}

impl SgdBrdf {
    /// The evaluator of a material, its exact masking to rounding.
    #[must_use]
    pub fn new(material: &Material, kind: MaskingKind) -> Self {
        Self::with_accuracy(material, kind, Accuracy::Reference)
    }

    /// The evaluator with the exact masking's accuracy chosen: fewer digits, less time.
    #[must_use]
    pub fn with_accuracy(material: &Material, kind: MaskingKind, accuracy: Accuracy) -> Self {
        let lobes = material.lobes().iter().map(|params| Lobe::new(params, kind, accuracy));
        Self { rho_d: material.rho_d(), lobes: lobes.collect() }
    }

    /// The same with its exact masking from tables, for many evaluations.
    #[must_use]
    pub fn tabulated(self) -> Self {
        Self { lobes: self.lobes.into_iter().map(Lobe::tabulated).collect(), ..self }
    }
}

impl Brdf<BeckmannMixture> {
    /// A material with the distribution of each lobe replaced by its mixture.
    #[must_use]
    pub fn of_mixture(material: &Material, mixture: &SharedMixture) -> Self {
        let lobes = material.lobes().iter().enumerate().map(|(j, params)| Lobe {
            distribution: mixture.of_lobe(j),
            fitted: None,
            rho_s: params.rho_s(),
            fresnel: fresnel(params),
        });
        Self { rho_d: material.rho_d(), lobes: lobes.collect() }
    }
}
