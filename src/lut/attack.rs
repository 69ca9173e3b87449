//! The search for the pair of directions at which a table errs most.

use std::f64::consts::PI;

use glam::DVec3;

use crate::brdf::SgdBrdf;
use crate::lut::probe::{Probe, Viewer, Viewers};
use crate::math::direction::{above_horizon, at_cot, cot_theta, from_cos_sin, tan2_theta};

/// Steps in the logarithms of cotθo and tanθh and in the azimuth, each tried in turn.
const STEPS: [f64; 9] = [0.3, 0.1, 0.04, 0.015, 0.006, 0.003, 0.001, 4e-4, 1e-4];

/// The probe with the largest error that a climb from `start` finds, and that error.
///
/// Viewer, half vector and azimuth are moved one after another by ever smaller steps, each tried
/// once in both senses and kept where it raises `error` of the pair's probe.
#[must_use]
pub fn attack(brdf: &SgdBrdf, start: &Probe, error: impl Fn(&Probe) -> f64) -> (f64, Probe) {
    let Some(mut climb) = Climb::new(brdf, None, start, error) else { return (0.0, start.clone()) };
    for step in STEPS {
        for axis in 0..3 {
            for step in [step, -step] {
                let mut moves = [0.0; 3];
                moves[axis] = step;
                climb.try_place(climb.place.moved(moves));
            }
        }
    }
    climb.best
}

/// The probe with the largest error that so many random moves from `start` find, large and small in
/// turn and each from the best so far, and that error.
///
/// Each cell between texels has its own maximum, and weights that are rounded make the error jump
/// from pair to pair: [`attack`] gets caught there. Without the `viewers` met before, the viewer moves
/// seldom, as its brightest light has to be found again.
#[must_use]
pub fn scatter(
    brdf: &SgdBrdf,
    viewers: Option<&Viewers>,
    start: &Probe,
    moves: u32,
    error: impl Fn(&Probe) -> f64,
) -> (f64, Probe) {
    const WIDEST: f64 = 0.5;
    /// The smallest reach, a share of the widest: below the width of a texel's 256th.
    const SMALLEST: f64 = 1e-6;
    /// Steps of a sequence that fills a hypercube evenly (Roberts 2018): powers of the inverse of the
    /// root of x⁵ = x + 1.
    const EVEN: [f64; 4] = [
        0.856_674_883_854_502_8,
        0.733_891_856_627_126_5,
        0.628_706_721_037_805_7,
        0.538_597_256_999_498_7,
    ];
    let same_viewer = if viewers.is_some() { 2 } else { 12 };
    let Some(mut climb) = Climb::new(brdf, viewers, start, error) else {
        return (0.0, start.clone());
    };
    for k in 0..moves {
        let uniform = EVEN.map(|step| (step * f64::from(k + 1)).fract());
        let reach = WIDEST * SMALLEST.powf(uniform[3]);
        let [view, half, turn] = [0, 1, 2].map(|axis| reach * (2.0 * uniform[axis] - 1.0));
        let moved = match (k % same_viewer, k / same_viewer % 3) {
            // The viewer alone, with its half vector or with its light, or all at once.
            (0, 0) => climb.place.moved([view, 0.0, 0.0]),
            (0, 1) => climb.place.seen_from(view),
            (0, _) => climb.place.moved([view, half, turn]),
            (_, 0) => climb.place.moved([0.0, half, 0.0]),
            (_, 1) => climb.place.moved([0.0, 0.0, turn]),
            _ => climb.place.moved([0.0, half, turn]),
        };
        climb.try_place(moved);
    }
    climb.best
}

/// A climb: the best probe so far, and its place.
struct Climb<'a, E> {
    brdf: &'a SgdBrdf,
    viewers: Option<&'a Viewers>,
    error: E,
    place: Place,
    viewer: Viewer,
    best: (f64, Probe),
}

impl<'a, E: Fn(&Probe) -> f64> Climb<'a, E> {
    /// A climb from a probe; `None` from one below the horizon.
    fn new(
        brdf: &'a SgdBrdf,
        viewers: Option<&'a Viewers>,
        start: &Probe,
        error: E,
    ) -> Option<Self> {
        let place = Place::of(start.pair);
        let viewer = viewer(brdf, viewers, place.wo())?;
        let best = (error(start), start.clone());
        Some(Self { brdf, viewers, error, place, viewer, best })
    }

    /// Moves to a place if that raises the error.
    fn try_place(&mut self, place: Place) {
        let viewer = if place.log_cot == self.place.log_cot {
            Some(self.viewer)
        } else {
            viewer(self.brdf, self.viewers, place.wo())
        };
        let wi = place.wi();
        let Some(viewer) = viewer.filter(|_| above_horizon(wi)) else { return };
        let Some(probe) = viewer.probe(self.brdf, wi) else { return };
        let found = (self.error)(&probe);
        if found > self.best.0 {
            (self.best, self.place, self.viewer) = ((found, probe), place, viewer);
        }
    }
}

/// A viewer: as those met before tell, or with its brightest light searched.
fn viewer(brdf: &SgdBrdf, viewers: Option<&Viewers>, wo: DVec3) -> Option<Viewer> {
    viewers.map_or_else(|| Viewer::new(brdf, wo), |viewers| viewers.at(wo))
}

/// A pair of directions as its viewer, its half vector and the azimuth between.
#[derive(Clone, Copy)]
struct Place {
    log_cot: f64,
    log_tan: f64,
    azimuth: f64,
}

impl Place {
    fn of([wi, wo]: [DVec3; 2]) -> Self {
        // Not normalised: both ratios below are free of its length.
        let h = wi + wo;
        // Logarithms, so that one step suits lobes of every width.
        Self {
            log_cot: bounded_ln(cot_theta(wo)),
            log_tan: 0.5 * bounded_ln(tan2_theta(h)),
            azimuth: h.y.atan2(h.x) - wo.y.atan2(wo.x),
        }
    }

    fn moved(mut self, [view, half, turn]: [f64; 3]) -> Self {
        self.log_cot += view;
        self.log_tan += half;
        // An angle: the widest step turns it by 90°.
        self.azimuth += PI * turn;
        self
    }

    /// The light as another viewer sees it.
    fn seen_from(self, view: f64) -> Self {
        Self::of([self.wi(), at_cot((self.log_cot + view).exp())])
    }

    fn wo(&self) -> DVec3 {
        // An isotropic f depends on the azimuths' difference alone, so wo stays at azimuth 0.
        at_cot(self.log_cot.exp())
    }

    fn wi(&self) -> DVec3 {
        let wo = self.wo();
        let h = from_cos_sin(1.0, self.log_tan.exp(), self.azimuth).normalize();
        2.0 * wo.dot(h) * h - wo
    }
}

/// ln x of x within 1e±15.
fn bounded_ln(x: f64) -> f64 {
    // cotθ is infinite and tanθh is 0 where a climb may well start: no step leads away from ±∞.
    x.clamp(1e-15, 1e15).ln()
}
