//! The pairs of a target side by side, as vector instructions take them.

use std::f64::consts::PI;

use crate::fit::metric::Metric;
use crate::fit::target::{Pair, Target};
use crate::math::least_squares::{LANES, Lanes};

/// Pairs side by side, and what a fit aims at there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// For light along either direction of each pair.
    pub sides: [Side; 2],
}

/// Pairs with the light on one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// π cosθi: the radiance of f = 1.
    pub scale: Lanes,
    /// (π cosθi)^⅓.
    pub scale_root: Lanes,
    /// The pairs' shares of the integral; 0 where the last block has no more pairs.
    pub weight: Lanes,
    /// g of the target's radiance, per channel.
    pub goal: [Lanes; 3],
}

/// A lobe at the pairs of a block, and its derivative by the unknown that sets its width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeSamples {
    /// The lobe.
    pub value: Lanes,
    /// Its derivative.
    pub slope: Lanes,
}

impl LobeSamples {
    /// No lobe.
    pub const ZERO: Self = Self { value: [0.0; LANES], slope: [0.0; LANES] };
}

impl Target {
    /// The pairs with what a fit in `metric` aims at.
    #[must_use]
    pub fn blocks(&self, metric: Metric) -> Vec<Block> {
        let block =
            |start: usize| Block { sides: [0, 1].map(|side| self.side(metric, start, side)) };
        (0..self.pairs.len()).step_by(LANES).map(block).collect()
    }

    fn side(&self, metric: Metric, start: usize, side: usize) -> Side {
        let of_pair = |of: &dyn Fn(&Pair) -> f64| -> Lanes {
            std::array::from_fn(|l| self.pairs.get(start + l).map_or(0.0, of))
        };
        let scale = of_pair(&|pair| PI * pair.cos_theta[side]);
        let goal = |c: usize| -> Lanes {
            let exact = |l: usize| self.channels[c].get(start + l).copied().unwrap_or(0.0);
            std::array::from_fn(|l| metric.of_radiance(exact(l) * scale[l]).0)
        };
        let weight = of_pair(&|pair| pair.weights[side]);
        Side { scale, scale_root: scale.map(f64::cbrt), weight, goal: [0, 1, 2].map(goal) }
    }

    /// A value of each pair, side by side; `none` where the last block has no more pairs.
    pub fn lanes(&self, of: impl Fn(&Pair) -> f64, none: f64) -> Vec<Lanes> {
        let block =
            |pairs: &[Pair]| -> Lanes { std::array::from_fn(|l| pairs.get(l).map_or(none, &of)) };
        self.pairs.chunks(LANES).map(block).collect()
    }
}
