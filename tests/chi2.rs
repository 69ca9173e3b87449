//! Every sampler draws with the density it states.

mod common;

use std::cell::Cell;

use common::chi2::{Sampler as Tested, p_value};
use common::materials::shared_lobes;
use glam::DVec3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use sgdbake::brdf::batch::{Draws, SamplerBatch, SamplesMut};
use sgdbake::brdf::reflectance::cosine_sample;
use sgdbake::brdf::{MaskingKind, Sample as _, Sampler, Strategy};
use sgdbake::material::{LobeParams, Material, find};
use sgdbake::math::direction::{cos_sin_degrees, from_cos_sin};

/// From the sharpest channel to the roughest, p from 4.6e-15 to 1.78.
const MATERIALS: [&str; 7] = [
    "specular-orange-phenolic",
    "chrome",
    "gold-paint",
    "alum-bronze",
    "green-acrylic",
    "pink-fabric",
    "black-fabric",
];
const ANGLES: [f64; 5] = [0.0, 30.0, 60.0, 80.0, 89.0];
const DRAWS: u32 = 60_000;

/// One in a million per test, and a fixed seed: a failure is no accident.
const SIGNIFICANCE: f64 = 1e-6;

fn direction(theta: f64) -> DVec3 {
    let (cos, sin) = cos_sin_degrees(theta);
    from_cos_sin(cos, sin, 0.7)
}

fn material(name: &str) -> &'static Material {
    &find(name).expect("in the catalogue").material
}

/// The scale of slopes of the material's sharpest lobe that reflects.
fn width(material: &Material) -> f64 {
    let visible = |lobe: &&LobeParams| lobe.rho_s().iter().any(|rho_s| *rho_s > 1e-6);
    material.lobes().iter().filter(visible).map(|lobe| lobe.alpha().sqrt()).fold(1.0, f64::min)
}

fn check(strategy: Strategy) {
    let published = MATERIALS.map(|name| material(name).clone());
    let materials = published.into_iter().chain(shared_lobes()).collect::<Vec<_>>();
    materials.par_iter().for_each(|material| {
        let name = &material.name;
        let sampler = Sampler::new(material, MaskingKind::Exact, strategy);
        for theta in ANGLES {
            let wo = direction(theta);
            let tested =
                Tested { sample: &|u| sampler.sample(wo, u), pdf: &|wi| sampler.pdf(wi, wo) };
            let p = p_value(&tested, wo, width(material), DRAWS, 7);
            assert!(p > SIGNIFICANCE, "{name} at {theta}°: p-value {p:e}");
        }
    });
}

#[test]
fn visible_normals_of_sgd() {
    check(Strategy::Vndf);
}

#[test]
fn visible_normals_of_tuned_ggx() {
    check(Strategy::Ggx);
}

/// The χ² test calls for one draw at a time; the batch wants many.
fn check_batch(kind: MaskingKind) {
    let published = MATERIALS.map(|name| material(name).clone());
    let materials = published.into_iter().chain(shared_lobes()).collect::<Vec<_>>();
    materials.par_iter().for_each(|material| {
        let name = &material.name;
        let (sampler, exact) =
            (SamplerBatch::new(material, kind), Sampler::new(material, kind, Strategy::Vndf));
        for theta in ANGLES {
            let wo = direction(theta);
            let drawn = draw_many(&sampler, wo);
            let next = Cell::new(0);
            let tested = Tested {
                sample: &|_| drawn[next.replace(next.get() + 1)],
                pdf: &|wi| exact.pdf(wi, wo),
            };
            let p = p_value(&tested, wo, width(material), DRAWS, 7);
            assert!(p > SIGNIFICANCE, "{name} at {theta}°: p-value {p:e}");
        }
    });
}

/// [`DRAWS`] directions for one `wo`.
fn draw_many(sampler: &SamplerBatch, wo: DVec3) -> Vec<Option<DVec3>> {
    let count = DRAWS as usize;
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    let u = [0, 1, 2].map(|_| (0..count).map(|_| rng.random::<f32>()).collect::<Vec<_>>());
    let wo = wo.to_array().map(|axis| vec![axis as f32; count]);
    let [mut x, mut y, mut z, mut r, mut g, mut b, mut pdf] = [0; 7].map(|_| vec![0.0; count]);
    let draws = Draws { wo: wo.each_ref().map(Vec::as_slice), u: u.each_ref().map(Vec::as_slice) };
    let mut samples = SamplesMut {
        wi: [&mut x, &mut y, &mut z],
        weight: [&mut r, &mut g, &mut b],
        pdf: &mut pdf,
    };
    sampler.sample(&draws, &mut samples).expect("equal lengths");
    let direction = |i: usize| DVec3::new(x[i].into(), y[i].into(), z[i].into()).normalize();
    (0..count).map(|i| (pdf[i] > 0.0).then(|| direction(i))).collect()
}

#[test]
fn visible_normals_in_batches() {
    check_batch(MaskingKind::Exact);
}

#[test]
fn cosine_lobe() {
    let wo = direction(40.0);
    let tested = Tested {
        sample: &|[_, u, v]| Some(cosine_sample([u, v])),
        pdf: &|wi| wi.z / std::f64::consts::PI,
    };
    assert!(p_value(&tested, wo, 0.5, DRAWS, 7) > SIGNIFICANCE);
}

#[test]
fn the_test_sees_a_density_that_is_off_by_a_little() {
    let sampler = Sampler::new(material("gold-paint"), MaskingKind::Exact, Strategy::Vndf);
    let wo = direction(60.0);
    let tested = Tested {
        sample: &|u| sampler.sample(wo, u),
        pdf: &|wi| sampler.pdf(wi, wo) * (1.0 + 0.1 * wi.x),
    };
    assert!(p_value(&tested, wo, width(material("gold-paint")), DRAWS, 7) < SIGNIFICANCE);
}
