//! The search for the pair of directions at which a table errs most.

use std::f64::consts::PI;

use crate::brdf::SgdBrdf;
use crate::lut::probe::{Probe, Viewer};
use crate::math::direction::{above_horizon, at_cot, cot_theta, from_cos_sin, tan2_theta};

/// Steps in the logarithms of cotθo and tanθh and in the azimuth, each tried in turn.
const STEPS: [f64; 9] = [0.3, 0.1, 0.04, 0.015, 0.006, 0.003, 0.001, 4e-4, 1e-4];

/// The probe with the largest error that a climb from `start` finds, and that error.
///
/// Viewer, half vector and azimuth are moved one after another by ever smaller steps, as long as
/// that raises `error` of the pair's probe.
#[must_use]
pub fn attack(brdf: &SgdBrdf, start: &Probe, error: impl Fn(&Probe) -> f64) -> (f64, Probe) {
    let Some(mut climb) = Climb::new(brdf, start, error) else { return (0.0, start.clone()) };
    for step in STEPS {
        for axis in 0..3 {
            for step in [step, -step] {
                let mut moves = [0.0; 3];
                moves[axis] = step;
                climb.try_move(moves);
            }
        }
    }
    climb.best
}

/// The probe with the largest error that so many random moves from `start` find, large and small in
/// turn and each from the best so far, and that error.
///
/// Weights that are rounded make the error jump from pair to pair, where [`attack`] gets caught. The
/// viewer moves seldom: its brightest light has to be found again.
#[must_use]
pub fn scatter(
    brdf: &SgdBrdf,
    start: &Probe,
    moves: u32,
    error: impl Fn(&Probe) -> f64,
) -> (f64, Probe) {
    const WIDEST: f64 = 0.3;
    /// The smallest reach, a share of the widest: below the width of a texel's 256th.
    const SMALLEST: f64 = 1e-6;
    const SAME_VIEWER: u32 = 12;
    /// Steps of a sequence that fills a hypercube evenly: powers of the root of x⁵ = x + 1.
    const EVEN: [f64; 4] = [
        0.856_674_883_854_502_8,
        0.733_891_856_627_126_5,
        0.628_706_721_037_805_7,
        0.538_597_256_999_498_7,
    ];
    let Some(mut climb) = Climb::new(brdf, start, error) else { return (0.0, start.clone()) };
    for k in 0..moves {
        let uniform = EVEN.map(|step| (step * f64::from(k + 1)).fract());
        let reach = WIDEST * SMALLEST.powf(uniform[3]);
        let mut moves = [0, 1, 2].map(|axis| reach * (2.0 * uniform[axis] - 1.0));
        if !k.is_multiple_of(SAME_VIEWER) {
            moves[0] = 0.0;
        }
        // Along one of the axes, or both.
        match k % 3 {
            0 => {}
            one => moves[one as usize] = 0.0,
        }
        climb.try_move(moves);
    }
    climb.best
}

/// A climb: the best probe so far, and its place.
struct Climb<'a, E> {
    brdf: &'a SgdBrdf,
    error: E,
    place: Place,
    best: (f64, Probe),
}

impl<'a, E: Fn(&Probe) -> f64> Climb<'a, E> {
    /// A climb from a probe; `None` from one below the horizon.
    fn new(brdf: &'a SgdBrdf, start: &Probe, error: E) -> Option<Self> {
        let place = Place::of(brdf, start)?;
        let best = (error(start), start.clone());
        Some(Self { brdf, error, place, best })
    }

    /// Moves along the axes if that raises the error.
    fn try_move(&mut self, moves: [f64; 3]) {
        let Some(moved) = self.place.moved(self.brdf, moves) else { return };
        let Some(probe) = moved.probe(self.brdf) else { return };
        let found = (self.error)(&probe);
        if found > self.best.0 {
            (self.best, self.place) = ((found, probe), moved);
        }
    }
}

/// A pair of directions as its viewer, its half vector and the azimuth between.
#[derive(Clone, Copy)]
struct Place {
    log_cot: f64,
    log_tan: f64,
    azimuth: f64,
    viewer: Viewer,
}

impl Place {
    fn of(brdf: &SgdBrdf, start: &Probe) -> Option<Self> {
        let [wi, wo] = start.pair;
        let h = wi + wo;
        let log_cot = bounded_ln(cot_theta(wo));
        Some(Self {
            log_cot,
            log_tan: 0.5 * bounded_ln(tan2_theta(h)),
            azimuth: h.y.atan2(h.x) - wo.y.atan2(wo.x),
            viewer: Viewer::new(brdf, at_cot(log_cot.exp()))?,
        })
    }

    fn moved(mut self, brdf: &SgdBrdf, [view, half, turn]: [f64; 3]) -> Option<Self> {
        self.log_tan += half;
        self.azimuth += PI * turn;
        if view != 0.0 {
            self.log_cot += view;
            self.viewer = Viewer::new(brdf, at_cot(self.log_cot.exp()))?;
        }
        Some(self)
    }

    fn probe(&self, brdf: &SgdBrdf) -> Option<Probe> {
        let wo = at_cot(self.log_cot.exp());
        let h = from_cos_sin(1.0, self.log_tan.exp(), self.azimuth).normalize();
        let wi = 2.0 * wo.dot(h) * h - wo;
        above_horizon(wi).then(|| self.viewer.probe(brdf, wi)).flatten()
    }
}

/// ln x of x within 1e±15.
fn bounded_ln(x: f64) -> f64 {
    x.clamp(1e-15, 1e15).ln()
}
