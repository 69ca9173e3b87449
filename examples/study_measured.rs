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
use sgdbake::brdf::{MaskingKind, OneLobe, Reflectance, SgdBrdf};
use sgdbake::fit::gltf_measured::{self, GltfMeasuredFit};
use sgdbake::fit::measured_target::MeasuredTarget;
use sgdbake::fit::one_lobe_measured;
use sgdbake::fit::sgd::{Energy, Lobes, Options, SgdFit, fit};
use sgdbake::material::{Material, find};
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

/// Models in the order of the columns, before the engines.
const MODELS: [&str; 8] =
    ["published", "one", "two", "two free", "per ch.", "glTF", "GGX", "Beckmann"];

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
    let engines = Engine::ALL.map(|engine| format!("{engine:?}"));
    let models: Vec<String> = MODELS.map(str::to_owned).into_iter().chain(engines).collect();
    println!("{:26} | trial: pub one two glTF| {}", "material", models.join(" | "));
    let rows: Vec<Vec<Option<Distance>>> = chosen
        .par_iter()
        .map(|(key, network)| {
            let name = key.split('/').nth(1).unwrap();
            let fits = Fits::new(*network, std::env::var_os("QUICK").is_some());
            let distances = fits.distances(name, &Reference::new(*network));
            println!("{}", line(name, &trial, &distances, fits.seconds));
            if names.len() == 1 {
                println!("{:#?}", fits.gltf.material);
                fits.sgd.iter().flatten().for_each(|fit| println!("{:#?}", fit.model));
            }
            distances
        })
        .collect();
    for (k, model) in models.iter().enumerate() {
        let column: Vec<Distance> = rows.iter().filter_map(|row| row[k]).collect();
        if !column.is_empty() {
            summary(model, &column);
        }
    }
}

/// The fits of every model to one measurement; a quick study leaves some out.
struct Fits {
    sgd: [Option<SgdFit>; 4],
    gltf: GltfMeasuredFit,
    one_lobe: [Option<OneLobe>; 2],
    /// Of SGD with one lobe and two, and of glTF.
    seconds: [f64; 2],
}

impl Fits {
    fn new(reflectance: &dyn Reflectance, quick: bool) -> Self {
        let target = MeasuredTarget::of(reflectance).unwrap();
        let start = Instant::now();
        let [one, two] = [Lobes::One, Lobes::Two]
            .map(|lobes| fit(&target, Options { lobes, energy: Energy::Conserve }));
        let seconds = start.elapsed().as_secs_f64();
        let [free, per_channel] =
            [(Lobes::Two, Energy::Free), (Lobes::PerChannel, Energy::Conserve)]
                .map(|(lobes, energy)| (!quick).then(|| fit(&target, Options { lobes, energy })));
        let start = Instant::now();
        let gltf = gltf_measured::fit(&target);
        Self {
            sgd: [Some(one), Some(two), free, per_channel],
            gltf,
            seconds: [seconds, start.elapsed().as_secs_f64()],
            one_lobe: [Family::Ggx, Family::Beckmann]
                .map(|family| (!quick).then(|| one_lobe_measured::fit(&target, family))),
        }
    }

    /// The distance of each model and engine, in the order of the columns.
    fn distances(&self, name: &str, reference: &Reference) -> Vec<Option<Distance>> {
        let material =
            |material: &Material| reference.distance(&SgdBrdf::new(material, MaskingKind::Exact));
        let mut distances = vec![find(name).ok().map(|entry| material(&entry.material))];
        for fit in &self.sgd {
            let fitted = fit.as_ref().map(|fit| fit.model.material(name).unwrap());
            distances.push(fitted.map(|fitted| material(&fitted)));
        }
        distances.push(Some(reference.distance(&self.gltf.material)));
        for one_lobe in &self.one_lobe {
            distances.push(one_lobe.map(|fit| reference.distance(&fit.brdf())));
        }
        for engine in Engine::ALL {
            let brdf = EngineBrdf { engine, material: self.gltf.material };
            distances.push(Some(reference.distance(&brdf)));
        }
        distances
    }
}

/// A material's row: the trial's figures, then ΔE under the suns and in highlights, and |Δf|.
fn line(
    name: &str,
    trial: &Trial,
    distances: &[Option<Distance>],
    [sgd, gltf]: [f64; 2],
) -> String {
    let known = trial.get(name);
    let [published, one, two, direct] =
        ["sgd_published", "sgd_one_shape", "sgd_two_lobes", "gltf_direct"]
            .map(|key| known.and_then(|row| row.get(key)).copied().unwrap_or(f64::NAN));
    let mut line = format!("{name:24}|{published:5.2} {one:4.2} {two:4.2} {direct:4.2}|");
    for (k, distance) in distances.iter().enumerate() {
        line += &match distance {
            Some(d) if k < MODELS.len() => {
                format!(" {:5.2} {:5.2} {:.4}|", d.suns, d.highlights, d.absolute)
            }
            Some(d) => format!(" {:5.2}", d.suns),
            None => "    –     –      –|".to_owned(),
        };
    }
    line + &format!(" {sgd:.1} {gltf:.1} s")
}

/// The distribution of a model's distances.
fn summary(model: &str, column: &[Distance]) {
    let [suns, highlights] = [|d: &Distance| d.suns, |d: &Distance| d.highlights].map(|figure| {
        let mut values: Vec<f64> = column.iter().map(figure).collect();
        values.sort_by(f64::total_cmp);
        [0.5, 0.9, 1.0].map(|q| values[((values.len() - 1) as f64 * q).round() as usize])
    });
    println!(
        "{model:10} suns median {:.3} p90 {:.3} max {:.3}; highlights median {:.3} p90 {:.3}",
        suns[0], suns[1], suns[2], highlights[0], highlights[1]
    );
}
