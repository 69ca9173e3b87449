//! Drawing directions for a material whose three channels have different lobes: one direction
//! serves all three.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::DVec3;

use crate::brdf::Reflectance;
use crate::brdf::eval::{ChannelBrdf, SgdBrdf, above_horizon};
use crate::brdf::one_lobe::ggx_lambda;
use crate::brdf::reflectance::cosine_sample;
use crate::material::{ChannelParams, Material};
use crate::math::direction::{cos_theta, cot_theta, half_sum, tan2_theta};
use crate::math::quadrature::gauss_legendre;
use crate::microfacet::beckmann_mixture::beckmann_lambda;
use crate::microfacet::masking::MaskingKind;
use crate::microfacet::{BeckmannMixture, GgxNdf, SgdNdf, SmithMasking, visible_normals};

/// Relative accuracy of the mixture that normals are drawn from, and of the masking in f: far
/// below the noise of any number of samples.
const ACCURACY: f64 = 1e-8;

/// The lobes that half vectors are drawn from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Strategy {
    /// The visible normals of the SGD distribution itself, exactly.
    #[default]
    Vndf,
    /// The visible normals of a GGX lobe whose width makes the variance smallest.
    Ggx,
}

/// A drawn direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The direction to the light.
    pub wi: DVec3,
    /// Its density \[1/sr\].
    pub pdf: f64,
    /// f·cosθi/pdf per channel.
    pub weight: [f64; 3],
}

/// Draws directions for a material.
///
/// # Formula
///
/// ```text
/// pdf(wi) = q_d cosθi/π + Σ_c q_c pdf_c(wi),     pdf_c = D_c(h) G1_c(wo)/(4 cosθo)
/// ```
///
/// The technique — diffuse, or the lobe of channel c — is chosen by q(wo); the density is that of
/// all techniques together (the balance heuristic of Veach and Guibas 1995), so every channel's
/// weight f·cosθi/pdf is bounded by that of its own technique alone over q_c, and no colour
/// sparkles where another channel's lobe found its peak.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampler {
    brdf: SgdBrdf,
    lobes: [Lobe; 3],
}

impl Sampler {
    /// The sampler of a material by `strategy`.
    #[must_use]
    pub fn new(material: &Material, kind: MaskingKind, strategy: Strategy) -> Self {
        Self::with_lobes(material, kind, |params| match strategy {
            Strategy::Vndf => Lobe::sgd(params),
            Strategy::Ggx => Lobe::Ggx { alpha: tuned_ggx_width(params) },
        })
    }

    /// The sampler with a chosen lobe for each channel.
    #[must_use]
    pub fn with_lobes(
        material: &Material,
        kind: MaskingKind,
        lobe: impl Fn(&ChannelParams) -> Lobe,
    ) -> Self {
        let channels = material.channels.each_ref();
        Self {
            brdf: SgdBrdf {
                channels: channels.map(|c| ChannelBrdf::with_accuracy(c, kind, ACCURACY)),
            },
            lobes: channels.map(lobe),
        }
    }

    /// A direction for `wo` from three uniform numbers in [0, 1), with its density and weights;
    /// `None` where the draw falls below the horizon and carries nothing.
    #[must_use]
    pub fn sample_with_weight(&self, wo: DVec3, u: [f64; 3]) -> Option<Sample> {
        let wi = self.sample(wo, u)?;
        let pdf = self.pdf(wi, wo);
        let weight = self.brdf.eval(wi, wo).map(|f| f * cos_theta(wi) / pdf);
        Some(Sample { wi, pdf, weight })
    }

