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
pub const MAX_ALBEDO: f64 = 1.0 - 1e-4;

/// Angles at which the albedo is held below [`MAX_ALBEDO`] \[degrees\]: few, as each costs a
/// quadrature per step, and close where an albedo rises.
const HELD: [f64; 9] = [0.0, 40.0, 60.0, 70.0, 77.0, 82.0, 86.0, 89.0, 89.9];

/// Angles at which a finished fit is checked \[degrees\]: every 5° up to 60°, every ½° beyond.
fn checked() -> Vec<f64> {
    let steep = (0..12).map(|i| 5.0 * f64::from(i));
    let grazing = (0..60).map(|i| 60.0 + 0.5 * f64::from(i));
    steep.chain(grazing).chain([89.9, 89.99]).collect()
}

/// The albedo per unit of each coefficient of a colour, for a fit that conserves energy.
fn moments_at(lobe: &Lobe<Sgd>, theta: f64) -> [f64; COEFFICIENTS] {
    // Linear in the coefficients, so one quadrature serves all five and all three colours. The
    // moments have the usual ¼, the model's specular scale is 4ρs/π.
    let m = FresnelMoments::new(lobe, cos_sin_degrees(theta).0);
    with_curves(Energy::Conserve, [m.one, m.schlick, m.cosine]).map(|moment| 4.0 / PI * moment)
}

/// Σ_k albedo_k x_k over the coefficients of a colour.
fn weighted(albedo: &[f64; COEFFICIENTS], coefficients: &[f64; COEFFICIENTS]) -> f64 {
    albedo.iter().zip(coefficients).map(|(albedo, x)| albedo * x).sum()
}

/// The albedo of a solution at some angles.
struct Albedos<'a> {
    layout: &'a Layout,
    x: &'a DVector<f64>,
    /// The angles \[degrees\].
    angles: &'a [f64],
    /// The albedo of each coefficient, by lobe and angle.
    of_coefficients: Vec<Vec<[f64; COEFFICIENTS]>>,
}

impl<'a> Albedos<'a> {
    fn new(layout: &'a Layout, x: &'a DVector<f64>, angles: &'a [f64]) -> Self {
        let lobes = (0..layout.lobes().len()).map(|lobe| layout.log_shape(x, lobe).lobe());
        let of_coefficients = lobes
            .map(|lobe| angles.iter().map(|theta| moments_at(&lobe, *theta)).collect())
            .collect();
        Self { layout, x, angles, of_coefficients }
    }

    /// ρd + Σ of the lobes, of a channel at the angle of an index.
    fn at(&self, channel: usize, angle: usize) -> f64 {
        let lobes = self.of_coefficients.iter().enumerate();
        let specular = lobes.map(|(lobe, albedos)| {
            weighted(&albedos[angle], &self.layout.coefficients(self.x, lobe, channel))
        });
        self.x[channel] + specular.sum::<f64>()
    }

    /// The places of the unknowns that the albedo depends on, and its derivatives by them.
    fn slopes(&self, channel: usize, angle: usize) -> (Vec<usize>, Vec<f64>) {
        let Self { layout, x, .. } = *self;
        let (mut places, mut slopes) = (vec![channel], vec![1.0]);
        for (lobe, albedos) in self.of_coefficients.iter().enumerate() {
            let coefficients = layout.coefficients(x, lobe, channel);
            let here = weighted(&albedos[angle], &coefficients);
            // Two more quadratures per lobe; only the albedos that exceed the limit ask for them.
            let by_shape = layout.log_shape(x, lobe).slopes(here, |moved| {
                weighted(&moments_at(&moved.lobe(), self.angles[angle]), &coefficients)
            });
            let (shape, colour) = (layout.shape(lobe), layout.colour(lobe, channel));
            places.extend([shape, shape + 1].into_iter().chain(colour..colour + COEFFICIENTS));
            slopes.extend(by_shape.into_iter().chain(albedos[angle]));
        }
        (places, slopes)
    }
}

/// The largest albedo of each channel over all angles.
fn largest(layout: &Layout, x: &DVector<f64>) -> [f64; 3] {
    let checked = checked();
    let albedos = Albedos::new(layout, x, &checked);
    std::array::from_fn(|c| {
        (0..checked.len()).map(|angle| albedos.at(c, angle)).fold(0.0, f64::max)
    })
}

/// The largest albedo of a solution.
#[must_use]
pub fn largest_albedo(layout: &Layout, x: &DVector<f64>) -> f64 {
    largest(layout, x).into_iter().fold(0.0, f64::max)
}

/// The solution with each channel dimmed to an albedo of at most [`MAX_ALBEDO`].
#[must_use]
pub fn dimmed(layout: &Layout, mut x: DVector<f64>) -> DVector<f64> {
    let largest = largest(layout, &x);
    for c in 0..3 {
        // The albedo is linear in the colours: one factor is exact. A black channel's is ∞, thus 1.
        let share = (MAX_ALBEDO / largest[c]).min(1.0);
        x[c] *= share;
        for lobe in 0..layout.lobes().len() {
            let colour = layout.colour(lobe, c);
            (colour..colour + COEFFICIENTS).for_each(|i| x[i] *= share);
        }
    }
    x
}

/// Adds the squares of what exceeds [`MAX_ALBEDO`].
pub fn limit_albedo(layout: &Layout, x: &DVector<f64>, equations: &mut NormalEquations) {
    /// An excess of 1 % at one angle costs 1; a mean ΔE of 1 costs about 0.26.
    const STRENGTH: f64 = 1e4;
    let albedos = Albedos::new(layout, x, &HELD);
    for angle in 0..HELD.len() {
        for c in 0..3 {
            // Below the limit nothing pulls; the small excess that is left is dimmed away.
            let over = albedos.at(c, angle) - MAX_ALBEDO;
            if over > 0.0 {
                let (places, slopes) = albedos.slopes(c, angle);
                add_residual(equations, STRENGTH, over, &places, &slopes);
            }
        }
    }
}
