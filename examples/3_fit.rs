//! The best glTF material, and the best single lobes, with their residuals.

// An example shows what it found.
#![allow(clippy::print_stdout)]

use sgdbake::fit::{Metric, gltf, one_lobe};
use sgdbake::material::{UnknownMaterial, find};
use sgdbake::microfacet::Family;

pub(crate) fn main() -> Result<(), UnknownMaterial> {
    let material = &find("gold-paint")?.material;
    let fit = gltf::fit(material);
    println!("glTF: base colour {:.3?}", fit.material.base_color);
    println!(
        "      metallic {:.3}, roughness {:.3}",
        fit.material.metallic, fit.material.roughness
    );
    let residual = fit.residuals.in_metric(Metric::default());
    println!("      relative residual per channel {residual:.4?}");
    for family in [Family::Beckmann, Family::Ggx] {
        let fit = one_lobe::fit(material, family);
        let alpha = fit.per_channel.channels.map(|channel| channel.alpha);
        let residual = fit.per_channel_residuals.in_metric(Metric::default());
        println!("{family:?}: alpha {alpha:.3?}, residual {residual:.4?}");
    }
    Ok(())
}
