//! The Shifted Gamma Distribution.

use std::f64::consts::PI;

use glam::DVec3;

use crate::math::exponential_integral::scaled_exponential_integral;
use crate::math::quadrature::gauss_legendre;
use crate::microfacet::distribution::from_slope_density;
use crate::microfacet::{BeckmannMixture, Distribution, G1Table};

/// The Shifted Gamma Distribution of Bagher, Soler and Holzschuch (2012), equation 11.
///
/// # Formula
///
/// ```text
/// D(θ) = P22(tan²θ)/(π cos⁴θ),   P22(x) = K e^{-t} t^{-p},   t = α + x/α,   K = 1/(α Γ(1-p, α))
/// ```
///
/// evaluated as P22(x) = P22(0) e^{−x/α} (1 + x/α²)^{−p} with P22(0) = 1/(α² eᵅE_p(α)), which is
/// the same without Γ of a negative order and without overflow for any α, p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SgdNdf {
    alpha: f64,
    p: f64,
    peak: f64,
}

impl SgdNdf {
    /// The distribution of shape `alpha` > 0, `p` ≥ 0.
    #[must_use]
    pub fn new(alpha: f64, p: f64) -> Self {
        // K = 1/(α Γ(1−p, α)) by way of eᵅE_p(α), which has no pole and cannot underflow.
        let scaled_e_p = scaled_exponential_integral(p, alpha);
        Self { alpha, p, peak: 1.0 / (PI * alpha * alpha * scaled_e_p) }
    }

    /// The normalisation K = 1/(α Γ(1−p, α)) of the published table.
    #[must_use]
    pub fn k(&self) -> f64 {
        // P22(0) = K e^{−α} α^{−p}, the definition at x = 0, and the peak is P22(0)/π.
        PI * self.peak * self.alpha.exp() * self.alpha.powf(self.p)
    }

    /// D at θ = 0, the largest value of D·cos⁴θ \[1/sr\].
    #[must_use]
    pub fn peak(&self) -> f64 {
        self.peak
    }

    /// The width α.
    #[must_use]
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    /// The exponent p of the power factor.
    #[must_use]
    pub fn p(&self) -> f64 {
        self.p
    }

    /// ln(D·cos⁴θ / D(0)) = −x/α − p ln(1 + x/α²) at x = tan²θ; 0 at the peak, never above.
    #[must_use]
    pub fn log_decay(&self, tan2_theta: f64) -> f64 {
        -tan2_theta / self.alpha - self.p * (tan2_theta / self.alpha / self.alpha).ln_1p()
    }

    /// D·cos⁴θ = P22(x)/π at x = tan²θ.
    #[must_use]
    pub fn slope_density(&self, tan2_theta: f64) -> f64 {
        // At x = ∞ the power is 0, or for p = 0 a NaN from 0·∞: hence the test of the decay.
        let decay = (-tan2_theta / self.alpha).exp();
        let power = (-self.p * (tan2_theta / self.alpha / self.alpha).ln_1p()).exp();
        if decay == 0.0 { 0.0 } else { self.peak * decay * power }
    }

    /// D at x = tan²θ \[1/sr\].
    #[must_use]
    pub fn ndf(&self, tan2_theta: f64) -> f64 {
        from_slope_density(self.slope_density(tan2_theta), tan2_theta)
    }
}

/// SGD with all that follows from it: D in closed form, masking and visible normals through the
/// Beckmann mixture that it is.
///
/// # Formula
///
/// Λ(θ) = ∫_{cotθ}^∞ (r tanθ − 1) P2(r) dr = Σ w_j Λ_beckmann(cotθ/α_j),   G1 = 1/(1+Λ)
///
/// # Example
///
/// ```
/// use sgdbake::{Distribution, Sgd, microfacet::Accuracy};
///
/// let d = Sgd::new(0.12, 0.8, Accuracy::Reference);
/// assert!(d.ndf(0.0) > d.ndf(0.1));
/// assert!(d.g1(1.0) < 1.0 && d.g1(1e9) > 0.999);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Sgd {
    ndf: SgdNdf,
    mixture: BeckmannMixture,
    table: Option<G1Table>,
}

/// How exact a distribution's masking is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Accuracy {
    /// To rounding: what everything else is measured against.
    #[default]
    Reference,
    /// 1e-8, below what a float texel or any number of samples can hold.
    Table,
    /// 1e-6, below what a picture or an integral of six digits can show.
    Picture,
}

impl Accuracy {
    /// The relative error of G1.
    #[must_use]
    pub fn relative(self) -> f64 {
        match self {
            Self::Reference => 1e-13,
            Self::Table => 1e-8,
            Self::Picture => 1e-6,
        }
    }
}

