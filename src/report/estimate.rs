//! The directional albedo ∫ f cosθi dωi by sampling, next to its value by quadrature.

use glam::DVec3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use serde::Serialize;

use crate::brdf::sampler::{Sampler, Strategy, published_sample};
use crate::brdf::{MaskingKind, SgdBrdf, directional_albedo};
use crate::material::Material;

/// An estimator of the directional albedo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimator {
    /// Directions drawn as a renderer draws them, weighted by f cosθi/pdf.
    Sampled(Strategy),
    /// The estimator that the paper's supplement prints, biased away from normal incidence. It knows
    /// one lobe a channel: of a material with more, each colour's first.
    Published,
}

/// A channel's estimate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Mean of the draws.
    pub mean: f64,
    /// Standard error of the mean.
    pub standard_error: f64,
    /// The albedo by deterministic quadrature.
    pub quadrature: f64,
}

/// Estimates the directional albedo towards `wo` from `n` ≥ 2 draws, per channel. Equal seeds give
/// equal results on any number of threads.
#[must_use]
pub fn estimate(
    material: &Material,
    masking: MaskingKind,
    estimator: Estimator,
    wo: DVec3,
    n: u64,
    seed: u64,
) -> [Estimate; 3] {
    let brdf = SgdBrdf::new(material, masking);
    let quadrature = directional_albedo(&brdf, wo.z);
    let moments = match estimator {
        Estimator::Published => {
            let lobes = [0, 1, 2].map(|c| first_of_colour(material, c));
            moments(&|u| published_weight(&brdf, lobes, wo, u), n, seed)
        }
        Estimator::Sampled(strategy) => {
            let sampler = Sampler::new(material, masking, strategy);
            moments(&|u| sampler.sample_with_weight(wo, u).map_or([0.0; 3], |s| s.weight), n, seed)
        }
    };
    std::array::from_fn(|c| moments[c].estimate(quadrature[c]))
}

/// The weight of a draw of the published estimator, by each colour's lobe; ρd where it has none.
fn published_weight(brdf: &SgdBrdf, lobes: [usize; 3], wo: DVec3, u: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| match brdf.lobes.get(lobes[c]) {
        Some(_) => published_sample(brdf, c, lobes[c], wo, u).printed,
        None => brdf.rho_d[c],
    })
}

/// The first lobe that reflects a colour; 0 where none does.
fn first_of_colour(material: &Material, c: usize) -> usize {
    material.lobes().iter().position(|lobe| lobe.rho_s()[c] > 0.0).unwrap_or(0)
}

/// Running mean and sum of squared deviations of one channel's draws.
#[derive(Clone, Copy, Default)]
struct Moments {
    count: f64,
    mean: f64,
    squares: f64,
}

impl Moments {
    /// The moments of two sets of draws together (Chan, Golub and LeVeque 1983).
    fn with(self, other: Self) -> Self {
        let count = self.count + other.count;
        // Sums of squares would cancel where the mean is large against the spread.
        let difference = other.mean - self.mean;
        Self {
            count,
            mean: self.mean + difference * other.count / count,
            squares: self.squares
                + other.squares
                + difference * difference * self.count * other.count / count,
        }
    }

    fn estimate(self, quadrature: f64) -> Estimate {
        let standard_error = (self.squares / (self.count - 1.0) / self.count).sqrt();
        Estimate { mean: self.mean, standard_error, quadrature }
    }
}

/// Draws that one task takes from the stream of random numbers.
const CHUNK: u64 = 1 << 14;
/// Chunks in flight at once, so that memory does not grow with the number of draws.
const ROUND: u64 = 256;

/// Three uniform numbers in [0, 1) to a value per channel.
type Draw<'a> = &'a (dyn Fn([f64; 3]) -> [f64; 3] + Sync);

/// The moments of `n` draws. One stream of random numbers is cut at fixed places and summed in
/// order, so the result does not depend on the number of threads.
fn moments(draw: Draw<'_>, n: u64, seed: u64) -> [Moments; 3] {
    let chunks = n.div_ceil(CHUNK);
    let mut total = [Moments::default(); 3];
    for start in (0..chunks).step_by(ROUND as usize) {
        let round: Vec<[Moments; 3]> = (start..chunks.min(start + ROUND))
            .into_par_iter()
            .map(|chunk| chunk_moments(draw, chunk * CHUNK..n.min((chunk + 1) * CHUNK), seed))
            .collect();
        for chunk in round {
            total = std::array::from_fn(|c| total[c].with(chunk[c]));
        }
    }
    total
}

/// The moments of the draws in a range of the stream.
fn chunk_moments(draw: Draw<'_>, range: std::ops::Range<u64>, seed: u64) -> [Moments; 3] {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    // Each draw takes three numbers of the stream.
    rng.advance(3 * u128::from(range.start));
    range.fold([Moments::default(); 3], |moments, _| {
        let values = draw(rng.random());
        std::array::from_fn(|c| {
            moments[c].with(Moments { count: 1.0, mean: values[c], squares: 0.0 })
        })
    })
}
