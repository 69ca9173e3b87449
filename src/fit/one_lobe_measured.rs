//! The best single Beckmann or GGX lobe for a measurement.

use std::f64::consts::FRAC_1_PI;
use std::rc::Rc;

use nalgebra::DVector;

use crate::brdf::gltf::schlick_weight;
use crate::brdf::{OneLobe, OneLobeChannel};
use crate::fit::descent::{by_steps, lowest};
use crate::fit::measured_target::{MeasuredPair, MeasuredTarget};
use crate::math::least_squares::{Bounds, NormalEquations};
use crate::microfacet::{Distribution as _, Family, Fresnel};

/// ln α that is searched.
const LOG_ALPHA: [f64; 2] = [-6.9, 0.69];
/// Widths that a descent starts from.
const WIDTHS: [f64; 5] = [-4.6, -3.2, -2.2, -1.3, -0.5];
/// Share of the pairs that starts are compared on.
const THINNING: usize = 4;
/// ρd, F(0°) and F(90°) of each channel.
const COLOURS: usize = 9;

/// The best lobe with one width for all channels: ρd, F(0°) and F(90°) of each channel.
#[must_use]
pub fn fit(target: &MeasuredTarget, family: Family) -> OneLobe {
    let typical = target.typical().map(|f| (std::f64::consts::PI * f).clamp(1e-3, 0.9));
    let colours = typical.map(|rho_d| [rho_d, 0.05, 0.3]);
    best(target, family, WIDTHS.map(|log_alpha| unknowns(&[log_alpha], &colours)).to_vec())
}

/// The best lobe with a width for each channel, found from the one of `joint`.
#[must_use]
pub fn fit_per_channel(target: &MeasuredTarget, joint: &OneLobe) -> OneLobe {
    let log_alpha = joint.channels.map(|channel| channel.alpha.ln());
    let colours = joint.channels.map(|c| [c.rho_d, c.fresnel.f0, c.fresnel.f90]);
    best(target, joint.family, vec![unknowns(&log_alpha, &colours)])
}

/// The lobe that descents from `starts` lead to.
fn best(target: &MeasuredTarget, family: Family, starts: Vec<DVector<f64>>) -> OneLobe {
    let thin = target.thinned(THINNING);
    let bounds = bounds(starts[0].len() - COLOURS);
    let rough = |x: &DVector<f64>| equations(&thin, family, x, &bounds);
    let fine = |x: &DVector<f64>| equations(target, family, x, &bounds);
    lobe_of(family, &lowest(rough, fine, starts, &bounds).x)
}

/// The widths, one or one for each channel, then the colours.
fn unknowns(log_alpha: &[f64], colours: &[[f64; 3]; 3]) -> DVector<f64> {
    DVector::from_vec([log_alpha, colours.as_flattened()].concat())
}

/// The place of a channel's width among `widths`.
fn width_of(channel: usize, widths: usize) -> usize {
    channel.min(widths - 1)
}

/// Unknowns, and the lobe of each of their widths at every pair.
struct Model {
    x: DVector<f64>,
    lobes: Vec<Rc<[f64]>>,
}

impl Model {
    /// The model of the unknowns; a lobe is evaluated where its width is not that of `known`.
    fn new(
        target: &MeasuredTarget,
        family: Family,
        x: &DVector<f64>,
        known: Option<&Self>,
    ) -> Self {
        let lobes = (0..x.len() - COLOURS).map(|w| match known {
            Some(known) if known.x[w] == x[w] => known.lobes[w].clone(),
            _ => lobe(target, family, x[w]),
        });
        Self { x: x.clone(), lobes: lobes.collect() }
    }

    /// f = ρd/π + F D G1 G1/(4 cosθi cosθo) at the pair of an index.
    fn eval(&self, target: &MeasuredTarget, i: usize) -> [f64; 3] {
        let u = schlick_weight(target.pairs[i].cos_theta_d);
        let widths = self.lobes.len();
        std::array::from_fn(|c| {
            let [rho_d, f0, f90] = [0, 1, 2].map(|k| self.x[widths + 3 * c + k]);
            rho_d * FRAC_1_PI + (f0 + (f90 - f0) * u) * self.lobes[width_of(c, widths)][i]
        })
    }
}

fn equations(
    target: &MeasuredTarget,
    family: Family,
    x: &DVector<f64>,
    bounds: &Bounds,
) -> NormalEquations {
    let here = Model::new(target, family, x, None);
    let model = |moved: &DVector<f64>| Model::new(target, family, moved, Some(&here));
    by_steps(target, x, bounds, model, |model: &Model, i| model.eval(target, i))
}

fn lobe_of(family: Family, x: &DVector<f64>) -> OneLobe {
    let widths = x.len() - COLOURS;
    let channel = |c: usize| {
        let [rho_d, f0, f90] = [0, 1, 2].map(|k| x[widths + 3 * c + k]);
        let alpha = x[width_of(c, widths)].exp();
        OneLobeChannel { rho_d, alpha, fresnel: Fresnel { f0, f90, f1: 0.0 } }
    };
    OneLobe { family, channels: [0, 1, 2].map(channel) }
}

fn bounds(widths: usize) -> Bounds {
    let mut bounds = Bounds::non_negative(widths + COLOURS);
    for w in 0..widths {
        [bounds.lower[w], bounds.upper[w]] = LOG_ALPHA;
    }
    for c in 0..3 {
        bounds.upper[widths + 3 * c] = 1.0;
    }
    bounds
}

/// D G1 G1/(4 cosθi cosθo) at every pair.
fn lobe(target: &MeasuredTarget, family: Family, log_alpha: f64) -> Rc<[f64]> {
    let distribution = family.of_width(log_alpha.exp());
    let v = |pair: &MeasuredPair, side: usize| {
        1.0 / ((1.0 + distribution.lambda(pair.cot_theta[side])) * pair.cos_theta[side])
    };
    let value = |pair: &MeasuredPair| {
        0.25 * distribution.ndf(pair.tan2_theta_h) * (v(pair, 0) * v(pair, 1))
    };
    target.pairs.iter().map(value).collect()
}
