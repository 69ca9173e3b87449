//! f(wi, wo) of a material, in f64: the reference that everything else is measured against.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::material::{ChannelParams, Material};
use crate::math::direction::{cos_theta, cot_theta, half_sum, tan2_theta};
use crate::microfacet::masking::MaskingKind;
use crate::microfacet::{FittedMasking, Fresnel, Masking, SgdNdf, SmithMasking};

/// Relative accuracy of the exact masking.
pub const EXACT: f64 = 1e-13;

/// The factors and the value of f for one channel and one pair of directions.
///
/// All are 0 where `wi` or `wo` is at or below the horizon.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Terms {
    /// D(h) \[1/sr\].
    pub ndf: f64,
    /// G1(wi).
    pub g1_i: f64,
    /// G1(wo).
    pub g1_o: f64,
    /// F(wi·h).
    pub fresnel: f64,
    /// ρs/π · F D G/(cosθi cosθo) \[1/sr\].
    pub specular: f64,
    /// ρd/π \[1/sr\].
    pub diffuse: f64,
    /// The sum of the two \[1/sr\].
    pub brdf: f64,
}

/// The factors of the model against one angle θ.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Factors {
    /// D(θ) \[1/sr\].
    pub ndf: f64,
    /// Smith's Λ(θ), or 1/G1 − 1 of a fitted G1; infinite at grazing.
    pub lambda: f64,
    /// G1(θ).
    pub g1: f64,
    /// F at θd = θ.
    pub fresnel: f64,
}

/// The SGD reflectance of one colour channel.
///
/// # Formula
///
/// f(wi, wo) = ρd/π + (ρs/π) F(wi·h) D(h) G1(wi) G1(wo)/(cosθi cosθo)   \[1/sr\]
///
/// (Bagher et al. 2012, equation 8; note that there is no ¼.)
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelBrdf {
    /// Diffuse albedo ρd.
    pub rho_d: f64,
    /// Specular scale ρs.
    pub rho_s: f64,
    /// The normal distribution D.
    pub ndf: SgdNdf,
    /// The masking G1.
    pub masking: Masking,
    /// The Fresnel factor F.
    pub fresnel: Fresnel,
}

impl ChannelBrdf {
    /// The evaluator of a channel's parameters, its masking to relative [`EXACT`] accuracy.
    #[must_use]
    pub fn new(params: &ChannelParams, kind: MaskingKind) -> Self {
        Self::with_accuracy(params, kind, EXACT)
    }

    /// The evaluator with the exact masking's relative accuracy chosen: fewer digits, fewer nodes.
    #[must_use]
    pub fn with_accuracy(params: &ChannelParams, kind: MaskingKind, accuracy: f64) -> Self {
        let masking = match kind {
            MaskingKind::Exact => Masking::Exact(SmithMasking::of(params, accuracy)),
            MaskingKind::Fitted => Masking::Fitted(FittedMasking::of(params)),
        };
        Self {
            rho_d: params.rho_d,
            rho_s: params.rho_s,
            ndf: SgdNdf::new(params.alpha, params.p),
            masking,
            fresnel: Fresnel { f0: params.f0, f1: params.f1 },
        }
    }

    /// The same with its exact masking from a table, for many evaluations.
    #[must_use]
    pub fn tabulated(self) -> Self {
        Self { masking: self.masking.tabulated(), ..self }
    }

    /// Every factor of f for unit `wi`, `wo`.
    #[must_use]
    pub fn terms(&self, wi: DVec3, wo: DVec3) -> Terms {
        if !(above_horizon(wi) && above_horizon(wo)) {
            return Terms::default();
        }
        let h = half_sum(wi, wo);
        let ndf = self.ndf.eval(tan2_theta(h));
        let fresnel = self.fresnel.eval(cos_theta_d(h));
        let g1_i = self.masking.g1(cot_theta(wi));
        let g1_o = self.masking.g1(cot_theta(wo));
        // G1/cosθ stays finite down to the horizon; the product of cosines would underflow.
        let (v_i, v_o) = (g1_i / cos_theta(wi), g1_o / cos_theta(wo));
        let specular = self.rho_s * FRAC_1_PI * fresnel * ndf * (v_i * v_o);
        let diffuse = self.rho_d * FRAC_1_PI;
        Terms { ndf, g1_i, g1_o, fresnel, specular, diffuse, brdf: diffuse + specular }
    }

    /// D, Λ, G1 and F against the angle with the given cosine and sine ≥ 0.
    #[must_use]
    pub fn factors(&self, cos_theta: f64, sin_theta: f64) -> Factors {
        let tan_theta = sin_theta / cos_theta;
        let cot_theta = cos_theta / sin_theta;
        Factors {
            ndf: self.ndf.eval(tan_theta * tan_theta),
            lambda: self.masking.lambda(cot_theta),
            g1: self.masking.g1(cot_theta),
            fresnel: self.fresnel.eval(cos_theta),
        }
    }

    /// f(wi, wo) \[1/sr\] for unit directions; 0 at and below the horizon.
    #[must_use]
    pub fn eval(&self, wi: DVec3, wo: DVec3) -> f64 {
        self.terms(wi, wo).brdf
    }
}

/// The SGD reflectance of a material's three channels.
#[derive(Clone, Debug, PartialEq)]
pub struct SgdBrdf {
    /// Evaluators in the order r, g, b.
    pub channels: [ChannelBrdf; 3],
}

impl SgdBrdf {
    /// The evaluator of a material.
    #[must_use]
    pub fn new(material: &Material, kind: MaskingKind) -> Self {
        Self { channels: material.channels.each_ref().map(|c| ChannelBrdf::new(c, kind)) }
    }

    /// f(wi, wo) \[1/sr\] per channel for unit directions; 0 at and below the horizon.
    #[must_use]
    pub fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.channels.each_ref().map(|channel| channel.eval(wi, wo))
    }
}

/// Whether light can come from or leave in direction `w`. The horizon itself, where cosθ = 0 or
/// denormal, is below, and so is what is no direction: a vector that holds a NaN or whose squared
/// length is not 1 within a hundredth.
#[must_use]
pub fn above_horizon(w: DVec3) -> bool {
    w.z >= f64::MIN_POSITIVE && (w.length_squared() - 1.0).abs() <= 1e-2
}

/// cosθd = wi·h = |wi + wo|/2 for unit directions, symmetric to the last bit.
#[must_use]
pub fn cos_theta_d(half_sum: DVec3) -> f64 {
    (0.5 * half_sum.length()).min(1.0)
}
