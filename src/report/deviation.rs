//! The distance of a reflectance from the exact one.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;

use crate::brdf::{MaskingKind, Reflectance, Sample as _, Sampler, SgdBrdf, Strategy};
use crate::material::Material;
use crate::math::direction::spherical;
use crate::preview::Film;
use crate::preview::ball::{KEY_LIGHT, under_sun};

/// An error against the exact f64 reflectance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Deviation {
    /// Largest |Δf|cosθi over the largest f·cosθi of the same wo and channel.
    pub max: f64,
    /// Root mean square of the same.
    pub rms: f64,
    /// Mean ΔE2000 on a ball under one light.
    pub delta_e_mean: f64,
    /// Largest ΔE2000 on that ball.
    pub delta_e_max: f64,
}

/// The exact values that methods are held against.
pub struct Yardstick {
    pairs: Vec<[DVec3; 2]>,
    exact: Vec<[f64; 3]>,
    /// Per pair, the largest f·cosθi of its wo.
    largest: Vec<[f64; 3]>,
    ball: Film,
}

/// Viewers from normal to nearly grazing, evenly in θo.
const VIEWERS: usize = 24;
/// Lights per viewer, drawn where the surface reflects.
const LIGHTS: usize = 192;
/// Pixels across the ball.
const BALL: usize = 96;

impl Yardstick {
    /// The exact values of a material.
    #[must_use]
    pub fn new(material: &Material) -> Self {
        let sgd = SgdBrdf::new(material, MaskingKind::Exact);
        let surface = Sampler::new(material, MaskingKind::Fitted, Strategy::Ggx);
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let (mut pairs, mut exact, mut largest) = (Vec::new(), Vec::new(), Vec::new());
        for viewer in 0..VIEWERS {
            let theta = FRAC_PI_2 * (viewer as f64 + 0.5) / VIEWERS as f64;
            let wo = spherical(theta, 0.0);
            // The mirror direction is there whatever the draws are.
            let drawn = (0..LIGHTS).filter_map(|_| surface.sample(wo, rng.random()));
            let lights: Vec<DVec3> =
                drawn.chain([spherical(theta, PI)]).filter(|wi| wi.z > 0.0).collect();
            let values: Vec<[f64; 3]> = lights.iter().map(|wi| sgd.eval(*wi, wo)).collect();
            let most = lights.iter().zip(&values).fold([0.0_f64; 3], |most, (wi, f)| {
                std::array::from_fn(|c| most[c].max(f[c].abs() * wi.z))
            });
            largest.extend(std::iter::repeat_n(most, lights.len()));
            pairs.extend(lights.into_iter().map(|wi| [wi, wo]));
            exact.extend(values);
        }
        Self { pairs, exact, largest, ball: under_sun(&sgd, KEY_LIGHT, BALL) }
    }

    /// The distance of `reflectance` from the exact one.
    #[must_use]
    pub fn measure(&self, reflectance: &dyn Reflectance) -> Deviation {
        let mut f = vec![[0.0; 3]; self.pairs.len()];
        reflectance.eval_all(&self.pairs, &mut f);
        let (mut max, mut squares) = (0.0_f64, 0.0);
        for (i, [wi, _]) in self.pairs.iter().enumerate() {
            for (c, f) in f[i].iter().enumerate() {
                let error =
                    // Without the floor a channel that reflects nothing would give 0/0.
                    (f - self.exact[i][c]).abs() * wi.z / self.largest[i][c].max(f64::MIN_POSITIVE);
                // NaN counts as the largest error.
                if error.total_cmp(&max).is_gt() {
                    max = error;
                }
                squares += error * error;
            }
        }
        let ball = under_sun(reflectance, KEY_LIGHT, BALL).delta_e(&self.ball);
        Deviation {
            max,
            rms: (squares / (3 * self.pairs.len()) as f64).sqrt(),
            delta_e_mean: ball.mean,
            delta_e_max: ball.max,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::find;

    /// The exact reflectance, a share too bright.
    struct Brighter(SgdBrdf, f64);

    impl Reflectance for Brighter {
        fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
            self.0.eval(wi, wo).map(|f| f * (1.0 + self.1))
        }
    }

    #[test]
    fn a_percent_is_a_percent() {
        let material = &find("gold-paint").expect("in the catalogue").material;
        let yardstick = Yardstick::new(material);
        let sgd = SgdBrdf::new(material, MaskingKind::Exact);
        let same = yardstick.measure(&sgd);
        assert_eq!((same.max, same.rms, same.delta_e_max), (0.0, 0.0, 0.0));
        let brighter = yardstick.measure(&Brighter(sgd, 0.01));
        assert!((brighter.max - 0.01).abs() < 1e-12, "{brighter:?}");
        assert!(brighter.rms < 0.01 && brighter.delta_e_mean > 0.0);
    }
}
