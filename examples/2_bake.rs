//! Lookup textures of two materials, as EXR bytes.

// An example shows what it found.
#![allow(clippy::print_stdout)]

use sgdbake::brdf::MaskingKind;
use sgdbake::encode::{Format, encode};
use sgdbake::lut::{Depths, Extent, Quantity, Request, bake};
use sgdbake::material::find;

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let materials = [&find("gold-paint")?.material, &find("chrome")?.material];
    let request = Request {
        quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
        masking: MaskingKind::Exact,
        extent: Extent::Size(256),
        depths: Depths::default(),
    };
    let baked = bake(&materials, &request)?;
    for table in &baked.tables {
        let bytes = encode(table, Format::Exr)?;
        println!(
            "{}: {:?} texels, {} bytes of EXR",
            table.quantity.name(),
            table.size,
            bytes.len()
        );
    }
    Ok(())
}
