//! The laws that a material's evaluator keeps for any parameters, and how far it is from each.

use std::f64::consts::{FRAC_PI_2, PI};

use serde::Serialize;

use crate::brdf::albedo::FresnelMoments;
use crate::brdf::{Lobe, SgdBrdf};
use crate::material::LobeParams;
use crate::math::direction::{cos_sin_degrees, cot_theta, spherical};
use crate::math::quadrature::gauss_legendre;
use crate::microfacet::{Distribution as _, FittedMasking, Sgd, SgdNdf};

/// A law and how far the evaluator is from it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Check {
    /// The law.
    pub law: Law,
    /// The largest deviation measured.
    pub deviation: f64,
    /// The deviation that rounding, or the precision of the printed table, explains.
    pub bound: f64,
}

/// A property of any parameters in range, if the evaluator is right.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// f(wi, wo) = f(wo, wi).
    Reciprocity,
    /// ∫ D cosθ dω = 1.
    Normalisation,
    /// ∫ D G1(wo) ⟨wo,h⟩ dω = cosθo.
    WeakFurnace,
    /// The albedo with F ≡ 1 and 4ρs/π ≡ 1 is at most 1.
    NoGain,
    /// G1 is in [0, 1] and falls with θ.
    FallingMasking,
    /// K follows from α and p as printed; of catalogue materials only.
    PrintedK,
    /// θ0 follows from λ, c and k as printed; of catalogue materials only.
    PrintedTheta0,
}

impl Check {
    /// Returns whether the law is kept.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.deviation <= self.bound
    }
}

/// |f(wi, wo) − f(wo, wi)|/f over pairs of every elevation.
#[must_use]
pub fn reciprocity(brdf: &SgdBrdf, c: usize) -> Check {
    let deviation = worst((0..17 * 17).map(|i| {
        // Every pair of 17 elevations, none at 0° or 90°.
        let [theta_i, theta_o] =
            [i % 17, i / 17].map(|step| FRAC_PI_2 * (f64::from(step) + 0.5) / 17.0);
        let (wi, wo) = (spherical(theta_i, 0.3 * f64::from(i)), spherical(theta_o, 1.1));
        let (there, back): (f64, f64) = (brdf.eval(wi, wo)[c], brdf.eval(wo, wi)[c]);
        // Both may be 0, which is no deviation.
        if there == back { 0.0 } else { (there - back).abs() / there.abs().max(back.abs()) }
    }));
    Check { law: Law::Reciprocity, deviation, bound: 2.0 * f64::EPSILON }
}

/// ∫ D cosθ dω = π ∫ D cos⁴θ dx over x = tan²θ.
#[must_use]
pub fn normalisation(ndf: &SgdNdf) -> Check {
    let rule = slope_rule(ndf, f64::INFINITY);
    let integral: f64 = rule.iter().map(|(x, dx)| PI * ndf.slope_density(*x) * dx).sum();
    Check { law: Law::Normalisation, deviation: (integral - 1.0).abs(), bound: 1e-10 }
}

/// ∫ D G1(wo) ⟨wo,h⟩ dω/cosθo at five angles.
#[must_use]
pub fn weak_furnace(lobe: &Lobe<Sgd>) -> Check {
    let deviation = worst([5.0, 45.0, 75.0, 85.0, 89.0].map(|theta_deg: f64| {
        let wo = spherical(theta_deg.to_radians(), 0.0);
        // A facet begins to be turned away where its slope exceeds cotθo.
        let rule = slope_rule(lobe.distribution.closed_form(), cot_theta(wo).powi(2));
        // ⟨wo,h⟩/cosθh = cosθo + sinθo tanθh cosφ.
        let facing: f64 = rule
            .iter()
            .map(|(x, dx)| {
                PI * lobe.distribution.slope_density(*x) * facing_mean(wo.z, wo.x * x.sqrt()) * dx
            })
            .sum();
        (facing * lobe.g1(cot_theta(wo)) / wo.z - 1.0).abs()
    }));
    Check { law: Law::WeakFurnace, deviation, bound: 1e-9 }
}

/// The mean over azimuth of max(0, a + b cosφ), a > 0, b ≥ 0.
fn facing_mean(a: f64, b: f64) -> f64 {
    if b <= a {
        return a;
    }
    // Beyond this azimuth the facet is turned away.
    let limit = (-a / b).acos();
    (a * limit + b * limit.sin()) / PI
}

