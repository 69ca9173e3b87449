//! The Fresnel curves of a fit: sums of a few curves that conserve energy, or any curve.

use serde::{Deserialize, Serialize};

/// The limits of what a fit reflects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Energy {
    /// F in \[0, 1\], so f ≥ 0 for every pair, and a directional albedo of at most 1.
    #[default]
    Conserve,
    /// The nearest to the measurement, though it may reflect more than arrives.
    Free,
}

/// Coefficients of a lobe's colour.
pub const COEFFICIENTS: usize = 5;

/// A function of cosθd by its coefficients of 1 − u − cosθd, u and cosθd with u = (1 − cosθd)⁵:
/// ρs F0, ρs F(90°) = ρs and ρs F(0°) of a Fresnel curve.
type Curve = [f64; 3];

/// Curves whose sums with coefficients ≥ 0 are nearly all curves with 0 ≤ F ≤ F(90°): constant;
/// Schlick's; flat at 90°, 0 at 0°; and two of the continuum that touches 0 between, at
/// cosθd = 1 − 5^(−¼), where F(0°) = F(90°), and at 0.45.
const PHYSICAL: [Curve; COEFFICIENTS] = [
    [1.0, 1.0, 1.0],
    [0.0, 1.0, 0.0],
    [1.25, 1.0, 0.0],
    [-0.869_19, 1.0, 1.0],
    [-0.344_46, 1.0, 0.270_64],
];

/// The unit curves, whose sums are any curve; the last two coefficients are idle.
const ANY: [Curve; COEFFICIENTS] =
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3], [0.0; 3]];

/// The curves that the coefficients are the weights of.
fn curves(energy: Energy) -> &'static [Curve; COEFFICIENTS] {
    match energy {
        Energy::Conserve => &PHYSICAL,
        Energy::Free => &ANY,
    }
}

/// Σ of the curve's coefficients times functions of cosθd, for each coefficient of a colour.
pub fn with_curves(energy: Energy, [one, u, cosine]: [f64; 3]) -> [f64; COEFFICIENTS] {
    curves(energy).map(|[middle, grazing, facing]| {
        middle * (one - u - cosine) + grazing * u + facing * cosine
    })
}

/// The functions of cosθd that a Fresnel curve is a sum of.
pub fn fresnel_basis(energy: Energy, cos_theta_d: f64) -> [f64; COEFFICIENTS] {
    with_curves(energy, [1.0, (1.0 - cos_theta_d).powi(5), cos_theta_d])
}

/// Bounds of the coefficients.
pub fn coefficient_bounds(energy: Energy) -> [[f64; 2]; COEFFICIENTS] {
    const UP: f64 = f64::INFINITY;
    match energy {
        // A sum of physical curves is physical if no coefficient is negative.
        Energy::Conserve => [[0.0, UP]; COEFFICIENTS],
        // ρs is the second, as F(90°) = 1; F0 and F(0°) may have any sign. Idle ones are held at 0.
        Energy::Free => [[-UP, UP], [0.0, UP], [-UP, UP], [0.0; 2], [0.0; 2]],
    }
}

/// ρs F0, ρs and ρs (F0 − F1) of a colour's coefficients.
fn products(energy: Energy, x: [f64; COEFFICIENTS]) -> Curve {
    [0, 1, 2].map(|i| x.iter().zip(curves(energy)).map(|(x, curve)| x * curve[i]).sum())
}

/// ρs, F0 and F1 of a colour's coefficients.
///
/// F(90°) = 1 by the model's form, so ρs is the product at 90°; a curve that vanishes there takes a
/// thousandth of its largest product.
#[must_use]
pub fn parameters(energy: Energy, x: [f64; COEFFICIENTS]) -> [f64; 3] {
    const MIN_SHARE: f64 = 1e-3;
    let [middle, grazing, facing] = products(energy, x);
    // F0 and F1 are quotients by ρs: without a floor they would be infinite.
    let rho_s = grazing.max(MIN_SHARE * middle.abs().max(facing.abs()));
    // A black lobe has any F; 0 keeps it finite.
    if rho_s > 0.0 { [rho_s, middle / rho_s, (middle - facing) / rho_s] } else { [rho_s, 0.0, 0.0] }
}

/// The coefficients of ρs, F0 and F1 for [`Energy::Free`].
#[must_use]
pub fn free_coefficients([rho_s, f0, f1]: [f64; 3]) -> [f64; COEFFICIENTS] {
    [rho_s * f0, rho_s, rho_s * (f0 - f1), 0.0, 0.0]
}
