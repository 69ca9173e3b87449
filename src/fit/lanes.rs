//! The pairs of a target side by side, as vector instructions take them, and a metric's residuals
//! there.

use std::f64::consts::PI;

use crate::fit::metric::{Metric, TOE, cube_root, toe};
use crate::fit::target::{Pair, Target};
use crate::math::least_squares::{LANES, LaneResiduals, Lanes};

/// Pairs side by side, and what a fit aims at there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairLanes {
    /// The pairs with light along either direction.
    pub sides: [SideLanes; 2],
}

/// Pairs with the light on one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SideLanes {
    /// π cosθi: the radiance of f = 1.
    pub scale: Lanes,
    /// (π cosθi)^⅓.
    pub scale_root: Lanes,
    /// The pairs' shares of the integral; 0 where there are no more pairs.
    pub weight: Lanes,
    /// g of the target's radiance, per channel.
    pub goal: [Lanes; 3],
}

/// A lobe at [`LANES`] pairs, and its derivative by the unknown that sets its width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeSamples {
    /// The lobe.
    pub value: Lanes,
    /// Its derivative.
    pub slope: Lanes,
}

impl LobeSamples {
    /// The samples of no lobe.
    pub const ZERO: Self = Self { value: [0.0; LANES], slope: [0.0; LANES] };
}

/// A value of each of at most [`LANES`] pairs; `none` where there are no more pairs.
pub fn lanes(pairs: &[Pair], value: impl Fn(&Pair) -> f64, none: f64) -> Lanes {
    std::array::from_fn(|l| pairs.get(l).map_or(none, &value))
}

impl Target {
    /// The pairs with what a fit in `metric` aims at.
    #[must_use]
    pub fn pair_lanes(&self, metric: Metric) -> Vec<PairLanes> {
        let starts = (0..self.pairs.len()).step_by(LANES);
        starts
            .map(|start| PairLanes { sides: [0, 1].map(|side| self.side(metric, start, side)) })
            .collect()
    }

    /// One side of [`LANES`] pairs from that of index `start` on.
    fn side(&self, metric: Metric, start: usize, side: usize) -> SideLanes {
        let pairs = &self.pairs[start..];
        // A lane without a pair has scale and weight 0, so that it adds a finite number times 0.
        let scale = lanes(pairs, |pair| PI * pair.cos_theta[side], 0.0);
        let goal = self.channels.each_ref().map(|channel| -> Lanes {
            std::array::from_fn(|l| {
                let exact = channel.get(start + l).copied().unwrap_or(0.0);
                metric.of_radiance(exact * scale[l]).0
            })
        });
        let weight = lanes(pairs, |pair| pair.weights[side], 0.0);
        SideLanes { scale, scale_root: scale.map(f64::cbrt), weight, goal }
    }
}

impl Metric {
    /// Adds the residuals g − goal of channel `c`, of f at the pairs of each side.
    #[inline(always)]
    pub fn add(self, terms: &mut LaneResiduals, f: &Lanes, sides: &[SideLanes], c: usize) {
        match self {
            Self::Cosine => add(terms, f, sides, c, |x| (x, 1.0)),
            Self::CubeRoot => add_lightness(terms, f, sides, c),
            Self::Log => add(terms, f, sides, c, |x| (x.ln_1p(), 1.0 / (1.0 + x))),
        }
    }
}

#[inline(always)]
fn add(
    terms: &mut LaneResiduals,
    f: &Lanes,
    sides: &[SideLanes],
    c: usize,
    of_radiance: impl Fn(f64) -> (f64, f64),
) {
    for side in sides {
        for (l, f) in f.iter().enumerate() {
            let (value, slope) = of_radiance(f * side.scale[l]);
            terms.add(l, side.weight[l], value - side.goal[c][l], slope * side.scale[l]);
        }
    }
}

/// Adds the residuals of the lightness, (f·scale)^⅓ as f^⅓·scale^⅓: one root for both sides.
#[inline(always)]
fn add_lightness(terms: &mut LaneResiduals, f: &Lanes, sides: &[SideLanes], c: usize) {
    let (mut root, mut inverse) = ([0.0; LANES], [0.0; LANES]);
    for l in 0..LANES {
        // The root is for x > 0; below the toe it is not used.
        let above = if f[l] > f64::MIN_POSITIVE { f[l] } else { f64::MIN_POSITIVE };
        root[l] = cube_root(above);
        inverse[l] = 1.0 / (3.0 * above);
    }
    for side in sides {
        for l in 0..LANES {
            // Both forms are evaluated: choosing a value vectorises, branching does not.
            let x = f[l] * side.scale[l];
            let above = root[l] * side.scale_root[l];
            let (toe, toe_slope) = toe(x);
            let (value, slope) = if x > TOE {
                // d(f·scale)^⅓/df = (f·scale)^⅓/(3f).
                (above, above * inverse[l])
            } else {
                (toe, toe_slope * side.scale[l])
            };
            terms.add(l, side.weight[l], value - side.goal[c][l], slope);
        }
    }
}
