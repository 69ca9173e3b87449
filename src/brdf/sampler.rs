//! Drawing directions for a material: one direction serves all colours.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::DVec3;

use crate::brdf::reflectance::{Reflectance, Sample, cosine_sample};
use crate::brdf::{Lobe, MaskingKind, SgdBrdf};
use crate::material::{MAX_LOBES, Material};
use crate::math::direction::{above_horizon, cos_theta, cot_theta, tan2_theta};
use crate::microfacet::{
    Accuracy, Distribution as _, Ggx, Sgd, VisibleNormals, from_slope_density, tuned_ggx_width,
};

/// The distributions that half vectors are drawn from.
///
/// # Example
///
/// ```
/// use sgdbake::{MaskingKind, Sampler, Strategy, named, spherical};
///
/// let wo = spherical(0.8, 0.0);
/// for strategy in [Strategy::Vndf, Strategy::Ggx] {
///     let sampler = Sampler::new(named("chrome")?, MaskingKind::Exact, strategy);
///     if let Some(drawn) = sampler.sample_with_weight(wo, [0.1, 0.5, 0.7]) {
///         assert!(drawn.pdf > 0.0);
///     }
/// }
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
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
pub struct WeightedDirection {
    /// The direction to the light.
    pub wi: DVec3,
    /// Its density \[1/sr\].
    pub pdf: f64,
    /// f·cosθi/pdf per colour.
    pub weight: [f64; 3],
}

/// Keeps a lobe alive where its Fresnel curve crosses zero at θd = θo.
pub(crate) const MIN_FRESNEL: f64 = 0.05;

/// Draws directions for a material.
///
/// # Formula
///
/// ```text
/// pdf(wi) = q_d cosθi/π + Σ_j q_j pdf_j(wi),     pdf_j = D_j(h) G1_j(wo)/(4 cosθo)
/// ```
///
/// The technique — diffuse, or lobe j — is chosen by q(wo); the density is that of all techniques
/// together (the balance heuristic of Veach and Guibas 1995), so every colour's weight
/// f·cosθi/pdf is bounded by that of its own technique alone over q_j, and no colour sparkles
/// where another colour's lobe found its peak.
///
/// # Example
///
/// ```
/// use sgdbake::{MaskingKind, Sampler, Strategy, named, spherical};
///
/// let sampler = Sampler::new(named("gold-paint")?, MaskingKind::Exact, Strategy::Vndf);
/// let drawn = sampler.sample_with_weight(spherical(0.5, 0.0), [0.2, 0.3, 0.6]);
/// // f cosθi/pdf per colour; None is a draw below the horizon.
/// assert!(drawn.is_none_or(|drawn| drawn.weight.iter().all(|w| w.is_finite())));
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Sampler {
    brdf: SgdBrdf,
    /// One a lobe.
    normals: Vec<Normals>,
}

/// The visible normals that are drawn for a lobe.
#[derive(Clone, Debug, PartialEq)]
enum Normals {
    /// The lobe's own.
    Own(VisibleNormals),
    /// GGX in their place.
    Ggx(Ggx),
}

impl Sampler {
    /// The sampler of a material by `strategy`. Its masking is accurate to 1e-8, far below the
    /// noise of any number of samples.
    #[must_use]
    pub fn new(material: &Material, kind: MaskingKind, strategy: Strategy) -> Self {
        let brdf = SgdBrdf::with_accuracy(material, kind, Accuracy::Table).tabulated();
        let normals = brdf.lobes.iter().map(|lobe| Normals::new(&lobe.distribution, strategy));
        Self { normals: normals.collect(), brdf }
    }

    /// The sampler that draws GGX normals of these widths, one a lobe.
    #[must_use]
    pub fn with_ggx_widths(mut self, widths: &[f64]) -> Self {
        for (normals, alpha) in self.normals.iter_mut().zip(widths) {
            *normals = Normals::Ggx(Ggx { alpha: *alpha });
        }
        self
    }

    /// A direction for `wo` from three uniform numbers in [0, 1), with its density and weights;
    /// `None` where the draw falls below the horizon and carries nothing.
    #[must_use]
    pub fn sample_with_weight(&self, wo: DVec3, u: [f64; 3]) -> Option<WeightedDirection> {
        let towards = self.towards(wo)?;
        let wi = towards.sample(u)?;
        let (pdf, f) = towards.density_and_value(wi);
        Some(WeightedDirection { wi, pdf, weight: f.map(|f| f * cos_theta(wi) / pdf) })
    }

