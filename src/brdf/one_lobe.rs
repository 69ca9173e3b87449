//! The reflectance of one Beckmann or GGX lobe over a diffuse base, as most engines have it.

use std::f64::consts::FRAC_PI_4;

use serde::{Deserialize, Serialize};

use crate::brdf::{Brdf, Lobe};
use crate::microfacet::{Family, Fresnel, OneWidth};

/// One colour channel of an [`OneLobe`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OneLobeChannel {
    /// Diffuse albedo ρd.
    pub rho_d: f64,
    /// Width α of the distribution (roughness² in the usual convention).
    pub alpha: f64,
    /// The specular colour against angle.
    pub fresnel: Fresnel,
}

/// A diffuse base and one microfacet lobe per channel.
///
/// # Formula
///
/// f(wi, wo) = ρd/π + F(wi·h) D(h) G1(wi) G1(wo)/(4 cosθi cosθo)   \[1/sr\],   G1 = 1/(1+Λ)
///
/// (Walter et al. 2007, with the separable Smith masking that SGD has too.)
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OneLobe {
    /// The distribution: its D and Λ.
    #[serde(rename = "distribution")]
    pub family: Family,
    /// Parameters in the order r, g, b.
    pub channels: [OneLobeChannel; 3],
}

/// The ρs that makes (ρs/π) the ¼ of the usual F D G/(4 cosθi cosθo).
const RHO_S: f64 = FRAC_PI_4;

impl OneLobe {
    /// The reflectance: a lobe for each width, one where the channels share it.
    #[must_use]
    pub fn brdf(&self) -> Brdf<OneWidth> {
        let mut lobes: Vec<Lobe<OneWidth>> = Vec::new();
        for (c, channel) in self.channels.iter().enumerate() {
            let distribution = self.family.of_width(channel.alpha);
            // D and G1 are then evaluated once for the channels that share a width.
            let known = lobes.iter_mut().find(|lobe| lobe.distribution == distribution);
            if let Some(lobe) = known {
                (lobe.rho_s[c], lobe.fresnel[c]) = (RHO_S, channel.fresnel);
            } else {
                let mut rho_s = [0.0; 3];
                rho_s[c] = RHO_S;
                lobes.push(Lobe {
                    distribution,
                    fitted: None,
                    rho_s,
                    fresnel: [channel.fresnel; 3],
                });
            }
        }
        Brdf { rho_d: self.channels.map(|channel| channel.rho_d), lobes }
    }
}

/// 4/π·ρs, the factor from a published ρs to the usual scale: SGD's formula has no ¼ and a 1/π.
pub const SCALE_OF_RHO_S: f64 = 4.0 / std::f64::consts::PI;