    /// What directions are drawn from for one `wo`; `None` below the horizon.
    #[must_use]
    pub fn towards(&self, wo: DVec3) -> Option<Towards<'_>> {
        above_horizon(wo).then(|| {
            let shares = self.shares(wo);
            let (cos_theta, cot_theta) = (cos_theta(wo), cot_theta(wo));
            let density = |c: usize| match shares[c] {
                0.0 => 0.0,
                share => share * 0.25 * (self.lobes[c].g1(cot_theta) / cos_theta),
            };
            Towards { lobes: &self.lobes, wo, shares, densities: std::array::from_fn(density) }
        })
    }

    /// q(wo): the shares of r, g, b lobes and diffuse, about what each reflects.
    fn shares(&self, wo: DVec3) -> [f64; 4] {
        /// Keeps a lobe alive where its Fresnel curve crosses zero at θd = θo.
        const LEAST_FRESNEL: f64 = 0.05;
        let [r, g, b] = self.brdf.channels.each_ref().map(|channel| {
            4.0 * FRAC_1_PI
                * channel.rho_s
                * (channel.fresnel.eval(cos_theta(wo)).abs() + LEAST_FRESNEL)
        });
        let diffuse = self.brdf.channels.iter().map(|channel| channel.rho_d).sum();
        let shares = [r, g, b, diffuse];
        let total: f64 = shares.iter().sum();
        if total > 0.0 { shares.map(|share| share / total) } else { [0.0, 0.0, 0.0, 1.0] }
    }
}

impl Reflectance for Sampler {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.brdf.eval(wi, wo)
    }

    fn sample(&self, wo: DVec3, u: [f64; 3]) -> Option<DVec3> {
        self.towards(wo)?.sample(u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        self.towards(wo).map_or(0.0, |towards| towards.pdf(wi))
    }
}

/// A [`Sampler`] for one `wo`: what does not depend on `wi` is worked out once.
#[derive(Clone, Debug)]
pub struct Towards<'a> {
    lobes: &'a [Lobe; 3],
    wo: DVec3,
    /// q(wo) of r, g, b and diffuse.
    shares: [f64; 4],
    /// q_c G1_c(wo)/(4 cosθo).
    densities: [f64; 3],
}

impl Towards<'_> {
    /// The direction to the viewer.
    #[must_use]
    pub fn wo(&self) -> DVec3 {
        self.wo
    }

    /// A direction to the light from three uniform numbers in [0, 1); `None` where the draw falls
    /// below the horizon.
    #[must_use]
    pub fn sample(&self, [choice, u, v]: [f64; 3]) -> Option<DVec3> {
        let (technique, choice) = choose(self.shares, choice);
        let wi = match self.lobes.get(technique) {
            Some(lobe) => {
                let h = lobe.visible_normal(self.wo, [choice, u, v]);
                2.0 * self.wo.dot(h) * h - self.wo
            }
            None => cosine_sample([u, v]),
        };
        above_horizon(wi).then_some(wi)
    }

    /// The density of [`Self::sample`] at `wi` \[1/sr\]; 0 below the horizon.
    #[must_use]
    pub fn pdf(&self, wi: DVec3) -> f64 {
        if !above_horizon(wi) {
            return 0.0;
        }
        let tan2_h = tan2_theta(half_sum(wi, self.wo));
        let lobes = self.lobes.iter().zip(self.densities);
        lobes
            .filter(|(_, density)| *density > 0.0)
            .map(|(lobe, density)| density * lobe.ndf(tan2_h))
            .sum::<f64>()
            + self.shares[3] * cos_theta(wi) * FRAC_1_PI
    }
}

/// The index that `u` falls to among shares that sum to 1, and where in that share, in [0, 1).
fn choose<const N: usize>(shares: [f64; N], u: f64) -> (usize, f64) {
    let mut rest = u;
    for (index, share) in shares.into_iter().enumerate() {
        if rest < share {
            return (index, rest / share);
        }
        rest -= share;
    }
    // Rounding left nothing over: the last share that is not empty.
    (shares.iter().rposition(|share| *share > 0.0).unwrap_or(N - 1), 0.5)
}

/// A distribution whose visible normals are drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Lobe {
    /// SGD.
    Sgd(SgdLobe),
    /// GGX of a width.
    Ggx {
        /// The width α_g.
        alpha: f64,
    },
}

/// SGD as the mixture that its visible normals are drawn from.
#[derive(Clone, Debug, PartialEq)]
pub struct SgdLobe {
    ndf: SgdNdf,
    mixture: BeckmannMixture,
    masking: SmithMasking,
}

