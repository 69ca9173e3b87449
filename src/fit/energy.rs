//! The limit of a fit's directional albedo.

use std::f64::consts::PI;

use nalgebra::DVector;

use crate::brdf::Lobe;
use crate::brdf::albedo::FresnelMoments;
use crate::fit::fresnel_curve::{COEFFICIENTS, Energy, with_curves};
use crate::fit::penalty::add_residual;
use crate::fit::unknowns::Layout;
use crate::math::direction::cos_sin_degrees;
use crate::math::least_squares::NormalEquations;
use crate::microfacet::Sgd;

/// The largest albedo of a fit: 1 less what the quadrature leaves open.
pub const MOST: f64 = 1.0 - 1e-4;

/// Angles at which the albedo is held below [`MOST`] \[degrees\].
const HELD: [f64; 9] = [0.0, 40.0, 60.0, 70.0, 77.0, 82.0, 86.0, 89.0, 89.9];
/// Angles at which a finished fit is checked \[degrees\]: every 5° up to 60°, every ½° beyond.
fn checked() -> Vec<f64> {
    let steep = (0..12).map(|i| 5.0 * f64::from(i));
    let grazing = (0..60).map(|i| 60.0 + 0.5 * f64::from(i));
    steep.chain(grazing).chain([89.9, 89.99]).collect()
}

/// Keeps the albedo of a layout's solutions below [`MOST`].
pub struct EnergyLimit<'a> {
    /// The layout.
    pub layout: &'a Layout,
}

/// The albedo per unit of each coefficient of a colour, for a fit that conserves energy.
fn moments_at(lobe: &Lobe<Sgd>, theta: f64) -> [f64; COEFFICIENTS] {
    let m = FresnelMoments::new(lobe, cos_sin_degrees(theta).0);
    with_curves(Energy::Conserve, [m.one, m.schlick, m.cosine]).map(|moment| 4.0 / PI * moment)
}

/// Per lobe and angle, the albedo of each coefficient.
fn albedos(layout: &Layout, x: &DVector<f64>, angles: &[f64]) -> Vec<Vec<[f64; COEFFICIENTS]>> {
    let lobes = (0..layout.lobes().len()).map(|lobe| layout.log_shape(x, lobe).lobe());
    lobes.map(|lobe| angles.iter().map(|theta| moments_at(&lobe, *theta)).collect()).collect()
}

/// The albedo of a channel at the angle of an index.
fn albedo(
    layout: &Layout,
    x: &DVector<f64>,
    albedos: &[Vec<[f64; COEFFICIENTS]>],
    channel: usize,
    angle: usize,
) -> f64 {
    let lobes = albedos.iter().enumerate();
    let specular =
        lobes.map(|(lobe, at)| weighted(&at[angle], &layout.coefficients(x, lobe, channel)));
    x[channel] + specular.sum::<f64>()
}

/// Σ_k albedo_k x_k over the coefficients of a colour.
fn weighted(albedo: &[f64; COEFFICIENTS], coefficients: &[f64; COEFFICIENTS]) -> f64 {
    albedo.iter().zip(coefficients).map(|(albedo, x)| albedo * x).sum()
}

/// The largest albedo of each channel over all angles.
fn largest(layout: &Layout, x: &DVector<f64>) -> [f64; 3] {
    let checked = checked();
    let albedos = albedos(layout, x, &checked);
    std::array::from_fn(|c| {
        (0..checked.len()).map(|angle| albedo(layout, x, &albedos, c, angle)).fold(0.0, f64::max)
    })
}

/// The largest albedo of a solution.
#[must_use]
pub fn largest_albedo(layout: &Layout, x: &DVector<f64>) -> f64 {
    largest(layout, x).into_iter().fold(0.0, f64::max)
}

/// The solution with each channel dimmed to an albedo of at most [`MOST`].
#[must_use]
pub fn dimmed(layout: &Layout, mut x: DVector<f64>) -> DVector<f64> {
    let largest = largest(layout, &x);
    for c in 0..3 {
        let share = (MOST / largest[c]).min(1.0);
        x[c] *= share;
        for lobe in 0..layout.lobes().len() {
            let colour = layout.colour(lobe, c);
            (colour..colour + COEFFICIENTS).for_each(|i| x[i] *= share);
        }
    }
    x
}

impl EnergyLimit<'_> {
    /// Adds the squares of what exceeds the limit.
    pub fn add(&self, x: &DVector<f64>, equations: &mut NormalEquations) {
        const STRENGTH: f64 = 1e4;
        let layout = self.layout;
        let albedos = albedos(layout, x, &HELD);
        for (angle, theta) in HELD.iter().enumerate() {
            for c in 0..3 {
                let over = albedo(layout, x, &albedos, c, angle) - MOST;
                if over > 0.0 {
                    let (places, slopes) = self.slopes(x, &albedos, c, angle, *theta);
                    add_residual(equations, STRENGTH, over, &places, &slopes);
                }
            }
        }
    }

    /// The albedo's derivatives, and the unknowns they are by.
    fn slopes(
        &self,
        x: &DVector<f64>,
        albedos: &[Vec<[f64; COEFFICIENTS]>],
        channel: usize,
        angle: usize,
        theta: f64,
    ) -> (Vec<usize>, Vec<f64>) {
        let layout = self.layout;
        let (mut places, mut slopes) = (vec![channel], vec![1.0]);
        for (lobe, albedos) in albedos.iter().enumerate() {
            let coefficients = layout.coefficients(x, lobe, channel);
            let at = layout.shape(lobe);
            let here = weighted(&albedos[angle], &coefficients);
            let by_shape = layout
                .log_shape(x, lobe)
                .slopes(here, |moved| weighted(&moments_at(&moved.lobe(), theta), &coefficients));
            let colour = layout.colour(lobe, channel);
            places.extend([at, at + 1].into_iter().chain(colour..colour + COEFFICIENTS));
            slopes.extend(by_shape.into_iter().chain(albedos[angle]));
        }
        (places, slopes)
    }
}