impl Sgd {
    /// The distribution of shape `alpha` > 0, `p` ≥ 0.
    #[must_use]
    pub fn new(alpha: f64, p: f64, accuracy: Accuracy) -> Self {
        Self {
            ndf: SgdNdf::new(alpha, p),
            mixture: BeckmannMixture::new(alpha, p, accuracy.relative()),
            table: None,
        }
    }

    /// The same with G1 from a table, for many evaluations: within a relative 1e-8 of the sum.
    #[must_use]
    pub fn tabulated(mut self) -> Self {
        self.table = Some(G1Table::of(&self.mixture));
        self
    }

    /// The widths of the narrowest and of the widest Beckmann component.
    #[must_use]
    pub fn widths(&self) -> [f64; 2] {
        self.mixture.widths()
    }

    /// The Beckmann mixture that its masking is made of.
    #[must_use]
    pub fn mixture(&self) -> &BeckmannMixture {
        &self.mixture
    }

    /// D in closed form.
    #[must_use]
    pub fn closed_form(&self) -> &SgdNdf {
        &self.ndf
    }

    /// The width α.
    #[must_use]
    pub fn alpha(&self) -> f64 {
        self.ndf.alpha
    }

    /// The exponent p of the power factor.
    #[must_use]
    pub fn p(&self) -> f64 {
        self.ndf.p
    }

    /// D at θ = 0, the largest value of D·cos⁴θ \[1/sr\].
    #[must_use]
    pub fn peak(&self) -> f64 {
        self.ndf.peak
    }
}

impl Distribution for Sgd {
    fn slope_density(&self, tan2_theta: f64) -> f64 {
        self.ndf.slope_density(tan2_theta)
    }

    fn lambda(&self, cot_theta: f64) -> f64 {
        self.mixture.lambda(cot_theta)
    }

    fn g1(&self, cot_theta: f64) -> f64 {
        match &self.table {
            Some(table) => table.g1(cot_theta),
            None => 1.0 / (1.0 + self.lambda(cot_theta)),
        }
    }

    fn visible_normal(&self, wo: DVec3, u: [f64; 3]) -> DVec3 {
        self.mixture.visible_normal(wo, u)
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
pub fn tuned_ggx_width(ndf: &SgdNdf) -> f64 {
    const NODES: usize = 64;
    /// x/α at which S² has fallen by e^{−80}.
    const LARGEST_DECAY: f64 = 40.0;
    let alpha2 = ndf.alpha() * ndf.alpha();
    // v = ln(1 + x/α²) resolves the peak and the tail alike.
    let end = (LARGEST_DECAY / ndf.alpha()).ln_1p();
    let (mut m0, mut m2) = (0.0, 0.0);
    for node in gauss_legendre(NODES) {
        let v = end * node.x;
        let x = alpha2 * v.exp_m1();
        // The peak cancels in M_2/M_0, as do the factors of dx that are constant.
        let s = ndf.slope_density(x) / ndf.peak();
        // dx = α² e^v dv.
        let weight = s * s * v.exp() * node.weight;
        m0 += weight;
        m2 += weight * x * x;
    }
    (m2 / m0).powf(0.25)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::find;
    use crate::microfacet::{Beckmann, Ggx};

    #[test]
    fn p_zero_is_beckmann_of_width_sqrt_alpha() {
        let (sgd, beckmann) = (SgdNdf::new(0.04, 0.0), Beckmann { alpha: 0.2 });
        for x in [0.0, 0.01, 0.3, 2.0] {
            assert!((sgd.ndf(x) / beckmann.ndf(x) - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn grazing_is_finite() {
        assert_eq!(SgdNdf::new(0.01, 0.5).ndf(f64::INFINITY), 0.0);
    }

    /// ∫ D²/D_ggx cosθ dω over v = ln(1 + x/α²), where cosθ dω ∝ dx/(1+x)².
    fn second_moment(ndf: &SgdNdf, alpha: f64, width: f64) -> f64 {
        let (ggx, alpha2) = (Ggx { alpha: width }, alpha * alpha);
        (0..20_000)
            .map(|i| alpha2 * (f64::from(i) * 1e-3).exp_m1())
            .filter(|x| *x < 40.0 * alpha)
            .map(|x| ndf.ndf(x).powi(2) / ggx.ndf(x) * (alpha2 + x) / (1.0 + x).powi(2))
            .sum()
    }

    #[test]
    fn the_tuned_width_is_a_minimum() {
        for (name, channel) in [("chrome", 2), ("gold-paint", 1), ("pink-fabric", 0)] {
            let params = &find(name).expect("catalogue").channels[channel];
            let ndf = SgdNdf::new(params.alpha, params.p);
            let tuned = tuned_ggx_width(&ndf);
            let [narrower, best, wider] =
                [0.95, 1.0, 1.05].map(|factor| second_moment(&ndf, params.alpha, factor * tuned));
            assert!(best < narrower && best < wider, "{name}");
        }
    }
}
