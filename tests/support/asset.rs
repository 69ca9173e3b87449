//! A material to put into test scenes.

use std::sync::Arc;

use sgdbake::asset::{Asset, MaterialEntry, Parameters, Texture};
use sgdbake::brdf::GltfBrdf;
use sgdbake::encode::{Format, Interpolation, Location, TextureEntry};
use sgdbake::lut::{Axis, Depth, Encoding, ErrorNote, Quantity, Variable, Warp};
use sgdbake::material::{LobeFields, LobeParams, MaskingParams};
use sgdbake::microfacet::SharedMixture;

/// An asset with everything in it, its two textures sharing their bytes.
pub fn asset() -> Asset {
    let bytes: Arc<[u8]> = Arc::from(&b"\x76\x2f\x31\x01 not a real EXR"[..]);
    let texture = |quantity| Texture { entry: entry(quantity), bytes: bytes.clone() };
    Asset {
        material: material(),
        gltf: GltfBrdf {
            base_color: [0.5, 0.25, 0.125],
            metallic: 1.0,
            roughness: 0.375,
            specular_factor: 0.5,
            specular_color: [1.0, 0.9, 0.8],
            clearcoat: Some(0.25),
            clearcoat_roughness: Some(0.1),
        },
        textures: vec![texture(Quantity::Ndf), texture(Quantity::Fresnel)],
    }
}

fn material() -> MaterialEntry {
    let lobe = LobeFields {
        alpha: 0.125,
        p: 0.5,
        masking: Some(MaskingParams { lambda: 2.5, c: 0.25, k: 24.0 }),
        rho_s: [0.5, 0.25, 0.125],
        f0: [0.0625; 3],
        f1: [-0.5, 0.0, 0.5],
    };
    MaterialEntry {
        parameters: Parameters {
            name: "gold-paint".into(),
            diffuse: [0.25, 0.5, 0.75],
            lobes: vec![LobeParams::new(lobe).expect("in range")],
        },
        ndf_peak: vec![2.0],
        mixture: SharedMixture { alpha: vec![0.25, 0.5], weights: vec![vec![0.75], vec![0.25]] },
        row: Some(0),
        fresnel_rows: vec![0],
        error: None,
    }
}

fn entry(quantity: Quantity) -> TextureEntry {
    let warp = Warp::Rational { scale: vec![0.5] };
    TextureEntry {
        quantity,
        location: Location::File { file: format!("{}.exr", quantity.name()) },
        format: Format::Exr,
        depth: Depth::Half,
        range: None,
        size: vec![2, 1],
        axes: vec![Axis { variable: Variable::CotTheta, warp: Some(warp) }, Axis::ROW],
        encoding: Encoding::Identity,
        filter: Interpolation::Linear,
        rows: vec!["gold-paint".into()],
        row: None,
        error: ErrorNote { tolerance: Some(0.001), measured: Some(0.0005) },
    }
}
