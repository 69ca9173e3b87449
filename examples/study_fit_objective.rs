//! Which objective makes the fits that look closest? For each metric, the colour difference between
//! a ball of the exact reflectance and of its fit, under one sun and under an environment, over
//! every fifth material of the catalogue. Prints a Markdown table; docs/fits.md holds one.
//!
//!     cargo run --release --example study_fit_objective -- ENVIRONMENT.hdr

// An example shows what it found.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::path::Path;

use sgdbake::brdf::{GltfBrdf, MaskingKind, Reflectance, SgdBrdf};
use sgdbake::fit::{Metric, Target, gltf, one_lobe};
use sgdbake::material::{Material, catalog};
use sgdbake::microfacet::Family;
use sgdbake::preview::ball::{KEY_LIGHT, under_sun};
use sgdbake::preview::environment::Environment;
use sgdbake::preview::render::{Quality, drawn_from, render};
use sgdbake::preview::shape::Shape;

const SIZE: usize = 48;
const QUALITY: Quality = Quality { size: SIZE, samples: 128, seed: 1 };
const MODELS: [&str; 3] = ["Beckmann", "GGX", "glTF"];

/// Mean ΔE2000 of a model's fit, `[metric][lighting]`.
type Differences = [[f64; 2]; 3];

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("name an environment image")?;
    let environment = Environment::load(Path::new(&path))?;
    let materials: Vec<&Material> = catalog().iter().step_by(5).map(|e| &e.material).collect();
    let all: Vec<[Differences; 3]> =
        materials.iter().map(|material| differences(material, &environment)).collect();
    println!("| model | objective | sun: mean ΔE | closest | environment: mean ΔE | closest |");
    println!("|---|---|---:|---:|---:|---:|");
    for (m, model) in MODELS.iter().enumerate() {
        for (k, metric) in Metric::ALL.iter().enumerate() {
            let cells = [0, 1].map(|lighting| {
                let of = |d: &[Differences; 3], k: usize| d[m][k][lighting];
                let mean = all.iter().map(|d| of(d, k)).sum::<f64>() / all.len() as f64;
                let wins = all.iter().filter(|d| (0..3).all(|other| of(d, k) <= of(d, other)));
                format!("{mean:.3} | {}", wins.count())
            });
            println!("| {model} | {metric} | {} | {} |", cells[0], cells[1]);
        }
    }
    Ok(())
}

/// Per model, the differences of its fits.
fn differences(material: &Material, environment: &Environment) -> [Differences; 3] {
    let target = Target::new(material);
    let one_lobe = |family| {
        Metric::ALL.map(|metric| one_lobe::fit_target(&target, family, metric).joint.brdf())
    };
    let [beckmann, ggx] = [Family::Beckmann, Family::Ggx].map(one_lobe);
    let gltf: [GltfBrdf; 3] = Metric::ALL.map(|metric| gltf::fit_target(&target, metric).material);
    let exact = SgdBrdf::new(material, MaskingKind::Fitted);
    let models: [&dyn Reflectance; 10] = [
        &exact,
        &beckmann[0],
        &beckmann[1],
        &beckmann[2],
        &ggx[0],
        &ggx[1],
        &ggx[2],
        &gltf[0],
        &gltf[1],
        &gltf[2],
    ];
    let lit = render(&Shape::Ball, environment, &drawn_from(material), models, QUALITY, &|| ());
    let under_sun = models.map(|model| under_sun(model, KEY_LIGHT, SIZE));
    let row = |model: usize| {
        let sun = under_sun[model].delta_e(&under_sun[0]).mean;
        [sun, lit[model].film.delta_e(&lit[0].film).mean]
    };
    [1, 4, 7].map(|first| [row(first), row(first + 1), row(first + 2)])
}
