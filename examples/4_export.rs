//! A scene whose slot takes a measured material: the best glTF fit, the parameters and the lookup
//! textures, all in one .glb.

// An example shows what it found.
#![allow(clippy::print_stdout)]

use std::path::Path;

use sgdbake::asset::build;
use sgdbake::brdf::MaskingKind;
use sgdbake::encode::Format;
use sgdbake::lut::{Depths, Extent, Quantity, Request};
use sgdbake::material::find;

use sgdbake::scene::Scene;

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let request = Request {
        quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
        masking: MaskingKind::Exact,
        extent: Extent::Tolerance(1e-2),
        depths: Depths::Smallest,
    };
    let product = build(&[&find("gold-paint")?.material], &request, Format::Exr)?;
    let scene = Scene::ball(48)?;
    let assigned: Vec<_> = scene.slots().iter().map(|slot| (slot.id, &product.assets[0])).collect();
    let export = scene.export(&assigned, Path::new("ball.glb"))?;
    for file in &export.files {
        let mut bytes = Vec::new();
        file.write_to(&mut bytes)?;
        println!("{}: {} bytes", file.path.display(), bytes.len());
    }
    Ok(())
}
