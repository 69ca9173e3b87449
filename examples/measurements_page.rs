//! Writes docs/measurements.md, how far every model of the catalogue is from the measured surfaces,
//! and docs/editions.svg, six of them side by side. Needs the networks of ../shared/measured.
//!
//!     cargo run --release --example measurements_page -- ENVIRONMENT.hdr

// An example shows what it found.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use base64::{Engine as _, prelude::BASE64_STANDARD};
use rayon::prelude::*;
use sgdbake::asset::{DirectFits, Distances, direct_fits};
use sgdbake::brdf::batch::SgdBatch;
use sgdbake::brdf::{MaskingKind, Reflectance};
use sgdbake::material::{find, named};
use sgdbake::preview::render::{Quality, Render, drawn_from, render};
use sgdbake::preview::{Environment, Shape};

#[allow(dead_code)]
#[path = "../tests/common/network.rs"]
mod network;

/// The compared models, in the order of every array of them.
const MODELS: [&str; 6] = [
    "published SGD",
    "**refit SGD**",
    "glTF, of the published SGD",
    "**glTF, of the measurement**",
    "GGX, of the measurement",
    "Beckmann, of the measurement",
];

fn distances(fits: &DirectFits) -> [Distances; 6] {
    [
        fits.published,
        fits.refit,
        fits.gltf.of_published.error,
        fits.gltf.measured.error,
        fits.ggx.measured.error,
        fits.beckmann.measured.error,
    ]
}

/// The measurement and each model on a ball under the same lights.
fn balls(
    fits: &DirectFits,
    network: &network::Network,
    environment: &Environment,
    quality: Quality,
) -> [Render; 7] {
    let published = &find(&fits.name).unwrap().material;
    let refit = named(&format!("{}@refit", fits.name)).unwrap();
    let [of_published, of_refit] =
        [published, refit].map(|material| SgdBatch::new(material, MaskingKind::Exact));
    let [ggx, beckmann] = [&fits.ggx, &fits.beckmann].map(|fit| fit.measured.lobe.brdf());
    let models: [&dyn Reflectance; 7] = [
        network,
        &of_published,
        &of_refit,
        &fits.gltf.of_published.material,
        &fits.gltf.measured.material,
        &ggx,
        &beckmann,
    ];
    render(&Shape::Ball, environment, &drawn_from(refit), models, quality, &|| ())
}

/// Mean ΔE2000 of each model's ball from the measurement's.
fn under(fits: &DirectFits, network: &network::Network, environment: &Environment) -> [f64; 6] {
    let quality = Quality { size: 40, samples: 128, seed: 1 };
    let [measured, models @ ..] = balls(fits, network, environment, quality);
    models.map(|model| model.film.delta_e(&measured.film).mean)
}

/// Median, 90th percentile and largest.
fn quantiles(values: impl Iterator<Item = f64>) -> [f64; 3] {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
    [at(0.5), at(0.9), at(1.0)]
}

fn three(values: [f64; 3], digits: usize) -> String {
    values.map(|value| format!("{value:.digits$}")).join(" / ")
}

fn summary(under: &[[f64; 6]]) -> String {
    let mut text = String::from(
        "| model | ΔE suns | ΔE environment | ΔE highlights | error in lightness | absolute error [1/sr] |\n\
         |---|---|---|---|---|---|\n",
    );
    let of = |m: usize, value: fn(&Distances) -> f64| {
        quantiles(direct_fits().iter().map(|fits| value(&distances(fits)[m])))
    };
    for (m, model) in MODELS.iter().enumerate() {
        let _ = writeln!(
            text,
            "| {model} | {} | {} | {} | {} | {} |",
            three(of(m, |d| d.suns), 2),
            three(quantiles(under.iter().map(|under| under[m])), 2),
            three(of(m, |d| d.highlights), 2),
            three(of(m, |d| d.lightness), 3),
            three(of(m, |d| d.absolute), 4),
        );
    }
    text
}

/// Mean ΔE2000 under suns of each engine's glTF, fitted to the published SGD and to the measurement.
fn engines() -> String {
    let mut text = String::from(
        "| form of the glTF model | of the published SGD | of the measurement |\n|---|---|---|\n",
    );
    let first = &direct_fits()[0].gltf.measured.engines;
    for engine in first.keys() {
        let before =
            quantiles(direct_fits().iter().map(|fits| fits.gltf.of_published.engines[engine]));
        let after = quantiles(direct_fits().iter().map(|fits| fits.gltf.measured.engines[engine]));
        let _ = writeln!(text, "| {engine} | {} | {} |", three(before, 2), three(after, 2));
    }
    text
}

/// The distance of one model under the suns.
type SunsOf = fn(&DirectFits) -> f64;

fn variants() -> String {
    let rows: [(&str, SunsOf); 4] = [
        ("one lobe or two that colour all channels (the refit)", |fits| fits.refit.suns),
        ("the same without the limit on energy", |fits| fits.free.suns),
        ("one lobe that colours all channels", |fits| fits.one_lobe.suns),
        ("the paper's form, a lobe for each channel", |fits| fits.per_channel.suns),
    ];
    let mut text = String::from("| SGD fitted to the measurement | ΔE suns |\n|---|---|\n");
    for (name, value) in rows {
        let _ =
            writeln!(text, "| {name} | {} |", three(quantiles(direct_fits().iter().map(value)), 2));
    }
    text
}