impl Lobe {
    /// The visible normals of a channel's own distribution.
    #[must_use]
    pub fn sgd(params: &ChannelParams) -> Self {
        let mixture = BeckmannMixture::new(params.alpha, params.p, ACCURACY);
        Self::Sgd(SgdLobe {
            ndf: SgdNdf::new(params.alpha, params.p),
            masking: SmithMasking::new(&mixture),
            mixture,
        })
    }

    /// A normal of density D(h) G1(wo) ⟨wo, h⟩/cosθo.
    ///
    /// Exact for SGD: with D = Σ w_j D_j and one G1 = 1/(1 + Σ w_j Λ_j), lobe j is chosen with
    /// probability ∝ w_j (1 + Λ_j(wo)), the share of the visible area that it makes up.
    fn visible_normal(&self, wo: DVec3, [choice, u, v]: [f64; 3]) -> DVec3 {
        match self {
            Self::Sgd(sgd) => {
                visible_normals::beckmann(wo, sgd.visible_width(cot_theta(wo), choice), [u, v])
            }
            Self::Ggx { alpha } => visible_normals::ggx(wo, *alpha, [u, v]),
        }
    }

    /// D at x = tan²θh \[1/sr\].
    fn ndf(&self, tan2_h: f64) -> f64 {
        match self {
            Self::Sgd(sgd) => sgd.ndf.eval(tan2_h),
            Self::Ggx { alpha } => GgxNdf { alpha: *alpha }.eval(tan2_h),
        }
    }

    /// G1 at cotθ.
    fn g1(&self, cot_theta: f64) -> f64 {
        match self {
            Self::Sgd(sgd) => sgd.masking.g1(cot_theta),
            Self::Ggx { alpha } => 1.0 / (1.0 + ggx_lambda(cot_theta / alpha)),
        }
    }
}

impl SgdLobe {
    /// The width of the Beckmann lobe that `choice` falls to, at cotθo.
    fn visible_width(&self, cot_theta: f64, choice: f64) -> f64 {
        let lobes = self.mixture.lobes();
        let visible = |alpha: f64, weight: f64| weight * (1.0 + beckmann_lambda(cot_theta / alpha));
        let mut rest = choice * (1.0 + self.masking.lambda(cot_theta));
        for lobe in lobes {
            rest -= visible(lobe.alpha, lobe.weight);
            if rest < 0.0 {
                return lobe.alpha;
            }
        }
        lobes.last().map_or(1.0, |lobe| lobe.alpha)
    }
}

/// The GGX width that makes the second moment of the weights smallest at normal incidence.
///
/// # Formula
///
/// ```text
/// E[w²] ∝ ∫ S(x)²/S_ggx(x) dx ∝ α_g² M_0 + 2 M_1 + M_2/α_g²,     M_k = ∫ S(x)² x^k dx
/// α_g⁴ = M_2/M_0
/// ```
///
/// with S = D cos⁴θ the slope density at x = tan²θ, S_ggx ∝ α_g²/(α_g² + x)², and Fresnel and
/// masking taken as constant over the lobe. Of order √α, not α.
#[must_use]
pub fn tuned_ggx_width(params: &ChannelParams) -> f64 {
    const NODES: usize = 64;
    const LARGEST_DECAY: f64 = 40.0;
    let ndf = SgdNdf::new(params.alpha, params.p);
    let alpha2 = params.alpha * params.alpha;
    // v = ln(1 + x/α²) resolves the peak and the tail alike.
    let end = (LARGEST_DECAY / params.alpha).ln_1p();
    let (mut m0, mut m2) = (0.0, 0.0);
    for node in gauss_legendre(NODES) {
        let v = end * node.x;
        let x = alpha2 * v.exp_m1();
        let s = ndf.slope_density(x) / ndf.peak();
        let weight = s * s * v.exp() * node.weight;
        m0 += weight;
        m2 += weight * x * x;
    }
    (m2 / m0).powf(0.25)
}