/// The excess over 1 of the albedo with F ≡ 1.
#[must_use]
pub fn no_gain(lobe: &Lobe<Sgd>) -> Check {
    let gains = [0.0, 40.0, 70.0, 85.0, 89.0]
        .map(|theta_deg| FresnelMoments::new(lobe, cos_sin_degrees(theta_deg).0).one - 1.0);
    let deviation = worst(gains);
    Check { law: Law::NoGain, deviation, bound: 1e-5 }
}

/// The largest distance of G1 from [0, 1], or its largest rise with θ.
#[must_use]
pub fn falling_masking(lobe: &Lobe<Sgd>) -> Check {
    let angles = (0..=360).map(|step| cos_sin_degrees(f64::from(step) * 0.25));
    let values: Vec<f64> = angles.map(|(cos, sin)| lobe.g1(cos / sin)).collect();
    let outside = values.iter().map(|g1| (g1 - 1.0).max(-g1));
    let rise = values.windows(2).map(|pair| pair[1] - pair[0]);
    let deviation = worst(outside.chain(rise));
    Check { law: Law::FallingMasking, deviation, bound: 1e-12 }
}

/// The largest excess, 0 where there is none; NaN if one is NaN, which keeps no law.
#[must_use]
pub fn worst(excesses: impl IntoIterator<Item = f64>) -> f64 {
    // clamp keeps a NaN and abs its sign positive, so that total_cmp puts it last.
    let excesses = excesses.into_iter().map(|excess| excess.clamp(0.0, f64::INFINITY).abs());
    excesses.max_by(f64::total_cmp).unwrap_or(0.0)
}

/// The relative difference of K from the printed one.
#[must_use]
pub fn printed_k(lobe: &LobeParams, printed: f64) -> Check {
    let deviation = (SgdNdf::new(lobe.alpha(), lobe.p()).k() / printed - 1.0).abs();
    Check { law: Law::PrintedK, deviation, bound: PRINT_PRECISION }
}

/// The difference of θ0 from the printed one; `None` of a lobe without a masking fit.
#[must_use]
pub fn printed_theta0(lobe: &LobeParams, printed: f64) -> Option<Check> {
    let theta0 = FittedMasking::new(lobe.masking()?).theta0();
    Some(Check {
        law: Law::PrintedTheta0,
        deviation: (theta0 - printed).abs(),
        bound: PRINT_PRECISION,
    })
}

/// The precision of the table's six digits, relative for K, in radians for θ0.
const PRINT_PRECISION: f64 = 6e-6;

/// Nodes (x, dx) over x = tan²θ, dense on every logarithmic scale from far below the lobe's core to
/// where it has vanished; beyond `kink` in powers of √(x − kink).
fn slope_rule(ndf: &SgdNdf, kink: f64) -> Vec<(f64, f64)> {
    const TINY: f64 = 1e-14;
    // The power factor turns at x = α², the exponential at x = α.
    let core = ndf.alpha().min(ndf.alpha() * ndf.alpha());
    let (low, high) = (TINY * core, 800.0 * ndf.alpha());
    if kink >= high {
        return log_rule(low, high);
    }
    let end = (high - kink).sqrt();
    // x = kink + t² takes the square root out of the integrand.
    let beyond = log_rule(1e-9 * end, end).into_iter().map(|(t, dt)| (kink + t * t, 2.0 * t * dt));
    let below = if kink > low { log_rule(low, kink) } else { Vec::new() };
    below.into_iter().chain(beyond).collect()
}

/// Gauss–Legendre in ln x, a piece for every factor e².
fn log_rule(low: f64, high: f64) -> Vec<(f64, f64)> {
    let length = (high / low).ln();
    let pieces = (length / 2.0).ceil().max(1.0);
    let width = length / pieces;
    let nodes = gauss_legendre(24);
    let mut rule = Vec::with_capacity(pieces as usize * nodes.len());
    for i in 0..pieces as u32 {
        let start = low.ln() + f64::from(i) * width;
        for node in &nodes {
            let x = (start + node.x * width).exp();
            // dx = x d(ln x).
            rule.push((x, node.weight * width * x));
        }
    }
    rule
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_keeps_no_law() {
        assert_eq!(worst([-2.0, 0.5, 0.25]), 0.5);
        assert_eq!(worst([-2.0, -1.0]), 0.0);
        for nan in [f64::NAN, -f64::NAN] {
            let deviation = worst([0.5, nan, 0.25]);
            assert!(!Check { law: Law::NoGain, deviation, bound: 1.0 }.holds());
        }
    }
}