    /// The state that directions for one `wo` share; `None` below the horizon.
    #[must_use]
    pub fn towards(&self, wo: DVec3) -> Option<Towards<'_>> {
        above_horizon(wo).then(|| {
            let (cos, cot) = (cos_theta(wo), cot_theta(wo));
            let mut lobes = [LobeTowards::default(); MAX_LOBES];
            let shares = self.shares(cos);
            for ((normals, share), towards) in self.normals.iter().zip(shares).zip(&mut lobes) {
                if share > 0.0 {
                    let g1 = normals.g1(cot);
                    *towards = LobeTowards { g1, density: share * 0.25 * (g1 / cos) };
                }
            }
            Towards { sampler: self, wo, shares, lobes }
        })
    }

    /// q(wo): the shares of the lobes and of diffuse, about what each reflects.
    fn shares(&self, cos_theta_o: f64) -> [f64; MAX_LOBES + 1] {
        let mut shares = [0.0; MAX_LOBES + 1];
        for (lobe, share) in self.brdf.lobes.iter().zip(&mut shares) {
            *share = (0..3)
                .map(|c| {
                    4.0 * FRAC_1_PI
                        * lobe.rho_s[c]
                        * (lobe.fresnel[c].eval(cos_theta_o).abs() + MIN_FRESNEL)
                })
                .sum();
        }
        shares[MAX_LOBES] = self.brdf.rho_d.iter().sum();
        let total: f64 = shares.iter().sum();
        if total > 0.0 { shares.map(|share| share / total) } else { [0.0, 0.0, 0.0, 1.0] }
    }
}

impl Normals {
    fn new(sgd: &Sgd, strategy: Strategy) -> Self {
        match strategy {
            Strategy::Vndf => Self::Own(VisibleNormals::new(sgd.mixture())),
            Strategy::Ggx => Self::Ggx(Ggx { alpha: tuned_ggx_width(sgd.closed_form()) }),
        }
    }

    /// G1 at cotθ of what is drawn.
    fn g1(&self, cot_theta: f64) -> f64 {
        match self {
            Self::Own(own) => own.g1(cot_theta),
            Self::Ggx(ggx) => ggx.g1(cot_theta),
        }
    }

    /// D of what is drawn; `own` gives the lobe's.
    fn ndf(&self, tan2_theta: f64, own: impl FnOnce() -> f64) -> f64 {
        match self {
            Self::Own(_) => own(),
            Self::Ggx(ggx) => ggx.ndf(tan2_theta),
        }
    }

    fn draw(&self, wo: DVec3, g1: f64, u: [f64; 3]) -> DVec3 {
        match self {
            Self::Own(own) => own.draw(wo, g1, u),
            Self::Ggx(ggx) => ggx.visible_normal(wo, u),
        }
    }
}

impl Reflectance for Sampler {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.brdf.eval(wi, wo)
    }
}

impl Sample for Sampler {
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
    sampler: &'a Sampler,
    wo: DVec3,
    /// q(wo) of the lobes and of diffuse.
    shares: [f64; MAX_LOBES + 1],
    lobes: [LobeTowards; MAX_LOBES],
}

