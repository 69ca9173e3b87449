//! What one glTF material for all engines costs against one for appendix B alone: mean ΔE2000 under
//! suns of both from the surfaces of ../shared/measured, as appendix B evaluates them and in the
//! worst of the engines' forms.
//!
//! ```text
//! cargo run --release --example study_gltf_forms
//! ```

// An example shows what it found.
#![allow(clippy::print_stdout)]

use std::error::Error;

use rayon::prelude::*;
use sgdbake::asset::{DirectFits, direct_fits};
use sgdbake::brdf::GltfBrdf;
use sgdbake::brdf::engine::{Engine, EngineBrdf};
use sgdbake::fit::gltf_measured;
use sgdbake::fit::measured_target::MeasuredTarget;
use sgdbake::report::distance::Reference;

#[path = "../tests/common/network.rs"]
#[allow(dead_code, clippy::unwrap_used, clippy::expect_used)]
mod network;

const COLUMNS: [&str; 4] = [
    "for all forms, in appendix B",
    "for appendix B, in appendix B",
    "for all forms, in the worst engine",
    "for appendix B, in the worst engine",
];

fn main() -> Result<(), Box<dyn Error>> {
    let networks = network::all().ok_or("the networks are missing")?;
    let of = |fits: &DirectFits| distances(fits, &networks[&format!("merl/{}", fits.name)]);
    let rows: Vec<[f64; 4]> = direct_fits().par_iter().map(of).collect::<Result<_, _>>()?;
    for (i, column) in COLUMNS.iter().enumerate() {
        let mut values: Vec<f64> = rows.iter().map(|row| row[i]).collect();
        values.sort_by(f64::total_cmp);
        let [median, ninetieth, largest] = [50, 90, 100].map(|rank| values[rank - 1]);
        println!("{column:<36} {median:.2} / {ninetieth:.2} / {largest:.2}");
    }
    Ok(())
}

type Failure = sgdbake::fit::measured_target::NothingMeasured;

fn distances(fits: &DirectFits, measured: &network::Network) -> Result<[f64; 4], Failure> {
    let reference = Reference::new(measured);
    let alone = gltf_measured::fit_appendix_b(&MeasuredTarget::of(measured)?);
    let both = [fits.gltf.measured.material, alone];
    let appendix_b = both.map(|material| reference.distance(&material).suns);
    let worst = both.map(|material| worst_engine(&reference, material));
    Ok([appendix_b[0], appendix_b[1], worst[0], worst[1]])
}

fn worst_engine(reference: &Reference, material: GltfBrdf) -> f64 {
    let suns = |engine| reference.distance(&EngineBrdf { engine, material }).suns;
    Engine::ALL.into_iter().map(suns).fold(0.0, f64::max)
}
