//! Materials whose lobes colour all three channels, as a refitted surface has them.

use sgdbake::material::{LobeFields, LobeParams, Material};

fn lobe(alpha: f64, p: f64, rho_s: [f64; 3], f0: [f64; 3], f1: [f64; 3]) -> LobeParams {
    let fields = LobeFields { alpha, p, masking: None, rho_s, f0, f1 };
    LobeParams::new(fields).expect("in range")
}

/// One lobe, and two lobes that overlap in every colour: sharp over rough, and all but equal.
pub fn shared_lobes() -> Vec<Material> {
    let gold = lobe(0.02, 0.6, [0.5, 0.35, 0.1], [1.1, 0.9, 0.6], [0.1, 0.1, 0.05]);
    let coat = lobe(6e-4, 0.9, [0.04, 0.05, 0.06], [0.3, 0.3, 0.4], [0.2, 0.25, 0.3]);
    let sheen = lobe(0.4, 1.4, [0.2, 0.1, 0.3], [0.1, 0.2, 0.1], [-0.5, 0.0, -0.2]);
    let dull = lobe(0.021, 0.1, [0.05, 0.4, 0.1], [0.5, 0.5, 0.5], [0.0; 3]);
    let material = |name: &str, rho_d: [f64; 3], lobes: &[LobeParams]| {
        Material::new(name, rho_d, lobes.to_vec()).expect("in range")
    };
    vec![
        material("one lobe", [0.02, 0.01, 0.0], &[gold]),
        material("a coat over a rough lobe", [0.1, 0.2, 0.05], &[coat, sheen]),
        material("two lobes of one width", [0.0; 3], &[gold, dull]),
    ]
}
