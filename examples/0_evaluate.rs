//! The reflectance of a measured material for one pair of directions, and its factors.

// An example shows what it found.
#![allow(clippy::print_stdout)]

use sgdbake::brdf::SgdBrdf;
use sgdbake::material::{Channel, UnknownMaterial, find};
use sgdbake::math::direction::spherical;
use sgdbake::microfacet::masking::MaskingKind;

pub(crate) fn main() -> Result<(), UnknownMaterial> {
    let material = &find("gold-paint")?.material;
    let brdf = SgdBrdf::new(material, MaskingKind::Exact);
    // n = +z; the light 30° to one side, the viewer 40° to the other.
    let wi = spherical(30_f64.to_radians(), 0.0);
    let wo = spherical(40_f64.to_radians(), std::f64::consts::PI);
    for (name, channel) in Channel::ALL.map(Channel::name).into_iter().zip(&brdf.channels) {
        let t = channel.terms(wi, wo);
        println!(
            "{name}: D {:.4}  G1 {:.4} {:.4}  F {:.4}  f {:.5}",
            t.ndf, t.g1_i, t.g1_o, t.fresnel, t.brdf
        );
    }
    Ok(())
}