fn all(under: &[[f64; 6]]) -> String {
    let mut text = String::from(
        "| material | published | refit | glTF of published | glTF | GGX | Beckmann | lightness, published | lightness, refit | absolute, published | absolute, refit |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (fits, under) in direct_fits().iter().zip(under) {
        let of = distances(fits);
        let cells: Vec<String> =
            (0..6).map(|m| format!("{:.2} · {:.2}", of[m].suns, under[m])).collect();
        let _ = writeln!(
            text,
            "| {} | {} | {:.3} | {:.3} | {:.4} | {:.4} |",
            fits.name,
            cells.join(" | "),
            of[0].lightness,
            of[1].lightness,
            of[0].absolute,
            of[1].absolute,
        );
    }
    text
}

fn page(under: &[[f64; 6]], environment: &str) -> String {
    format!(
        "<!-- sgdbake examples/measurements_page.rs writes this page -->\n\
         # Distance from the measured surfaces\n\n\
         Every model of the 100 MERL materials against the measurement. The measurements are networks \
         that Sztrajman, Rainer, Ritschel and Weyrich (2021, MIT licence) trained on the MERL database \
         (Matusik et al. 2003, whose terms hold for the data: https://www.merl.com/research/downloads/BRDF). On slices of the real measurements the networks \
         themselves are a mean ΔE2000 of 1.0 off.\n\n\
         ΔE is the mean CIEDE2000 of a ball: under five suns at 15, 40, 70, 110 and 140° from the viewer, \
         of which the fits saw none (48 pixels, clipped at white); under `{environment}` (40 pixels, tone-mapped); of the highlights \
         under small area lights. Error in lightness is relative, the absolute error the cosine-weighted \
         mean of |Δf|. Each cell holds median / 90th percentile / largest of the 100.\n\n{}\n\
         Of the refit edition every f is ≥ 0 and every albedo ≤ 1 (`sgdbake audit --all --edition refit`). \
         The cost of that, and of other forms:\n\n{}\n\
         One glTF material as engines evaluate it (docs/engine-forms.md), mean ΔE2000 under suns:\n\n{}\n\
         ## All materials\n\nMean ΔE2000 under suns · under the environment.\n\n{}\n\
         `cargo run --release --example refit_catalogue` makes the edition, \
         `cargo run --release --example measurements_page -- ENVIRONMENT.hdr` this page.\n",
        summary(under),
        variants(),
        engines(),
        all(under)
    )
}

/// Six materials: reference, published, refit, and the refit's glTF, with ΔE under each.
fn picture(
    environment: &Environment,
    networks: &std::collections::BTreeMap<String, network::Network>,
) -> String {
    const SHOWN: [&str; 6] = [
        "gold-metallic-paint2",
        "alum-bronze",
        "aluminium",
        "blue-metallic-paint2",
        "pink-plastic",
        "white-paint",
    ];
    const COLUMNS: [(usize, &str); 4] =
        [(0, "measured"), (1, "published SGD"), (2, "refit"), (4, "refit’s glTF")];
    const CELL: usize = 150;
    const LABEL: usize = 170;
    let quality = Quality { size: CELL, samples: 1024, seed: 1 };
    let (width, height) = (LABEL + COLUMNS.len() * CELL, 30 + SHOWN.len() * (CELL + 24));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\" font-family=\"system-ui, sans-serif\" font-size=\"13\">\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>"
    );
    for (column, (_, name)) in COLUMNS.iter().enumerate() {
        let x = LABEL + column * CELL + CELL / 2;
        let _ = write!(
            svg,
            "<text x=\"{x}\" y=\"20\" text-anchor=\"middle\" fill=\"#222\">{name}</text>"
        );
    }
    for (row, name) in SHOWN.iter().enumerate() {
        let fits = direct_fits().iter().find(|fits| fits.name == *name).unwrap();
        let balls = balls(fits, &networks[&format!("merl/{name}")], environment, quality);
        let y = 30 + row * (CELL + 24);
        let _ = write!(svg, "<text x=\"8\" y=\"{}\" fill=\"#222\">{name}</text>", y + CELL / 2);
        for (column, (model, _)) in COLUMNS.iter().enumerate() {
            let x = LABEL + column * CELL;
            let png = BASE64_STANDARD.encode(balls[*model].film.to_png().unwrap());
            let _ = write!(
                svg,
                "<image x=\"{x}\" y=\"{y}\" width=\"{CELL}\" height=\"{CELL}\" href=\"data:image/png;base64,{png}\"/>"
            );
            if *model > 0 {
                let delta_e = balls[*model].film.delta_e(&balls[0].film).mean;
                let _ = write!(
                    svg,
                    "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" fill=\"#555\">ΔE {delta_e:.1}</text>",
                    x + CELL / 2,
                    y + CELL + 15
                );
            }
        }
    }
    svg + "</svg>\n"
}

fn main() {
    let Some(networks) = network::all() else { return };
    let path = std::env::args().nth(1).expect("give an environment image");
    let environment = Environment::load(Path::new(&path)).unwrap();
    let name = Path::new(&path).file_name().unwrap().to_string_lossy().into_owned();
    let under: Vec<[f64; 6]> = direct_fits()
        .par_iter()
        .map(|fits| under(fits, &networks[&format!("merl/{}", fits.name)], &environment))
        .collect();
    fs::write("docs/measurements.md", page(&under, &name)).unwrap();
    fs::write("docs/editions.svg", picture(&Environment::studio(), &networks)).unwrap();
    println!("{}", summary(&under));
}
