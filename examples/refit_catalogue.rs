//! Makes the second edition of the catalogue from the networks of ../shared/measured: the table of
//! lobes and the direct fits of engine models, each with its distance from the surface.
//!
//!     cargo run --release --example refit_catalogue            writes both files under src/
//!     cargo run --release --example refit_catalogue -- NAME…   prints the lines of some materials

// An example shows what it found.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::fs;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde_json::{Value, json};
use sgdbake::brdf::engine::{Engine, EngineBrdf};
use sgdbake::brdf::{GltfBrdf, MaskingKind, OneLobe, SgdBrdf};
use sgdbake::fit::measured_target::MeasuredTarget;
use sgdbake::fit::sgd::{Energy, Lobes, Options, fit};
use sgdbake::fit::{gltf, gltf_measured, one_lobe, one_lobe_measured};
use sgdbake::material::{CatalogEntry, LobeFields, LobeParams, Material, catalog};
use sgdbake::microfacet::{Accuracy, Family, FittedMasking};
use sgdbake::report::distance::{Distance, Reference};

#[allow(dead_code)]
#[path = "../tests/common/network.rs"]
mod network;

const HEADER: &str = "material,lobe,rho_d_r,rho_d_g,rho_d_b,alpha,p,rho_s_r,rho_s_g,rho_s_b,\
                      f0_r,f0_g,f0_b,f1_r,f1_g,f1_b,lambda,c,k,delta_e,highlights,absolute,\
                      lightness,published_delta_e\n";

/// Seven digits, one more than the paper prints.
fn rounded(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap()
}

/// The fit as the table holds it: rounded, with the masking that follows from the rounded shape.
fn table_material(name: &str, model: &sgdbake::fit::sgd_model::SgdModel) -> Material {
    let lobe = |lobe: &sgdbake::fit::sgd_model::SgdLobe| {
        let fields = LobeFields {
            alpha: rounded(lobe.alpha),
            p: rounded(lobe.p),
            masking: None,
            rho_s: lobe.rho_s.map(rounded),
            f0: lobe.f0.map(rounded),
            f1: lobe.f1.map(rounded),
        };
        let params = LobeParams::new(fields).unwrap();
        let mut masking = FittedMasking::of(&params).params();
        (masking.lambda, masking.c, masking.k) =
            (rounded(masking.lambda), rounded(masking.c), rounded(masking.k));
        params.with_masking(masking)
    };
    Material::new(name, model.rho_d.map(rounded), model.lobes.iter().map(lobe).collect()).unwrap()
}

fn exact(material: &Material) -> SgdBrdf {
    SgdBrdf::with_accuracy(material, MaskingKind::Exact, Accuracy::Table).tabulated()
}

/// A glTF material and its distance in appendix B's form and in each engine's.
fn gltf_json(reference: &Reference, material: &GltfBrdf) -> Value {
    let engines: BTreeMap<String, f64> = Engine::ALL
        .iter()
        .map(|engine| {
            let brdf = EngineBrdf { engine: *engine, material: *material };
            (json!(engine).as_str().unwrap().to_owned(), reference.distance(&brdf).suns)
        })
        .collect();
    json!({"material": material, "error": reference.distance(material), "engines": engines})
}

fn one_lobe_json(reference: &Reference, fit: &OneLobe) -> Value {
    json!({"lobe": fit, "error": reference.distance(&fit.brdf())})
}

/// The table's lines and the direct fits of a material.
fn study(entry: &CatalogEntry, network: &network::Network) -> (String, Value) {
    let name = &entry.material.name;
    let reference = Reference::new(network);
    let target = MeasuredTarget::of(network).unwrap();
    let of = |lobes, energy| fit(&target, Options { lobes, energy });
    let model = of(Lobes::Auto, Energy::Conserve).model;
    let material = table_material(name, &model);
    let error = reference.distance(&exact(&material));
    let published = reference.distance(&exact(&entry.material));
    let distance =
        |lobes, energy| reference.distance(&exact(&table_material(name, &of(lobes, energy).model)));
    let family = |family| {
        json!({
            "measured": one_lobe_json(&reference, &one_lobe_measured::fit(&target, family)),
            "of_published": one_lobe_json(&reference, &one_lobe::fit(&entry.material, family).joint),
        })
    };
    let direct = json!({
        "name": name,
        "published": published,
        "refit": error,
        "one_lobe": distance(Lobes::One, Energy::Conserve),
        "free": distance(Lobes::Auto, Energy::Free),
        "per_channel": distance(Lobes::PerChannel, Energy::Conserve),
        "gltf": {
            "measured": gltf_json(&reference, &gltf_measured::fit(&target).material),
            "of_published": gltf_json(&reference, &gltf::fit(&entry.material).material),
        },
        "ggx": family(Family::Ggx),
        "beckmann": family(Family::Beckmann),
    });
    (lines(&material, &error, &published), direct)
}

fn lines(material: &Material, error: &Distance, published: &Distance) -> String {
    let mut text = String::new();
    for (j, lobe) in material.lobes().iter().enumerate() {
        let masking = lobe.masking().unwrap();
        let errors =
            [error.suns, error.highlights, error.absolute, error.lightness, published.suns];
        let numbers = [
            &material.rho_d()[..],
            &[lobe.alpha(), lobe.p()],
            &lobe.rho_s(),
            &lobe.f0(),
            &lobe.f1(),
            &[masking.lambda, masking.c, masking.k],
        ]
        .concat();
        let numbers: Vec<String> = numbers
            .iter()
            .map(|n| format!("{n:e}"))
            .chain(errors.map(|error| format!("{error:.4}")))
            .collect();
        text += &format!("{},{},{}\n", material.name, j + 1, numbers.join(","));
    }
    text
}

fn main() {
    let Some(networks) = network::all() else { return };
    let names: Vec<String> = std::env::args().skip(1).collect();
    let chosen: Vec<&CatalogEntry> = catalog()
        .iter()
        .filter(|entry| names.is_empty() || names.contains(&entry.material.name))
        .collect();
    let done = AtomicUsize::new(0);
    let studies: Vec<(String, Value)> = chosen
        .par_iter()
        .map(|entry| {
            let found = study(entry, &networks[&format!("merl/{}", entry.material.name)]);
            eprintln!("{}/{}", done.fetch_add(1, Ordering::Relaxed) + 1, chosen.len());
            found
        })
        .collect();
    let table: String = studies.iter().map(|(lines, _)| lines.as_str()).collect();
    let direct: String = studies.iter().map(|(_, direct)| format!("{direct}\n")).collect();
    if names.is_empty() {
        fs::write("src/material/merl100-refit.csv", HEADER.to_owned() + &table).unwrap();
        fs::write("src/asset/merl100-direct.jsonl", direct).unwrap();
    } else {
        println!("{HEADER}{table}{direct}");
    }
}
