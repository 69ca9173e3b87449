//! D(h) read back from an EXR file with nothing but what the manifest says.

// An example shows what it found.
#![allow(clippy::print_stdout)]

use std::io::Cursor;

use exr::prelude::{ReadChannels as _, ReadLayers as _, read};
use sgdbake::brdf::MaskingKind;
use sgdbake::encode::{Format, encode};
use sgdbake::lut::{Depth, Depths, Extent, Quantity, Request, Warp, bake};
use sgdbake::material::find;
use sgdbake::microfacet::SgdNdf;

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let material = &find("gold-paint")?.material;
    let request = Request {
        quantities: vec![Quantity::Ndf],
        masking: MaskingKind::Exact,
        extent: Extent::Size(256),
        depths: Depths::Only(Depth::Half),
    };
    let baked = bake(&[material], &request)?;
    let red = red_texels(&encode(&baked.tables[0], Format::Exr)?)?;
    let Some(Warp::Log1p { scale, max }) = &baked.tables[0].axes[0].warp else {
        return Err("the axis of ndf is log1p".into());
    };
    let exact = SgdNdf::new(material.lobes()[0].alpha(), material.lobes()[0].p());
    for tan2 in [0.0, 0.01, 0.1, 0.5] {
        // u = ln(1 + x/s)/ln(1 + m/s), between texel centres u·(n − 1)
        let u = (f64::min(tan2, max[0]) / scale[0]).ln_1p() / (max[0] / scale[0]).ln_1p();
        let position = u * (red.len() - 1) as f64;
        let left = (position as usize).min(red.len() - 2);
        let share = position - left as f64;
        let texel = f64::from(red[left]) * (1.0 - share) + f64::from(red[left + 1]) * share;
        // D = ndf_peak · exp(texel) · (1 + x)²
        let d = baked.placed[0].ndf_peak[0] * texel.exp() * (1.0 + tan2) * (1.0 + tan2);
        println!("tan²θ {tan2}: D {d:.5} from the texture, {:.5} exactly", exact.ndf(tan2));
    }
    Ok(())
}

fn red_texels(bytes: &[u8]) -> exr::error::Result<Vec<f32>> {
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| vec![0.0_f32; size.area()],
            |texels: &mut Vec<f32>, at, (r, _, _): (f32, f32, f32)| texels[at.x()] = r,
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))?;
    Ok(image.layer_data.channel_data.pixels)
}
