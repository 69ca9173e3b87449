//! The SGD reflectance with its distribution replaced by a few Beckmann lobes.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::brdf::Reflectance;
use crate::brdf::eval::{above_horizon, cos_theta_d};
use crate::material::Material;
use crate::math::direction::{cos_theta, cot_theta, half_sum, tan2_theta};
use crate::microfacet::{BeckmannLobe, BeckmannMixture, Fresnel, SmithMasking};

/// Beckmann lobes whose widths the three channels share: D_c = Σ_j weights\[j\]\[c\]·D_beckmann(alpha\[j\]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lobes {
    /// Widths, ascending.
    pub alpha: Vec<f64>,
    /// Weight of each lobe per channel, ≥ 0; a channel's weights sum to 1.
    pub weights: Vec<[f64; 3]>,
}

impl Lobes {
    /// The mixture of one channel.
    #[must_use]
    pub fn channel(&self, channel: usize) -> BeckmannMixture {
        let lobes = self.alpha.iter().zip(&self.weights);
        BeckmannMixture::of_lobes(
            lobes.map(|(alpha, w)| BeckmannLobe { alpha: *alpha, weight: w[channel] }).collect(),
        )
    }
}

/// An SGD reflectance whose D and G are those of [`Lobes`].
///
/// # Formula
///
/// f(wi, wo) = ρd/π + (ρs/π) F(wi·h) D(h) G1(wi) G1(wo)/(cosθi cosθo) with the mixture's D and
/// G1 = 1/(1 + Σ w_j Λ_j); ρd, ρs and F as published.
#[derive(Clone, Debug, PartialEq)]
pub struct LobesBrdf {
    channels: [LobesChannel; 3],
}

#[derive(Clone, Debug, PartialEq)]
struct LobesChannel {
    rho_d: f64,
    rho_s: f64,
    fresnel: Fresnel,
    mixture: BeckmannMixture,
    masking: SmithMasking,
}

impl LobesBrdf {
    /// The reflectance of `material` through `lobes`.
    #[must_use]
    pub fn new(material: &Material, lobes: &Lobes) -> Self {
        let channels = std::array::from_fn(|c| {
            let params = &material.channels[c];
            let mixture = lobes.channel(c);
            LobesChannel {
                rho_d: params.rho_d,
                rho_s: params.rho_s,
                fresnel: Fresnel { f0: params.f0, f1: params.f1 },
                masking: SmithMasking::new(&mixture),
                mixture,
            }
        });
        Self { channels }
    }
}

impl Reflectance for LobesBrdf {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !(above_horizon(wi) && above_horizon(wo)) {
            return [0.0; 3];
        }
        self.channels.each_ref().map(|channel| channel.eval(wi, wo))
    }
}

impl LobesChannel {
    fn eval(&self, wi: DVec3, wo: DVec3) -> f64 {
        let h = half_sum(wi, wo);
        let v = |w: DVec3| self.masking.g1(cot_theta(w)) / cos_theta(w);
        let f = self.fresnel.eval(cos_theta_d(h));
        FRAC_1_PI
            * (self.rho_d + self.rho_s * f * self.mixture.ndf(tan2_theta(h)) * (v(wi) * v(wo)))
    }
}
