//! The tables of docs/networks.md, to stdout: how far each model is from the sixteen surfaces
//! whose networks stand in for measurements.
//!
//! ```text
//! cargo run --release --example networks_page > docs/networks.md
//! ```
//!
//! Needs the folder `measured` of `$SGDBAKE_SHARED`, or of ../shared.

// An example shows what it found.
#![allow(clippy::print_stdout)]

#[path = "../tests/common/network.rs"]
#[allow(dead_code, clippy::unwrap_used, clippy::expect_used)]
mod network;

use std::error::Error;

use sgdbake::brdf::engine::{Engine, EngineBrdf};
use sgdbake::brdf::{Brdf, GltfBrdf, Reflectance};
use sgdbake::fit::mixture_measured::MeasuredMixture;
use sgdbake::fit::sgd::{Energy, Lobes, Options};
use sgdbake::fit::{gltf, gltf_measured, mixture, mixture_measured, one_lobe, one_lobe_measured};
use sgdbake::material::find;
use sgdbake::microfacet::Family;
use sgdbake::report::distance::Distance;
use sgdbake::report::surface::{Surface, evaluated};

/// ΔE2000 from which the model does not follow the surface.
const FAR: f64 = 3.0;
/// Components of the mixtures.
const COMPONENTS: usize = 8;

const HEAD: &str = "\
# Errors against measurements

`cargo run --release --example networks_page` made this page from the networks of Sztrajman et \
al. (2021) that stand in for eight surfaces of MERL and eight of RGL. Each model is fitted to the \
surface itself and, where a row says so, to its SGD fit. Columns: mean ΔE2000 of a ball under five \
suns that no fit saw; the same of its highlights under small lights; the mean of |f − measured| \
weighted by both cosines; the same over the mean of f; the relative error in lightness.

glTF rows are appendix B of the specification. The direct fit is to the mean over it and five \
engines' forms; that mean is in the rows that say so.
";

fn main() -> Result<(), Box<dyn Error>> {
    let folder = network::folder().ok_or("the networks are missing")?;
    println!("{HEAD}");
    for (key, surface) in network::read(&folder, "networks.json") {
        section(&key, &surface)?;
    }
    Ok(())
}

fn section(key: &str, measured: &dyn Reflectance) -> Result<(), Box<dyn Error>> {
    let name = key.rsplit('/').next().unwrap_or(key);
    let surface = Surface::new(measured)?;
    println!("## {key}\n\n| model | suns | highlights | absolute [1/sr] | relative | lightness |");
    println!("|---|---|---|---|---|---|");
    if let Ok(entry) = find(name) {
        row("SGD, published", &surface.reference.distance(&evaluated(&entry.material)));
    }
    let fit = |lobes, energy| surface.fit(name, Options { lobes, energy });
    let sgd = fit(Lobes::Auto, Energy::Conserve)?;
    let count = sgd.material.lobes().len();
    row(&format!("SGD, auto ({count} lobes)"), &sgd.distance);
    row("SGD, one lobe", &fit(Lobes::One, Energy::Conserve)?.distance);
    row("SGD, a lobe a channel", &fit(Lobes::PerChannel, Energy::Conserve)?.distance);
    row("SGD, auto, energy free", &fit(Lobes::Auto, Energy::Free)?.distance);
    for (name, family) in [("Beckmann", Family::Beckmann), ("GGX", Family::Ggx)] {
        let direct = one_lobe_measured::fit(&surface.target, family);
        row(name, &surface.reference.distance(&direct.brdf()));
        let per_channel = one_lobe_measured::fit_per_channel(&surface.target, &direct);
        row(&format!("{name}, per channel"), &surface.reference.distance(&per_channel.brdf()));
        let of_sgd = one_lobe::fit(&sgd.material, family).joint.brdf();
        row(&format!("{name} of SGD"), &surface.reference.distance(&of_sgd));
    }
    let mixture = mixture::fit(&sgd.material, COMPONENTS).mixture;
    let of_sgd = Brdf::of_mixture(&sgd.material, &mixture);
    let start = MeasuredMixture::of_material(&sgd.material, mixture);
    let direct = mixture_measured::fit(&surface.target, &start).brdf();
    row("Beckmann mixture", &surface.reference.distance(&direct));
    row("Beckmann mixture of SGD", &surface.reference.distance(&of_sgd));
    let gltf = [
        ("glTF", gltf_measured::fit(&surface.target).material),
        ("glTF for appendix B alone", gltf_measured::fit_appendix_b(&surface.target)),
        ("glTF of SGD", gltf::fit(&sgd.material).material),
    ];
    for (name, material) in gltf {
        row(name, &surface.reference.distance(&material));
        let mean = mean_of_forms(&surface, material);
        println!("| {name}, mean of the forms | {mean:.2} | – | – | – | – |");
    }
    if sgd.distance.suns > FAR {
        println!(
            "\nNo isotropic SGD lobe follows this surface: its colour or its shape changes with the \
             angle in another way, as that of an iridescent paint does."
        );
    }
    println!();
    Ok(())
}

/// The mean ΔE2000 under suns over appendix B and the engines' forms.
fn mean_of_forms(surface: &Surface, material: GltfBrdf) -> f64 {
    let suns = |form: &dyn Reflectance| surface.reference.distance(form).suns;
    let engines = Engine::ALL.into_iter().map(|engine| suns(&EngineBrdf { engine, material }));
    let sum: f64 = engines.chain([suns(&material)]).sum();
    sum / (1 + Engine::ALL.len()) as f64
}

fn row(model: &str, distance: &Distance) {
    let Distance { suns, highlights, absolute, relative, lightness } = distance;
    println!(
        "| {model} | {suns:.2} | {highlights:.2} | {absolute:.5} | {relative:.4} | {lightness:.4} |"
    );
}
