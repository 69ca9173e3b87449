//! The best single Beckmann or GGX lobe for a measurement.

use std::f64::consts::FRAC_1_PI;

use nalgebra::DVector;

use crate::brdf::gltf::schlick_weight;
use crate::brdf::{OneLobe, OneLobeChannel};
use crate::fit::descent::{by_steps, lowest};
use crate::fit::measured_target::MeasuredTarget;
use crate::math::least_squares::Bounds;
use crate::microfacet::{Distribution as _, Family, Fresnel};

/// ln α that is searched.
const LOG_ALPHA: [f64; 2] = [-6.9, 0.69];
/// Widths that a descent starts from.
const WIDTHS: [f64; 5] = [-4.6, -3.2, -2.2, -1.3, -0.5];
/// Share of the pairs that starts are compared on.
const THINNING: usize = 4;

/// Unknowns: ln α, then ρd, F(0°) and F(90°) of each channel.
const UNKNOWNS: usize = 10;

/// The best lobe: ρd, F(0°) and F(90°) of each channel and one width.
#[must_use]
pub fn fit(target: &MeasuredTarget, family: Family) -> OneLobe {
    let thin = target.thinned(THINNING);
    let bounds = bounds();
    let equations = |target: &MeasuredTarget, x: &DVector<f64>| {
        let sample = |x: &DVector<f64>| Sample { values: x.clone(), lobe: None };
        // Colours keep the lobe: it is evaluated once for them all.
        let lobe = lobe(target, family, x[0]);
        let model = |moved: &DVector<f64>| {
            let mut sample = sample(moved);
            if moved[0] != x[0] {
                sample.lobe = Some(self::lobe(target, family, moved[0]));
            }
            sample
        };
        by_steps(target, x, &bounds, model, |sample: &Sample, i| {
            let value = sample.lobe.as_ref().unwrap_or(&lobe)[i];
            let u = schlick_weight(target.pairs[i].cos_theta_d);
            std::array::from_fn(|c| {
                let [rho_d, f0, f90] = [1, 2, 3].map(|k| sample.values[3 * c + k]);
                rho_d * FRAC_1_PI + (f0 + (f90 - f0) * u) * value
            })
        })
    };
    let found = lowest(|x| equations(&thin, x), |x| equations(target, x), starts(target), &bounds);
    lobe_of(family, &found.x)
}

/// Unknowns, and their lobe where its width is another.
struct Sample {
    values: DVector<f64>,
    lobe: Option<Vec<f64>>,
}

fn lobe_of(family: Family, x: &DVector<f64>) -> OneLobe {
    let channel = |c: usize| OneLobeChannel {
        rho_d: x[3 * c + 1],
        alpha: x[0].exp(),
        fresnel: Fresnel { f0: x[3 * c + 2], f90: x[3 * c + 3], f1: 0.0 },
    };
    OneLobe { family, channels: [0, 1, 2].map(channel) }
}

fn bounds() -> Bounds {
    let mut bounds = Bounds::non_negative(UNKNOWNS);
    [bounds.lower[0], bounds.upper[0]] = LOG_ALPHA;
    for c in 0..3 {
        bounds.upper[3 * c + 1] = 1.0;
    }
    bounds
}

fn starts(target: &MeasuredTarget) -> Vec<DVector<f64>> {
    let typical = target.typical().map(|f| (std::f64::consts::PI * f).clamp(1e-3, 0.9));
    let start = |log_alpha: f64| {
        let mut x = DVector::zeros(UNKNOWNS);
        x[0] = log_alpha;
        for c in 0..3 {
            (x[3 * c + 1], x[3 * c + 2], x[3 * c + 3]) = (typical[c], 0.05, 0.3);
        }
        x
    };
    WIDTHS.map(start).to_vec()
}

/// D G1 G1/(4 cosθi cosθo) at every pair.
fn lobe(target: &MeasuredTarget, family: Family, log_alpha: f64) -> Vec<f64> {
    let distribution = family.of_width(log_alpha.exp());
    let value = |pair: &crate::fit::measured_target::MeasuredPair| {
        let v = |side: usize| {
            let lambda = distribution.lambda(pair.cot_theta[side]);
            1.0 / ((1.0 + lambda) * pair.cos_theta[side])
        };
        0.25 * distribution.ndf(pair.tan2_theta_h) * (v(0) * v(1))
    };
    target.pairs.iter().map(value).collect()
}
