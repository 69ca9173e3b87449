//! The best single Beckmann or GGX lobe.

use std::f64::consts::FRAC_1_PI;

use nalgebra::DVector;
use serde::Serialize;

use crate::brdf::one_lobe::{
    Distribution, OneLobeBrdf, OneLobeChannel, SCALE_OF_RHO_S, ScaledFresnel,
};
use crate::fit::metric::Metric;
use crate::fit::reason::{self, Reason};
use crate::fit::target::{Pair, Target};
use crate::material::{Channel, ChannelParams, Material};
use crate::math::box_least_squares::{Bounds, Minimum, Residuals, minimise};
use crate::math::line_search::{Point, refine};

/// The best fits of one lobe: a width per channel, and one width for all three.
#[derive(Clone, Debug, Serialize)]
pub struct OneLobeFit {
    /// The best of every channel by itself.
    pub per_channel: OneLobeBrdf,
    /// The best with one width for the three channels.
    pub joint: OneLobeBrdf,
    /// Relative residuals of `per_channel`.
    pub per_channel_residual: [f64; 3],
    /// Relative residuals of `joint`.
    pub joint_residual: [f64; 3],
    /// What is odd about the material or the fit.
    pub reasons: Vec<Reason>,
}

/// The widths that are searched: a mirror for any picture, to the widest slope that is a surface.
pub const ALPHA_RANGE: [f64; 2] = [1e-3, 2.0];
/// Widths looked at before the best is refined; the residual has one valley per lobe of the
/// target, none narrower than a factor of two.
const SCAN: usize = 12;
/// Relative width of the final bracket of α.
const ALPHA_TOLERANCE: f64 = 1e-4;

/// The best lobe of `distribution` for a material, in the default metric.
#[must_use]
pub fn fit(material: &Material, distribution: Distribution) -> OneLobeFit {
    fit_target(&Target::new(material), distribution, Metric::default())
}

/// The best lobe of `distribution` for a target, in `metric`.
///
/// For a given width everything but the transform is linear: four non-negative coefficients per
/// channel, found by [`minimise`]; the width is found by a scan over its whole range and golden
/// sections around the best.
#[must_use]
pub fn fit_target(target: &Target, distribution: Distribution, metric: Metric) -> OneLobeFit {
    let search = Search::new(target, distribution, metric);
    let alphas = alpha_scan();
    let scan: Vec<[f64; 3]> =
        alphas.iter().map(|alpha| search.channels(*alpha).map(|m| m.squares)).collect();
    let points = |value: &dyn Fn(&[f64; 3]) -> f64| -> Vec<Point> {
        alphas.iter().zip(&scan).map(|(a, v)| Point { x: a.ln(), value: value(v) }).collect()
    };
    let joint_alpha = refine(&points(&|v| v.iter().sum()), ALPHA_TOLERANCE, |x| {
        search.channels(x.exp()).iter().map(|m| m.squares).sum()
    })
    .x
    .exp();
    let alpha: [f64; 3] = std::array::from_fn(|c| {
        if !reason::has_visible_lobe(&target.material.channels[c]) {
            return joint_alpha;
        }
        refine(&points(&|v| v[c]), ALPHA_TOLERANCE, |x| search.channel(c, x.exp()).squares).x.exp()
    });
    let per_channel = search.brdf(alpha);
    let joint = search.brdf([joint_alpha; 3]);
    let residual = |brdf: &OneLobeBrdf| {
        std::array::from_fn(|c| target.residual(metric, c, &search.values(brdf, c)))
    };
    OneLobeFit {
        per_channel_residual: residual(&per_channel),
        joint_residual: residual(&joint),
        reasons: reasons(&target.material, &alpha),
        per_channel,
        joint,
    }
}

fn reasons(material: &Material, alpha: &[f64; 3]) -> Vec<Reason> {
    let widest = |c: &usize| alpha[*c] > 0.99 * ALPHA_RANGE[1];
    let widest = (0..3).filter(widest).map(|c| Reason::WidestLobe(Channel::ALL[c]));
    reason::of_material(material).into_iter().chain(widest).collect()
}

/// Widths spaced evenly in ln α.
fn alpha_scan() -> Vec<f64> {
    let [low, high] = ALPHA_RANGE.map(f64::ln);
    (0..SCAN).map(|i| (low + (high - low) * i as f64 / (SCAN - 1) as f64).exp()).collect()
}

/// The unknowns of a channel at a given width, all ≥ 0: ρd, f0, f90 and f0 − f1 = F(0°).
type Coefficients = DVector<f64>;

/// Everything that does not depend on the unknowns.
struct Search<'a> {
    target: &'a Target,
    distribution: Distribution,
    metric: Metric,
    /// The Fresnel curve's share of (f0, f90, F(0°)) at each pair.
    fresnel: Vec<[f64; 3]>,
    start: [Coefficients; 3],
}

