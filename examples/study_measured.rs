//! Direct fits to the networks that stand in for measurements: ΔE2000 of a ball under suns that no
//! fit saw, next to the trial's.
//!
//!     cargo run --release --example study_measured -- [NAME…]

// An example shows what it found.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::time::Instant;

use rayon::prelude::*;
use sgdbake::brdf::engine::{Engine, EngineBrdf};
use sgdbake::brdf::{MaskingKind, SgdBrdf};
use sgdbake::fit::measured_target::MeasuredTarget;
use sgdbake::fit::sgd::{Energy, Lobes, Options, fit};
use sgdbake::fit::{gltf_measured, one_lobe_measured};
use sgdbake::material::find;
use sgdbake::microfacet::Family;
use sgdbake::report::distance::{Distance, Reference};

#[allow(dead_code)]
#[path = "../tests/common/network.rs"]
mod network;

type Trial = BTreeMap<String, BTreeMap<String, f64>>;

fn trial() -> Trial {
    let text = std::fs::read_to_string(network::folder().unwrap().join("trial.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    lines
        .map(|row| {
            let values = header.iter().zip(&row).skip(1);
            let values = values.filter_map(|(k, v)| Some(((*k).to_owned(), v.parse().ok()?)));
            (row[0].to_owned(), values.collect())
        })
        .collect()
}

fn main() {
    let Some(networks) = network::all() else { return };
    let names: Vec<String> = std::env::args().skip(1).collect();
    let chosen: Vec<_> = networks
        .iter()
        .filter(|(key, _)| {
            names.is_empty() || names.iter().any(|n| key.ends_with(&format!("/{n}")) || **key == *n)
        })
        .collect();
    let trial = trial();
    let quick = std::env::var_os("QUICK").is_some();
    let models: Vec<String> =
        ["published", "one", "two", "two free", "per ch.", "glTF", "GGX", "Beckmann"]
            .map(str::to_owned)
            .into_iter()
            .chain(Engine::ALL.map(|engine| format!("{engine:?}")))
            .collect();
    println!("{:26} | trial: pub one two glTF| {}", "material", models.join(" | "));
    let rows: Vec<_> = chosen
        .par_iter()
        .map(|(key, network)| {
            let name = key.split('/').nth(1).unwrap();
            let reference = Reference::new(*network);
            let target = MeasuredTarget::of(*network).unwrap();
            let run = |lobes, energy| fit(&target, Options { lobes, energy });
            let start = Instant::now();
            let fits = [run(Lobes::One, Energy::Conserve), run(Lobes::Two, Energy::Conserve)];
            let seconds = start.elapsed().as_secs_f64();
            let free = (!quick)
                .then(|| [run(Lobes::Two, Energy::Free), run(Lobes::PerChannel, Energy::Conserve)]);
            let fits: Vec<_> = fits
                .into_iter()
                .map(Some)
                .chain(free.map_or(vec![None, None], |f| f.map(Some).to_vec()))
                .collect();
            let published = find(name).ok().map(|entry| {
                reference.distance(&SgdBrdf::new(&entry.material, MaskingKind::Exact))
            });
            let start = Instant::now();
            let gltf = gltf_measured::fit(&target);
            let gltf_seconds = start.elapsed().as_secs_f64();
            let one = [Family::Ggx, Family::Beckmann].map(|d| {
                (!quick).then(|| reference.distance(&one_lobe_measured::fit(&target, d).brdf()))
            });
            let forms = Engine::ALL.map(|engine| {
                Some(reference.distance(&EngineBrdf { engine, material: gltf.material }))
            });
            let distances: Vec<Option<Distance>> = std::iter::once(published)
                .chain(fits.iter().map(|fit| {
                    let material = fit.as_ref()?.model.material(name).unwrap();
                    Some(reference.distance(&SgdBrdf::new(&material, MaskingKind::Exact)))
                }))
                .chain([Some(reference.distance(&gltf.material))])
                .chain(one)
                .chain(forms)
                .collect();
            let of =
                |k: &str| trial.get(name).and_then(|row| row.get(k)).copied().unwrap_or(f64::NAN);
            let mut line = format!(
                "{name:24}|{:5.2} {:4.2} {:4.2} {:4.2}|",
                of("sgd_published"),
                of("sgd_one_shape"),
                of("sgd_two_lobes"),
                of("gltf_direct")
            );
            for (k, d) in distances.iter().enumerate() {
                match d {
                    Some(d) if k < 8 => {
                        line += &format!(" {:5.2} {:5.2} {:.4}|", d.suns, d.highlights, d.absolute)
                    }
                    Some(d) => line += &format!(" {:5.2}", d.suns),
                    None => line += "    –     –      –|",
                }
            }
            line += &format!(" {seconds:.1} {gltf_seconds:.1} s");
            println!("{line}");
            if names.len() == 1 {
                println!("{:#?}", gltf.material);
            }
            let fits: Vec<_> = fits.into_iter().flatten().collect();
            if names.len() == 1 {
                for fit in &fits {
                    println!("{:#?}", fit.model);
                }
            }
            distances
        })
        .collect();
    for (k, model) in models.iter().enumerate() {
        let mut suns: Vec<f64> = rows.iter().filter_map(|row| Some(row[k]?.suns)).collect();
        let mut high: Vec<f64> = rows.iter().filter_map(|row| Some(row[k]?.highlights)).collect();
        suns.sort_by(f64::total_cmp);
        high.sort_by(f64::total_cmp);
        if suns.is_empty() {
            continue;
        }
        let at = |v: &[f64], q: f64| v[((v.len() - 1) as f64 * q).round() as usize];
        println!(
            "{model:10} suns median {:.3} p90 {:.3} max {:.3}; highlights median {:.3} p90 {:.3}",
            at(&suns, 0.5),
            at(&suns, 0.9),
            at(&suns, 1.0),
            at(&high, 0.5),
            at(&high, 0.9)
        );
    }
}
