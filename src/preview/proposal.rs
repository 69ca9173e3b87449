//! Where to look for light that a surface reflects: directions drawn for a material, whatever
//! model then reflects them.
//!
//! All models of one material share the directions, so the noise of two pictures is nearly the
//! same and cancels in their difference.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::brdf::eval::above_horizon;
use crate::brdf::reflectance::cosine_sample;
use crate::material::{ChannelParams, Material};
use crate::math::direction::{cos_theta, half_sum, tan2_theta};
use crate::microfacet::{BeckmannMixture, Fresnel, GgxNdf, visible_normals};

/// A density over directions to the light: a cosine lobe and two GGX lobes sampled by their
/// visible normals, as narrow and as wide as the material's visible channels.
///
/// GGX has longer tails than any SGD lobe, so no direction is drawn much too rarely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proposal {
    /// Widths α of the GGX lobes.
    alpha: [f64; 2],
    /// Share of the GGX lobes together.
    specular: f64,
}

impl Proposal {
    /// The density for a material's measured parameters.
    #[must_use]
    pub fn new(material: &Material) -> Self {
        let visible = material.channels.iter().filter(|c| c.rho_s * 4.0 > 1e-3 * (c.rho_d + 1e-3));
        let widths = visible.map(typical_slope);
        let (narrow, wide) = widths
            .fold((f64::INFINITY, 0.0_f64), |(low, high), width| (low.min(width), high.max(width)));
        if wide == 0.0 {
            return Self { alpha: [1.0; 2], specular: 0.1 };
        }
        let sum = |weight: &dyn Fn(&ChannelParams) -> f64| {
            material.channels.iter().map(weight).sum::<f64>()
        };
        let (diffuse, specular) = (sum(&|c| c.rho_d), sum(&facing_albedo));
        Self {
            alpha: [narrow, wide].map(|alpha| alpha.clamp(1e-4, 1.0)),
            specular: (specular / (specular + diffuse)).clamp(0.3, 0.9),
        }
    }

    /// A direction to the light for `wo`, from three uniform numbers; `None` below the horizon.
    #[must_use]
    pub fn sample(&self, wo: DVec3, [choice, u, v]: [f64; 3]) -> Option<DVec3> {
        if choice >= self.specular {
            return Some(cosine_sample([u, v]));
        }
        let alpha = self.alpha[usize::from(choice >= 0.5 * self.specular)];
        let h = visible_normals::ggx(wo, alpha, [u, v]);
        let wi = 2.0 * wo.dot(h) * h - wo;
        above_horizon(wi).then_some(wi)
    }

    /// The density of [`Self::sample`] at `wi` \[1/sr\], for directions above the horizon.
    #[must_use]
    pub fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        let x = tan2_theta(half_sum(wi, wo));
        // D G1(wo)/(4 cosθo) = D/(2 (cosθo + √(α² sin²θo + cos²θo)))
        let lobe = |alpha: f64| 0.5 * GgxNdf { alpha }.eval(x) / stretched(wo, alpha);
        let specular = 0.5 * (lobe(self.alpha[0]) + lobe(self.alpha[1]));
        self.specular * specular + (1.0 - self.specular) * cos_theta(wi) * FRAC_1_PI
    }
}

/// cosθ + √(α² sin²θ + cos²θ), twice the visible area of a GGX surface seen from `w`.
fn stretched(w: DVec3, alpha: f64) -> f64 {
    w.z + (alpha * alpha * (w.x * w.x + w.y * w.y) + w.z * w.z).sqrt()
}

/// ρs·4·F at normal incidence: about what the lobe reflects.
fn facing_albedo(channel: &ChannelParams) -> f64 {
    let fresnel = Fresnel { f0: channel.f0, f1: channel.f1 };
    (4.0 * channel.rho_s * fresnel.eval(0.8)).max(0.0)
}

