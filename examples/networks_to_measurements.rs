//! Measurement files of the networks that stand in for measurements:
//!
//! ```text
//! cargo run --release --example networks_to_measurements -- FOLDER [NAME…]
//! ```
//!
//! Writes NAME.binary (MERL) of each network, or of those named: gold-paint, cc_iris_purple_gem, …;
//! and NAME.bsdf (RGL) of those that stand in for measurements in that form.
//! Needs the folder `measured` of `$SGDBAKE_SHARED`, or of ../shared.

// An example shows what it found.
#![allow(clippy::print_stdout)]

#[path = "../tests/common/network.rs"]
#[allow(dead_code, clippy::unwrap_used, clippy::expect_used)]
mod network;

use std::fs::{self, File};
use std::path::PathBuf;

use sgdbake::measurement::{Merl, Rgl};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or("the folder to write is missing")?);
    let wanted: Vec<String> = arguments.collect();
    let networks = network::all().ok_or("the networks are missing")?;
    fs::create_dir_all(&folder)?;
    for (path, network) in &networks {
        let name = path.rsplit('/').next().unwrap_or(path);
        if !wanted.is_empty() && !wanted.iter().any(|wanted| wanted == name) {
            continue;
        }
        let file = folder.join(format!("{name}.binary"));
        Merl::tabulate(network, &|| {}).write_to(&mut File::create(&file)?)?;
        println!("{}", file.display());
        if path.starts_with("rgl/") {
            let file = folder.join(format!("{name}.bsdf"));
            Rgl::tabulate(network, name.into(), &|| {}).write_to(&mut File::create(&file)?)?;
            println!("{}", file.display());
        }
    }
    Ok(())
}
