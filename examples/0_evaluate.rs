//! The reflectance of a measured material for one pair of directions, and its factors.

// An example shows what it found.
#![allow(clippy::print_stdout)]

use sgdbake::brdf::{MaskingKind, SgdBrdf};
use sgdbake::material::{Channel, UnknownMaterial, find};
use sgdbake::math::direction::spherical;

pub(crate) fn main() -> Result<(), UnknownMaterial> {
    let material = &find("gold-paint")?.material;
    let brdf = SgdBrdf::new(material, MaskingKind::Exact);
    // n = +z; the light 30° to one side, the viewer 40° to the other.
    let wi = spherical(30_f64.to_radians(), 0.0);
    let wo = spherical(40_f64.to_radians(), std::f64::consts::PI);
    let terms = brdf.terms(wi, wo);
    // A published material has three lobes that colour one channel each.
    for (c, lobe) in terms.lobes.iter().enumerate() {
        println!(
            "{}: D {:.4}  G1 {:.4} {:.4}  F {:.4}  f {:.5}",
            Channel::ALL[c].name(),
            lobe.ndf,
            lobe.g1_i,
            lobe.g1_o,
            lobe.fresnel[c],
            terms.brdf[c]
        );
    }
    Ok(())
}
