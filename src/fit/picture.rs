//! A picture of lobes: the weights of angles in a fit of their distributions.

use crate::material::{LobeParams, Material};
use crate::microfacet::{BeckmannMixture, Distribution as _, SgdNdf, SharedMixture};

/// The weight of a relative error in the flanks next to the picture's.
const FLANKS: f64 = 0.3;

/// The weight of a relative error of a lobe's own distribution: it decides where the lobe is
/// invisible.
const OWN: f64 = 0.01;

/// Share of the peak below which a distribution counts as vanished.
const FLOOR: f64 = 1e-7;

/// (D, 1) at each angle times its scale, √((ρs F̄ w)² + (`OWN`/D)²) with the weight w of the
/// angle and (ρs F̄)² summed over colours; per lobe.
///
/// The squares of D_fit − D times the scale, summed over angles spaced by ln θ, are the error of a
/// picture of the lobe under a sun.
#[must_use]
pub fn goals(material: &Material, tan2_theta: &[f64]) -> Vec<Vec<(f64, f64)>> {
    let shown = Shown::new(material);
    let weights = shown.weights(tan2_theta);
    let lobes = shown.lobes.iter();
    lobes
        .map(|lobe| tan2_theta.iter().zip(&weights).map(|(x, w)| lobe.goal(*x, *w)).collect())
        .collect()
}

/// The error of a picture through a mixture under a sun, its peak resolved, relative to the
/// picture: √(∫ Σ_c (Σ_j ρs F̄ (D_fit − D))² dA / ∫ 3 B² dA).
#[must_use]
pub fn error(material: &Material, fitted: &SharedMixture) -> f64 {
    // tan²θ from where the sharpest peak is flat to 55°, past the widest.
    const MIN_TAN2_THETA: f64 = 1e-9;
    const STEP: f64 = 1.055;
    const STEPS: i32 = 400;
    let shown = Shown::new(material);
    let mixtures: Vec<BeckmannMixture> =
        (0..shown.lobes.len()).map(|j| fitted.of_lobe(j)).collect();
    let angles = (0..STEPS).map(|i| MIN_TAN2_THETA * STEP.powi(i));
    let [off, whole] = angles.fold([0.0, 0.0], |[off, whole], x| {
        let brightness = shown.brightness(x);
        // Steps are even in ln x, and the area of a ring in a picture is ∝ x d ln x.
        [off + x * shown.difference(&mixtures, x), whole + x * 3.0 * brightness * brightness]
    });
    (off / whole).sqrt()
}

/// A material as a picture shows it.
struct Shown {
    rho_d: [f64; 3],
    lobes: Vec<ShownLobe>,
}

struct ShownLobe {
    /// ρs F̄ per colour, F̄ = ∫₀¹ F(c) 2c dc, which no fit has below 0 by much.
    specular: [f64; 3],
    ndf: SgdNdf,
}

impl ShownLobe {
    fn new(lobe: &LobeParams) -> Self {
        let specular =
            [0, 1, 2].map(|c| lobe.rho_s()[c] * mean_fresnel(lobe.f0()[c], lobe.f1()[c]).max(0.0));
        Self { specular, ndf: SgdNdf::new(lobe.alpha(), lobe.p()) }
    }

    /// (D, 1) times the scale of an angle with this weight.
    fn goal(&self, tan2_theta: f64, weight: f64) -> (f64, f64) {
        let d = self.ndf.ndf(tan2_theta);
        // Both errors are least squares of the same difference, so their weights add as squares.
        let scale = (self.brightness() * weight).hypot(OWN / (d + FLOOR * self.ndf.peak()));
        (scale * d, scale)
    }

    /// √Σ_c (ρs F̄)².
    fn brightness(&self) -> f64 {
        self.specular.iter().map(|specular| specular * specular).sum::<f64>().sqrt()
    }
}

/// F̄ = F0 + (1 − F0)/21 − ⅔ F1.
fn mean_fresnel(f0: f64, f1: f64) -> f64 {
    f0 + (1.0 - f0) / 21.0 - f1 * 2.0 / 3.0
}

impl Shown {
    fn new(material: &Material) -> Self {
        Self {
            rho_d: material.rho_d(),
            lobes: material.lobes().iter().map(ShownLobe::new).collect(),
        }
    }

    /// The weight of each angle, B the brightness there and x = tan²θ:
    /// w² = x/⟨x B²⟩ + [`FLANKS`]²/B².
    ///
    /// Where angles are spaced by ln θ, the first term makes the sum of squares the mean square
    /// error by area, relative to the picture's mean square; the second holds the relative error
    /// of the flanks, which are all that is seen where pixels are wider than the peak.
    fn weights(&self, tan2_theta: &[f64]) -> Vec<f64> {
        let brightness: Vec<f64> = tan2_theta.iter().map(|x| self.brightness(*x)).collect();
        let by_area: f64 = tan2_theta.iter().zip(&brightness).map(|(x, b)| x * b * b).sum();
        let mean = by_area / tan2_theta.len() as f64;
        let angles = tan2_theta.iter().zip(&brightness);
        angles.map(|(x, b)| (x / mean + (FLANKS / b).powi(2)).sqrt()).collect()
    }

    /// √(mean over colours of (ρd + Σ_j ρs F̄ D)²), with a floor far below the peaks.
    fn brightness(&self, tan2_theta: f64) -> f64 {
        let mut sums = self.rho_d;
        for lobe in &self.lobes {
            // A distribution that underflows would ask for an infinite relative accuracy.
            let d = lobe.ndf.ndf(tan2_theta) + FLOOR * lobe.ndf.peak();
            sums = std::array::from_fn(|c| sums[c] + lobe.specular[c] * d);
        }
        let squares: f64 = sums.iter().map(|sum| sum * sum).sum();
        // Of a black material too 1/B² stays finite.
        (squares / 3.0).sqrt().max(f64::MIN_POSITIVE.sqrt())
    }

    /// Σ_c (Σ_j ρs F̄ (D_fit − D))².
    fn difference(&self, mixtures: &[BeckmannMixture], tan2_theta: f64) -> f64 {
        let mut sums = [0.0; 3];
        for (lobe, mixture) in self.lobes.iter().zip(mixtures) {
            let difference = mixture.ndf(tan2_theta) - lobe.ndf.ndf(tan2_theta);
            sums = std::array::from_fn(|c| sums[c] + lobe.specular[c] * difference);
        }
        sums.iter().map(|sum| sum * sum).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::mixture;
    use crate::material::catalog;

    #[test]
    fn seven_components_look_like_the_material_within_two_percent() {
        for entry in catalog().iter().step_by(4) {
            let error = error(&entry.material, &mixture::best_picture(&entry.material, 7));
            assert!(error <= 0.02, "{}: {error}", entry.material.name);
        }
    }
}
