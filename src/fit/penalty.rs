//! Residuals that an SGD fit has besides those of the measurement.

use nalgebra::DVector;

use crate::fit::fresnel_curve::COEFFICIENTS;
use crate::fit::shape::LogShape;
use crate::fit::unknowns::Layout;
use crate::math::least_squares::NormalEquations;

/// Adds what settles unknowns that the measurement leaves open: of all curves the one with the
/// least F(90°), of all p the nearest to ½, and no D(0) above [`MAX_PEAK`].
pub fn settle(layout: &Layout, x: &DVector<f64>, equations: &mut NormalEquations) {
    // Strengths that move nothing which the measurement sees, but leave no unknown free.
    for lobe in 0..layout.lobes().len() {
        let p = layout.shape(lobe) + 1;
        // A lobe whose flanks do not show leaves p open.
        add_residual(equations, 1e-5, x[p] - 0.5_f64.ln(), &[p], &[1.0]);
        for c in 0..3 {
            let colour = layout.colour(lobe, c);
            for k in 0..COEFFICIENTS {
                // Coefficient 1 shows at grazing angles alone, where little is measured.
                let strength = if k == 1 { 1e-6 } else { 1e-8 };
                add_residual(equations, strength, x[colour + k], &[colour + k], &[1.0]);
            }
        }
    }
    for lobe in 0..layout.lobes().len() {
        limit_peak(layout, x, lobe, equations);
    }
}

/// The largest D(0) of a lobe: about what a half float holds, a core of 0.13°.
pub const MAX_PEAK: f64 = 6.5e4;

/// Adds a wall at [`MAX_PEAK`].
fn limit_peak(layout: &Layout, x: &DVector<f64>, lobe: usize, equations: &mut NormalEquations) {
    /// At the limit itself, a margin beyond its foot, the wall costs 0.025.
    const STRENGTH: f64 = 10.0;
    /// The wall starts this far, in ln D(0), before the limit.
    const MARGIN: f64 = 0.05;
    let shape = layout.log_shape(x, lobe);
    let at = shape.log_peak();
    let over = at - MAX_PEAK.ln() + MARGIN;
    if over > 0.0 {
        let place = layout.shape(lobe);
        add_residual(
            equations,
            STRENGTH,
            over,
            &[place, place + 1],
            &shape.slopes(at, LogShape::log_peak),
        );
    }
}

/// Adds strength · residual² with its derivatives by the unknowns at `places`.
pub fn add_residual(
    equations: &mut NormalEquations,
    strength: f64,
    residual: f64,
    places: &[usize],
    slopes: &[f64],
) {
    equations.squares += strength * residual * residual;
    for (i, by_i) in places.iter().zip(slopes) {
        equations.gradient[*i] += strength * residual * by_i;
        for (j, by_j) in places.iter().zip(slopes) {
            equations.hessian[(*i, *j)] += strength * by_i * by_j;
        }
    }
}