/// The median slope tanθ of a channel's normals: for GGX that is α itself.
///
/// Of a Beckmann lobe the share below slope s is 1 − e^{−s²/α²}; SGD is a mixture of those.
fn typical_slope(channel: &ChannelParams) -> f64 {
    const COARSE: f64 = 0.01;
    let mixture = BeckmannMixture::new(channel.alpha, channel.p, COARSE);
    let share_above = |slope: f64| -> f64 {
        let lobes = mixture.lobes().iter();
        lobes.map(|lobe| lobe.weight * (-(slope / lobe.alpha).powi(2)).exp()).sum()
    };
    let (mut low, mut high) = (0.0, channel.alpha.sqrt());
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if share_above(middle) > 0.5 { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;
    use crate::material::find;
    use crate::math::direction::spherical;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    fn proposal(name: &str) -> Proposal {
        Proposal::new(&find(name).expect("in the catalogue").material)
    }

    /// The share of draws in cells of (cosθ, φ) against the density's integral over them.
    #[test]
    fn draws_have_the_stated_density() {
        const CELLS: [usize; 2] = [8, 12];
        const DRAWS: u32 = 200_000;
        let proposal = proposal("gold-paint");
        for theta in [0.2, 1.0, 1.5] {
            let wo = spherical(theta, 0.4);
            let mut rng = Pcg64Mcg::seed_from_u64(3);
            let mut counts = [[0_u32; CELLS[1]]; CELLS[0]];
            for _ in 0..DRAWS {
                if let Some(wi) = proposal.sample(wo, rng.random()) {
                    let [row, column] = cell(wi, CELLS);
                    counts[row][column] += 1;
                }
            }
            for (row, counts) in counts.iter().enumerate() {
                for (column, count) in counts.iter().enumerate() {
                    let expected =
                        cell_integral(&proposal, wo, [row, column], CELLS) * f64::from(DRAWS);
                    let deviation = (f64::from(*count) - expected).abs();
                    assert!(
                        deviation < 5.0 * expected.sqrt() + 5.0 + 2e-3 * expected,
                        "{theta} {row} {column}: {count} {expected}"
                    );
                }
            }
        }
    }

    fn cell(wi: DVec3, cells: [usize; 2]) -> [usize; 2] {
        let turn = wi.y.atan2(wi.x).rem_euclid(TAU) / TAU;
        [(wi.z * cells[0] as f64) as usize, (turn * cells[1] as f64) as usize]
            .map(|i| i)
            .iter()
            .zip(cells)
            .map(|(i, n)| (*i).min(n - 1))
            .collect::<Vec<_>>()
            .try_into()
            .expect("two")
    }

    fn cell_integral(proposal: &Proposal, wo: DVec3, at: [usize; 2], cells: [usize; 2]) -> f64 {
        const STEPS: usize = 40;
        let mut sum = 0.0;
        for i in 0..STEPS * STEPS {
            let part = |k: usize, axis: usize| {
                (at[axis] as f64 + (k as f64 + 0.5) / STEPS as f64) / cells[axis] as f64
            };
            let (cos, phi) = (part(i % STEPS, 0), TAU * part(i / STEPS, 1));
            let wi = spherical(cos.acos(), phi);
            sum += proposal.pdf(wi, wo);
        }
        sum * TAU / (cells[0] * cells[1] * STEPS * STEPS) as f64
    }

    #[test]
    fn every_catalogue_material_has_one() {
        for entry in crate::material::catalog() {
            let Proposal { alpha, specular } = Proposal::new(&entry.material);
            assert!(
                alpha[0] > 0.0 && alpha[0] <= alpha[1] && alpha[1] <= 1.0,
                "{}",
                entry.material.name
            );
            assert!(specular > 0.0 && specular < 1.0);
        }
        assert!(proposal("chrome").alpha[0] < 0.01 && proposal("white-fabric").alpha[1] > 0.2);
    }
}
