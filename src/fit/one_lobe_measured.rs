//! The best single Beckmann or GGX lobe for a measurement.

use std::f64::consts::FRAC_1_PI;
use std::rc::Rc;

use nalgebra::DVector;

use crate::brdf::gltf::schlick_weight;
use crate::brdf::{OneLobe, OneLobeChannel};
use crate::fit::descent::{by_steps, lowest};
use crate::fit::measured_target::{MeasuredPair, MeasuredTarget};
use crate::math::least_squares::{Bounds, NormalEquations};
use crate::microfacet::{Distribution as _, Family, Fresnel, OneWidth};

/// The range of ln α that is searched: α from 1e-3 to 2.
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
    // f outside the highlight is about ρd/π. The bounds keep a start from black and from white.
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
    let found = lowest(
        |x| equations(&thin, family, x, &bounds),
        |x| equations(target, family, x, &bounds),
        starts,
        &bounds,
    );
    lobe_of(family, &found.x)
}

/// The widths, one or one for each channel, then the colours.
fn unknowns(log_alpha: &[f64], colours: &[[f64; 3]; 3]) -> DVector<f64> {
    DVector::from_vec([log_alpha, colours.as_flattened()].concat())
}

/// The place of a channel's width among `widths`.
fn width_of(channel: usize, widths: usize) -> usize {
    // With one width it is the first for every channel, with three each its own.
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
        // Most steps of the derivatives move a colour, and no width.
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

/// The equations of a lobe's unknowns.
fn equations(
    target: &MeasuredTarget,
    family: Family,
    x: &DVector<f64>,
    bounds: &Bounds,
) -> NormalEquations {
    let here = Model::new(target, family, x, None);
    by_steps(
        target,
        x,
        bounds,
        |moved| Model::new(target, family, moved, Some(&here)),
        |model, i| model.eval(target, i),
    )
}

/// The lobe of a solution.
fn lobe_of(family: Family, x: &DVector<f64>) -> OneLobe {
    let widths = x.len() - COLOURS;
    let channels = [0, 1, 2].map(|c| {
        let [rho_d, f0, f90] = [0, 1, 2].map(|k| x[widths + 3 * c + k]);
        let alpha = x[width_of(c, widths)].exp();
        OneLobeChannel { rho_d, alpha, fresnel: Fresnel { f0, f90, f1: 0.0 } }
    });
    OneLobe { family, channels }
}

fn bounds(widths: usize) -> Bounds {
    let mut bounds = Bounds::non_negative(widths + COLOURS);
    for w in 0..widths {
        [bounds.lower[w], bounds.upper[w]] = LOG_ALPHA;
    }
    for c in 0..3 {
        // ρd; the Fresnel terms hold the lobe's scale and have no upper bound.
        bounds.upper[widths + 3 * c] = 1.0;
    }
    bounds
}

/// D G1 G1/(4 cosθi cosθo) at every pair.
fn lobe(target: &MeasuredTarget, family: Family, log_alpha: f64) -> Rc<[f64]> {
    let distribution = family.of_width(log_alpha.exp());
    target.pairs.iter().map(|pair| lobe_at(distribution, pair)).collect()
}

/// D G1 G1/(4 cosθi cosθo) = ¼ D (1/((1 + Λi) cosθi)) (1/((1 + Λo) cosθo)).
fn lobe_at(distribution: OneWidth, pair: &MeasuredPair) -> f64 {
    let [v_i, v_o] = [0, 1].map(|side| {
        1.0 / ((1.0 + distribution.lambda(pair.cot_theta[side])) * pair.cos_theta[side])
    });
    0.25 * distribution.ndf(pair.tan2_theta_h) * (v_i * v_o)
}