impl<'a> Search<'a> {
    fn new(target: &'a Target, distribution: Distribution, metric: Metric) -> Self {
        let fresnel = target.pairs.iter().map(|pair| fresnel_basis(pair.cos_theta_d)).collect();
        let start = target.material.channels.each_ref().map(published_coefficients);
        Self { target, distribution, metric, fresnel, start }
    }

    /// The best coefficients of every channel at width `alpha`.
    fn channels(&self, alpha: f64) -> [Minimum; 3] {
        let lobe = self.lobe(alpha);
        std::array::from_fn(|c| self.coefficients(c, &lobe))
    }

    /// The best coefficients of one channel at width `alpha`.
    fn channel(&self, channel: usize, alpha: f64) -> Minimum {
        self.coefficients(channel, &self.lobe(alpha))
    }

    /// D G1 G1/(4 cosθi cosθo) at every pair.
    fn lobe(&self, alpha: f64) -> Vec<f64> {
        let value = |pair: &Pair| {
            let v = |side: usize| {
                let lambda = self.distribution.lambda(alpha, pair.cot_theta[side]);
                1.0 / ((1.0 + lambda) * pair.cos_theta[side])
            };
            0.25 * self.distribution.ndf(alpha, pair.tan2_theta_h) * (v(0) * v(1))
        };
        self.target.pairs.iter().map(value).collect()
    }

    fn coefficients(&self, channel: usize, lobe: &[f64]) -> Minimum {
        let exact = &self.target.channels[channel];
        let goal: Vec<f64> = self
            .target
            .pairs
            .iter()
            .zip(exact)
            .map(|(pair, f)| self.metric.transform(*f, pair.cos_theta[0]).0)
            .collect();
        let equations = |x: &Coefficients| {
            let mut sums = Residuals::none();
            for (i, pair) in self.target.pairs.iter().enumerate() {
                let [bump, grazing, facing] = self.fresnel[i].map(|share| share * lobe[i]);
                let basis = [FRAC_1_PI, bump, grazing, facing];
                let f: f64 = basis.iter().zip(x.iter()).map(|(b, x)| b * x).sum();
                let (value, slope) = self.metric.transform(f, pair.cos_theta[0]);
                sums.add(pair.weight, value - goal[i], &basis.map(|b| b * slope));
            }
            sums.into()
        };
        minimise(equations, &self.start[channel], &Bounds::non_negative(4))
    }

    /// The fit with the given widths.
    fn brdf(&self, alpha: [f64; 3]) -> OneLobeBrdf {
        let channels = std::array::from_fn(|c| {
            let x = self.channel(c, alpha[c]).x;
            let fresnel = ScaledFresnel { f0: x[1], f90: x[2], f1: x[1] - x[3] };
            OneLobeChannel { rho_d: x[0], alpha: alpha[c], fresnel }
        });
        OneLobeBrdf { distribution: self.distribution, channels }
    }

    /// f of one channel of a fit at every pair.
    fn values(&self, brdf: &OneLobeBrdf, channel: usize) -> Vec<f64> {
        let channel = &brdf.channels[channel];
        let lobe = self.lobe(channel.alpha);
        let pairs = self.target.pairs.iter().zip(&lobe);
        pairs
            .map(|(pair, lobe)| {
                channel.rho_d * FRAC_1_PI + channel.fresnel.eval(pair.cos_theta_d) * lobe
            })
            .collect()
    }
}

/// F = f0·(1 − u − cosθd) + f90·u + F(0°)·cosθd with u = (1−cosθd)⁵: all three shares are ≥ 0.
fn fresnel_basis(cos_theta_d: f64) -> [f64; 3] {
    let u = (1.0 - cos_theta_d).powi(5);
    [1.0 - u - cos_theta_d, u, cos_theta_d]
}

/// The published coefficients, in units of a lobe with ¼.
fn published_coefficients(params: &ChannelParams) -> Coefficients {
    let scale = SCALE_OF_RHO_S * params.rho_s;
    let facing = (params.f0 - params.f1).max(0.0);
    DVector::from_vec(vec![params.rho_d, scale * params.f0, scale, scale * facing])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Beckmann material is recovered by the Beckmann fit.
    #[test]
    fn a_beckmann_channel_is_its_own_fit() {
        let channel = |alpha: f64| ChannelParams {
            rho_d: 0.2,
            rho_s: 0.3,
            alpha,
            p: 0.0,
            f0: 0.4,
            f1: 0.1,
            masking: None,
        };
        let channels = [0.01, 0.04, 0.16].map(channel);
        let fit = fit(&Material { name: "beckmann".to_owned(), channels }, Distribution::Beckmann);
        for (fitted, exact) in fit.per_channel.channels.iter().zip(&channels) {
            assert!((fitted.alpha / exact.alpha.sqrt() - 1.0).abs() < 1e-3, "{fitted:?}");
            assert!((fitted.rho_d - exact.rho_d).abs() < 1e-4, "{fitted:?}");
            let facing = fitted.fresnel.f0 - fitted.fresnel.f1;
            assert!((facing / (SCALE_OF_RHO_S * 0.3 * 0.3) - 1.0).abs() < 1e-2, "{fitted:?}");
        }
    }
}
