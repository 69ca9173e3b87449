//! The ends of the accepted ranges: everything stays finite, and nothing panics.

use glam::DVec3;
use sgdbake::brdf::{MaskingKind, Sample as _, Sampler, SgdBatch, SgdBrdf, Strategy};
use sgdbake::fit::{gltf, mixture, one_lobe};
use sgdbake::lut::{BakeError, Depths, Extent, Quantity, Request, bake};
use sgdbake::material::{LobeFields, LobeParams, Material};
use sgdbake::math::direction::from_cos_sin;
use sgdbake::microfacet::Family;

/// One lobe at each end of every range, and two lobes that are as different as they can be.
fn corners() -> Vec<Material> {
    let lobe = |alpha: f64, p: f64, rho_s: f64, f0: f64, f1: f64| {
        let fields = LobeFields {
            alpha,
            p,
            masking: None,
            rho_s: [rho_s, 0.0, 1e-300],
            f0: [f0; 3],
            f1: [f1; 3],
        };
        LobeParams::new(fields).expect("at the end of the range")
    };
    let mut corners = Vec::new();
    for alpha in [1e-8, 1e-3, 1.0, 100.0] {
        for p in [0.0, 1e-300, 1.0, 10.0] {
            for (rho_s, f0, f1) in
                [(1e4, 1e4, -1e4), (1e4, -1e4, 1e4), (1e-4, 0.5, 0.0), (0.0, 0.0, 0.0)]
            {
                corners.push(vec![lobe(alpha, p, rho_s, f0, f1)]);
            }
        }
    }
    corners.push(vec![lobe(1e-8, 10.0, 1e4, 1e4, 0.0), lobe(100.0, 0.0, 1e-4, -1e4, 1e4)]);
    let material = |(i, lobes): (usize, Vec<LobeParams>)| {
        let rho_d = [0.0, 1e4, 1e-300].map(|rho_d| if i % 2 == 0 { rho_d } else { 0.2 });
        Material::new(format!("corner {i}"), rho_d, lobes).expect("in range")
    };
    corners.into_iter().enumerate().map(material).collect()
}

fn directions() -> Vec<DVec3> {
    let cosines = [1.0, 1.0 - 1e-12, 0.9, 0.3, 1e-3, 1e-9, 1e-30];
    let at = |cos: f64| {
        let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
        [0.0, 1.0, std::f64::consts::PI].map(|phi| from_cos_sin(cos, sin, phi))
    };
    cosines.into_iter().flat_map(at).collect()
}

#[test]
fn values_and_densities_are_finite() {
    for material in corners() {
        for kind in [MaskingKind::Exact, MaskingKind::Fitted] {
            let brdf = SgdBrdf::new(&material, kind);
            let batch = SgdBatch::new(&material, kind);
            let sampler = Sampler::new(&material, kind, Strategy::Vndf);
            for wi in directions() {
                for wo in directions() {
                    let name = &material.name;
                    let f = brdf.eval(wi, wo);
                    assert!(f.iter().all(|f| f.is_finite()), "{name} {kind:?} {wi} {wo}: {f:?}");
                    let single = batch.terms(wi.as_vec3(), wo.as_vec3()).brdf;
                    assert!(single.iter().all(|f| f.is_finite()), "{name} {kind:?}: {single:?}");
                    let pdf = sampler.pdf(wi, wo);
                    assert!(pdf.is_finite() && pdf >= 0.0, "{name} {kind:?} {wi} {wo}: {pdf}");
                }
                assert!(sampler.sample(wi, [0.3, 0.99, 0.7]).is_none_or(DVec3::is_finite));
            }
        }
    }
}

#[test]
fn fits_are_finite() {
    for material in corners() {
        let name = &material.name;
        for family in [Family::Beckmann, Family::Ggx] {
            let fit = one_lobe::fit(&material, family);
            let residuals = fit.joint_residuals.cube_root;
            assert!(residuals.iter().all(|r| r.is_finite()), "{name} {family:?}: {residuals:?}");
        }
        let residuals = gltf::fit(&material).residuals.cube_root;
        assert!(residuals.iter().all(|r| r.is_finite()), "{name} glTF: {residuals:?}");
        let mixture = mixture::fit(&material, 3);
        assert!(mixture.ndf_error.iter().all(|e| e.is_finite()), "{name}: {:?}", mixture.ndf_error);
        assert!(mixture.mixture.alpha.iter().all(|alpha| *alpha > 0.0));
    }
}

#[test]
fn bakes_keep_their_tolerance_or_are_refused() {
    for material in corners().iter().step_by(3) {
        let request = |extent, quantities: &[Quantity]| Request {
            quantities: quantities.to_vec(),
            masking: MaskingKind::Exact,
            extent,
            depths: Depths::Smallest,
        };
        let small = bake(&[material], &request(Extent::Size(6), &Quantity::ALL)).expect("small");
        for table in &small.tables {
            let texels = (0..table.texels.len()).map(|i| table.texels.get(i));
            let finite = texels.flatten().all(f32::is_finite);
            assert!(finite, "{} {:?}", material.name, table.quantity);
        }
        match bake(&[material], &request(Extent::Tolerance(2e-2), &Quantity::ALL[..3])) {
            Ok(baked) => {
                let measured = baked.tables.iter().filter_map(|table| table.error.measured);
                let worst = measured.fold(0.0, f64::max);
                assert!(worst <= 2e-2, "{}: {worst}", material.name);
            }
            Err(BakeError::NotReached { .. }) => {}
            Err(other) => panic!("{}: {other}", material.name),
        }
    }
}