/// A lobe's part in [`Towards`].
#[derive(Clone, Copy, Debug, Default)]
struct LobeTowards {
    /// G1(wo) of the normals that are drawn.
    g1: f64,
    /// q_j G1_j(wo)/(4 cosθo).
    density: f64,
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
        let wi = match self.sampler.normals.get(technique) {
            Some(normals) => {
                let h = normals.draw(self.wo, self.lobes[technique].g1, [choice, u, v]);
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
        let tan2_h = tan2_theta(wi + self.wo);
        let of_lobe = |j: usize| match self.lobes[j].density {
            0.0 => 0.0,
            density => {
                let own = || own_ndf(&self.sampler.brdf.lobes[j], tan2_h);
                density * self.sampler.normals[j].ndf(tan2_h, own)
            }
        };
        self.diffuse_density(wi) + (0..MAX_LOBES).map(of_lobe).sum::<f64>()
    }

    /// The density and f at `wi` above the horizon, which share D.
    fn density_and_value(&self, wi: DVec3) -> (f64, [f64; 3]) {
        let brdf = &self.sampler.brdf;
        let half_sum = wi + self.wo;
        let (tan2_h, cos_d) = (tan2_theta(half_sum), (0.5 * half_sum.length()).min(1.0));
        let [at_i, at_o] = [wi, self.wo].map(|w| Elevation::new(w, &brdf.lobes));
        let (mut pdf, mut f) =
            (self.diffuse_density(wi), brdf.rho_d.map(|rho_d| rho_d * FRAC_1_PI));
        for ((lobe, towards), normals) in
            brdf.lobes.iter().zip(&self.lobes).zip(&self.sampler.normals)
        {
            let ndf = own_ndf(lobe, tan2_h);
            pdf += towards.density * normals.ndf(tan2_h, || ndf);
            let shape = FRAC_1_PI * ndf * (at_i.v(lobe) * at_o.v(lobe));
            for ((f, rho_s), fresnel) in f.iter_mut().zip(lobe.rho_s).zip(&lobe.fresnel) {
                if rho_s != 0.0 {
                    *f += rho_s * fresnel.eval(cos_d) * shape;
                }
            }
        }
        (pdf, f)
    }

    /// q_d cosθi/π.
    fn diffuse_density(&self, wi: DVec3) -> f64 {
        self.shares[MAX_LOBES] * cos_theta(wi) * FRAC_1_PI
    }
}

/// D of a lobe, by one exponential.
fn own_ndf(lobe: &Lobe<Sgd>, tan2_h: f64) -> f64 {
    let ndf = lobe.distribution.closed_form();
    from_slope_density(ndf.peak() * ndf.log_decay(tan2_h).exp(), tan2_h)
}

/// A direction as the masking of all lobes sees it.
#[derive(Clone, Copy, Debug)]
struct Elevation {
    cos: f64,
    cot: f64,
    /// π/2 − θ, where a lobe has fitted masking.
    angle: f64,
}

impl Elevation {
    fn new(w: DVec3, lobes: &[Lobe<Sgd>]) -> Self {
        let (cos, sin) = (cos_theta(w), w.truncate().length());
        let fitted = lobes.iter().any(|lobe| lobe.fitted.is_some());
        Self { cos, cot: cos / sin, angle: if fitted { (cos / sin).atan() } else { 0.0 } }
    }

    /// G1/cosθ of a lobe.
    fn v(&self, lobe: &Lobe<Sgd>) -> f64 {
        let g1 = match &lobe.fitted {
            Some(fitted) => fitted.g1_at_elevation(self.angle),
            None => lobe.distribution.g1(self.cot),
        };
        g1 / self.cos
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

/// One draw of the estimator that the paper's supplement prints for the albedo of a colour.
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
    brdf: &SgdBrdf,
    colour: usize,
    lobe: usize,
    wo: DVec3,
    [choice, u, v]: [f64; 3],
) -> PublishedSample {
    let (rho_d, lobe) = (brdf.rho_d[colour], &brdf.lobes[lobe]);
    let rho_s = lobe.rho_s[colour];
    let specular_share = rho_s / (rho_d + rho_s);
    if choice >= specular_share || !above_horizon(wo) {
        let diffuse = if above_horizon(wo) { rho_d / (1.0 - specular_share) } else { 0.0 };
        return PublishedSample { printed: diffuse, corrected: diffuse };
    }
    let alpha = lobe.distribution.alpha();
    let tan2_m = alpha * alpha * u / (1.0 - u);
    let (sin_phi, cos_phi) = (2.0 * PI * v).sin_cos();
    let tan_m = tan2_m.sqrt();
    let h = DVec3::new(tan_m * cos_phi, tan_m * sin_phi, 1.0).normalize();
    let wi = 2.0 * wo.dot(h) * h - wo;
    if !above_horizon(wi) || wo.dot(h) <= 0.0 {
        return PublishedSample::default();
    }
    let fdg = lobe.fresnel[colour].eval(wo.dot(h))
        * lobe.distribution.ndf(tan2_m)
        * lobe.g1(cot_theta(wi))
        * lobe.g1(cot_theta(wo));
    let spread = (alpha * alpha + tan2_m) / alpha;
    let printed = 4.0 * rho_s / specular_share * fdg * h.z.powi(3) * spread * spread;
    PublishedSample { printed, corrected: printed * wo.dot(h) / cos_theta(wo) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_choose_and_rescale() {
        assert_eq!(choose([0.25, 0.75], 0.125), (0, 0.5));
        assert_eq!(choose([0.25, 0.75], 0.625), (1, 0.5));
        assert_eq!(choose([0.0, 1.0], 0.0), (1, 0.0));
        assert_eq!(choose([1.0, 0.0], 1.0), (0, 0.5));
    }
}
