//! The directional albedo of a measured material by Monte Carlo and by quadrature.

// An example shows what it found.
#![allow(clippy::print_stdout)]

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use sgdbake::brdf::albedo::directional_albedo;
use sgdbake::brdf::{MaskingKind, Sampler, SgdBrdf, Strategy};
use sgdbake::material::{UnknownMaterial, find};
use sgdbake::math::direction::{cos_theta, spherical};

pub(crate) fn main() -> Result<(), UnknownMaterial> {
    const DRAWS: usize = 20_000;
    let material = &find("gold-paint")?.material;
    let sampler = Sampler::new(material, MaskingKind::Fitted, Strategy::Vndf);
    let wo = spherical(60_f64.to_radians(), 0.0);
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let mut sum = [0.0; 3];
    for _ in 0..DRAWS {
        // E[f cosθi/pdf] = ∫ f cosθi dωi
        if let Some(drawn) = sampler.sample_with_weight(wo, rng.random()) {
            sum = std::array::from_fn(|c| sum[c] + drawn.weight[c]);
        }
    }
    println!("Monte Carlo {:.4?}", sum.map(|sum| sum / DRAWS as f64));
    let brdf = SgdBrdf::new(material, MaskingKind::Fitted);
    println!("quadrature  {:.4?}", directional_albedo(&brdf, cos_theta(wo)));
    Ok(())
}
