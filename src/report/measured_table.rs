//! A measurement as a table small enough for a page, over half and difference angles.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;
use half::f16;
use rayon::prelude::*;

use crate::brdf::Reflectance;
use crate::math::direction::above_horizon;
use crate::measurement::half_difference::HalfDifference;

/// Nodes along θh, θd and φd.
pub const SIZE: [usize; 3] = [90, 37, 13];

/// Values of an isotropic reciprocal reflectance, which φd in [0, π/2] determines.
///
/// Nodes lie at θh = (π/2) u², as those of a MERL file, and evenly along θd and φd; in between,
/// values are linear in u, θd and φd. θh varies fastest.
pub struct MeasuredTable {
    /// f at the nodes \[1/sr\] per colour.
    values: Vec<[f16; 3]>,
}

impl MeasuredTable {
    /// The table of a reflectance that has a value at every pair.
    #[must_use]
    pub fn of(reflectance: &dyn Reflectance) -> Self {
        let [halves, differences, azimuths] = SIZE;
        let values = (0..halves * differences * azimuths).into_par_iter().map(|index| {
            let node = [index % halves, index / halves % differences, index / halves / differences];
            let [wi, wo] = within(angles_at(node)).directions();
            // A sharp highlight may exceed the largest half, and would be stored as infinite.
            reflectance.eval(wi, wo).map(|f| f16::from_f64(f.min(f16::MAX.to_f64())))
        });
        Self { values: values.collect() }
    }

    /// The halves, little-endian, colours next to each other.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8> {
        self.values.as_flattened().iter().flat_map(|half| half.to_le_bytes()).collect()
    }

    fn at(&self, [half, difference, azimuth]: [usize; 3]) -> [f64; 3] {
        let index = half + SIZE[0] * (difference + SIZE[1] * azimuth);
        self.values[index].map(f16::to_f64)
    }
}

impl Reflectance for MeasuredTable {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !(above_horizon(wi) && above_horizon(wo)) {
            return [0.0; 3];
        }
        let places = places(HalfDifference::of(wi, wo));
        (0..8).fold([0.0; 3], |sum, corner: usize| {
            // Bit `axis` of the corner steps along that axis.
            let sides: [usize; 3] = std::array::from_fn(|axis| corner >> axis & 1);
            let shares = places.iter().zip(sides);
            let weight: f64 =
                shares.map(|((_, share), side)| [1.0 - share, *share][side]).product();
            let f = self.at(std::array::from_fn(|axis| places[axis].0 + sides[axis]));
            std::array::from_fn(|c| sum[c] + weight * f[c])
        })
    }
}

/// The angles of a node.
fn angles_at(node: [usize; 3]) -> HalfDifference {
    let [u, v, w] = std::array::from_fn(|axis| node[axis] as f64 / (SIZE[axis] - 1) as f64);
    HalfDifference { theta_h: FRAC_PI_2 * u * u, theta_d: FRAC_PI_2 * v, phi_d: FRAC_PI_2 * w }
}

/// The node before a pair along each axis, and its share of the way to the next.
fn places(angles: HalfDifference) -> [(usize, f64); 3] {
    let phi_d = angles.phi_d % PI;
    // Reciprocity gives φd the period π, isotropy with a mirror plane folds it at π/2.
    let folded = phi_d.min(PI - phi_d);
    let shares =
        [(angles.theta_h / FRAC_PI_2).sqrt(), angles.theta_d / FRAC_PI_2, folded / FRAC_PI_2];
    std::array::from_fn(|axis| {
        let place = shares[axis].clamp(0.0, 1.0) * (SIZE[axis] - 1) as f64;
        let before = (place as usize).min(SIZE[axis] - 2);
        (before, place - before as f64)
    })
}

/// How far within the horizon the angles of a node stay, as a share.
const WITHIN: f64 = 0.999;

/// The angles, θd cut so that both directions stay above the horizon: cosθd cosθh >
/// sinθd |cosφd| sinθh. So values next to the horizon are not interpolated with zeros beyond it.
fn within(angles: HalfDifference) -> HalfDifference {
    let theta_h = angles.theta_h.min(WITHIN * FRAC_PI_2);
    let largest = theta_h.cos().atan2(angles.phi_d.cos().abs() * theta_h.sin());
    HalfDifference { theta_h, theta_d: angles.theta_d.min(WITHIN * largest), ..angles }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{MaskingKind, SgdBrdf};
    use crate::material::named;
    use crate::report::distance::Reference;

    #[test]
    fn a_ball_through_the_table_looks_the_same() {
        for name in ["chrome@refit", "gold-paint@refit", "pink-fabric", "white-paint"] {
            let brdf = SgdBrdf::new(named(name).expect("in the catalogue"), MaskingKind::Fitted);
            let distance = Reference::new(&brdf).distance(&MeasuredTable::of(&brdf));
            assert!(distance.suns < 0.05, "{name}: {}", distance.suns);
        }
    }

    #[test]
    fn every_node_is_above_the_horizon() {
        for index in 0..SIZE.iter().product() {
            let node = [index % SIZE[0], index / SIZE[0] % SIZE[1], index / SIZE[0] / SIZE[1]];
            let [wi, wo] = within(angles_at(node)).directions();
            assert!(above_horizon(wi) && above_horizon(wo), "{node:?}");
        }
    }
}