/// One draw of the estimator that the paper's supplement prints for the albedo of a channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PublishedSample {
    /// The weight as printed.
    pub printed: f64,
    /// The weight with its Jacobian put right.
    pub corrected: f64,
}

/// The published estimator: GGX normals of width α, the lobe chosen by ρs/(ρd + ρs).
///
/// # Formula
///
/// ```text
/// θm = atan(α √u/√(1−u)),   w = 4 ρs/p_spec · F D G cos³θm (α² + tan²θm)²/α²
/// ```
///
/// The printed weight is biased: it divides by 4 cosθ of the fixed direction where the density of
/// the reflected direction has 4 ⟨wo, h⟩. The corrected weight is the printed one times
/// ⟨wo, h⟩/cosθo. The width α, where √α would fit the lobe, makes both very noisy.
#[must_use]
pub fn published_sample(
    channel: &ChannelBrdf,
    wo: DVec3,
    [choice, u, v]: [f64; 3],
) -> PublishedSample {
    let specular_share = channel.rho_s / (channel.rho_d + channel.rho_s);
    if choice >= specular_share || !above_horizon(wo) {
        let diffuse = if above_horizon(wo) { channel.rho_d / (1.0 - specular_share) } else { 0.0 };
        return PublishedSample { printed: diffuse, corrected: diffuse };
    }
    let alpha = channel.ndf.alpha();
    let tan2_m = alpha * alpha * u / (1.0 - u);
    let (sin_phi, cos_phi) = (2.0 * PI * v).sin_cos();
    let tan_m = tan2_m.sqrt();
    let h = DVec3::new(tan_m * cos_phi, tan_m * sin_phi, 1.0).normalize();
    let wi = 2.0 * wo.dot(h) * h - wo;
    if !above_horizon(wi) || wo.dot(h) <= 0.0 {
        return PublishedSample::default();
    }
    let fdg = channel.fresnel.eval(wo.dot(h))
        * channel.ndf.eval(tan2_m)
        * channel.masking.g1(cot_theta(wi))
        * channel.masking.g1(cot_theta(wo));
    let spread = (alpha * alpha + tan2_m) / alpha;
    let printed = 4.0 * channel.rho_s / specular_share * fdg * h.z.powi(3) * spread * spread;
    PublishedSample { printed, corrected: printed * wo.dot(h) / cos_theta(wo) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::find;

    #[test]
    fn shares_choose_and_rescale() {
        assert_eq!(choose([0.25, 0.75], 0.125), (0, 0.5));
        assert_eq!(choose([0.25, 0.75], 0.625), (1, 0.5));
        assert_eq!(choose([0.0, 1.0], 0.0), (1, 0.0));
        assert_eq!(choose([1.0, 0.0], 1.0), (0, 0.5));
    }

    #[test]
    fn the_tuned_width_is_a_minimum() {
        for (name, channel) in [("chrome", 2), ("gold-paint", 1), ("pink-fabric", 0)] {
            let params = &find(name).expect("catalogue").material.channels[channel];
            let ndf = SgdNdf::new(params.alpha, params.p);
            // ∫ D²/D_ggx cosθ dω over v = ln(1 + x/α²), where cosθ dω ∝ dx/(1+x)².
            let second_moment = |width: f64| -> f64 {
                let ggx = GgxNdf { alpha: width };
                let alpha2 = params.alpha * params.alpha;
                (0..20_000)
                    .map(|i| alpha2 * (f64::from(i) * 1e-3).exp_m1())
                    .filter(|x| *x < 40.0 * params.alpha)
                    .map(|x| {
                        let ratio = ndf.eval(x).powi(2) / ggx.eval(x);
                        ratio * (alpha2 + x) / (1.0 + x).powi(2)
                    })
                    .sum()
            };
            let tuned = tuned_ggx_width(params);
            let best = second_moment(tuned);
            assert!(
                best < second_moment(tuned * 1.05) && best < second_moment(tuned / 1.05),
                "{name}"
            );
        }
    }
}
