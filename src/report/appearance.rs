//! A fit as a picture and as a computation: the colour difference of a ball under one light, and
//! the time of an evaluation.

use std::hint::black_box;
use std::time::Instant;

use glam::DVec3;
use serde::Serialize;

use crate::brdf::{MaskingKind, Reflectance, SgdBrdf};
use crate::material::Material;
use crate::microfacet::Accuracy;
use crate::preview::Film;
use crate::preview::ball::{KEY_LIGHT, under_sun};

/// The comparison of a reflectance with a material.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Appearance {
    /// The reflectance of the fit.
    pub of: &'static str,
    /// Mean ΔE2000 of a ball under one light.
    pub delta_e_mean: f64,
    /// Largest ΔE2000 of a pixel.
    pub delta_e_max: f64,
    /// Measured time of one RGB evaluation \[ns\].
    pub evaluation_ns: f64,
}

/// Width and height of the ball in pixels.
const BALL: usize = 32;

/// A material's ball under one light, to compare others with.
#[derive(Clone, Debug)]
pub struct ReferenceBall(Film);

impl ReferenceBall {
    /// The ball of a material with its exact masking.
    #[must_use]
    pub fn new(material: &Material) -> Self {
        let exact = SgdBrdf::with_accuracy(material, MaskingKind::Exact, Accuracy::Picture);
        Self::of(&exact)
    }

    /// The ball of a reflectance without gaps.
    #[must_use]
    pub fn of(reflectance: &dyn Reflectance) -> Self {
        Self(under_sun(reflectance, KEY_LIGHT, BALL))
    }

    /// Mean and largest ΔE2000 of the ball of `reflectance`.
    #[must_use]
    pub fn delta_e(&self, reflectance: &dyn Reflectance) -> [f64; 2] {
        let difference = under_sun(reflectance, KEY_LIGHT, BALL).delta_e(&self.0);
        [difference.mean, difference.max]
    }
}

/// Times that the pairs are evaluated; the median counts.
const REPEATS: usize = 5;

/// The median time of one evaluation over the pairs \[ns\].
#[must_use]
pub fn evaluation_ns(reflectance: &dyn Reflectance, pairs: &[[DVec3; 2]]) -> f64 {
    let mut times: [f64; REPEATS] = std::array::from_fn(|_| {
        let start = Instant::now();
        for [wi, wo] in pairs {
            // Or the compiler drops an evaluation whose result nobody reads.
            black_box(reflectance.eval(*wi, *wo));
        }
        start.elapsed().as_secs_f64() * 1e9 / pairs.len().max(1) as f64
    });
    times.sort_by(f64::total_cmp);
    times[REPEATS / 2]
}
