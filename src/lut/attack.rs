//! The search for the pair of directions at which a table errs most.

use std::f64::consts::PI;

use glam::DVec3;

use crate::brdf::SgdBrdf;
use crate::lut::probe::{Probe, probes_of_pair};
use crate::math::direction::{at_cot, cot_theta, from_cos_sin, tan2_theta};

/// Steps in the logarithms of cotθo and tanθh and in the azimuth, each tried in turn.
const STEPS: [f64; 9] = [0.3, 0.1, 0.04, 0.015, 0.006, 0.003, 0.001, 4e-4, 1e-4];

/// The probe with the largest error that a climb from `start` finds, and that error.
///
/// Viewer, half vector and azimuth are moved one after another by ever smaller steps, as long as
/// that raises `error` of the pair's probe.
#[must_use]
pub fn attack(brdf: &SgdBrdf, start: &Probe, error: impl Fn(&Probe) -> f64) -> (f64, Probe) {
    let mut place = Place::of(start);
    let mut best = (error(start), start.clone());
    for step in STEPS {
        for axis in 0..3 {
            for step in [step, -step] {
                let moved = place.moved(axis, step);
                let Some(probe) = probes_of_pair(brdf, moved.pair()).into_iter().next() else {
                    continue;
                };
                let found = error(&probe);
                if found > best.0 {
                    (best, place) = ((found, probe), moved);
                }
            }
        }
    }
    best
}

/// The probe with the largest error that random moves from `start` find, ever smaller and each from
/// the best so far, and that error.
///
/// Weights that are rounded make the error jump from pair to pair, where [`attack`] gets caught.
#[must_use]
pub fn scatter(brdf: &SgdBrdf, start: &Probe, error: impl Fn(&Probe) -> f64) -> (f64, Probe) {
    const MOVES: i32 = 160;
    const WIDEST: f64 = 0.3;
    const SHRINK: f64 = 0.965;
    /// Steps of a sequence that fills the cube evenly: powers of the root of x⁴ = x + 1.
    const EVEN: [f64; 3] =
        [0.819_172_513_396_164_5, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];
    let mut place = Place::of(start);
    let mut best = (error(start), start.clone());
    for k in 0..MOVES {
        let reach = WIDEST * SHRINK.powi(k);
        let moved = (0..3).fold(place, |place, axis| {
            let uniform = (EVEN[axis] * f64::from(k + 1)).fract();
            place.moved(axis, reach * (2.0 * uniform - 1.0))
        });
        let Some(probe) = probes_of_pair(brdf, moved.pair()).into_iter().next() else { continue };
        let found = error(&probe);
        if found > best.0 {
            (best, place) = ((found, probe), moved);
        }
    }
    best
}

/// A pair of directions as its viewer, its half vector and the azimuth between.
#[derive(Clone, Copy)]
struct Place([f64; 3]);

impl Place {
    fn of(probe: &Probe) -> Self {
        let [wi, wo] = probe.pair;
        let h = wi + wo;
        let azimuth = h.y.atan2(h.x) - wo.y.atan2(wo.x);
        Self([bounded_ln(cot_theta(wo)), 0.5 * bounded_ln(tan2_theta(h)), azimuth])
    }

    fn moved(mut self, axis: usize, step: f64) -> Self {
        self.0[axis] += if axis == 2 { PI * step } else { step };
        self
    }

    fn pair(self) -> [DVec3; 2] {
        let [log_cot, log_tan, azimuth] = self.0;
        let wo = at_cot(log_cot.exp());
        let h = from_cos_sin(1.0, log_tan.exp(), azimuth).normalize();
        [2.0 * wo.dot(h) * h - wo, wo]
    }
}

/// ln x of x within 1e±15.
fn bounded_ln(x: f64) -> f64 {
    x.clamp(1e-15, 1e15).ln()
}
