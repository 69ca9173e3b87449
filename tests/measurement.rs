#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::io::Cursor;

use sgdbake::measurement::{Measurement, Merl, Problem, Rgl};
use sgdbake::brdf::SgdBrdf;
use sgdbake::measurement::deviation::Deviation;
use sgdbake::microfacet::masking::MaskingKind;

fn sgd(name: &str) -> SgdBrdf {
    let material = &sgdbake::material::find(name).unwrap().material;
    SgdBrdf::new(material, MaskingKind::Fitted)
}

fn read(bytes: Vec<u8>) -> Result<Measurement, Problem> {
    let length = bytes.len() as u64;
    Measurement::from_reader(&mut Cursor::new(bytes), length)
}

#[test]
fn explore_rgl() {
    for name in ["gold-paint", "chrome", "white-paint", "pink-fabric", "alum-bronze", "teflon", "gold-metallic-paint2"] {
        let brdf = sgd(name);
        let rgl = Measurement::Rgl(Rgl::tabulate(&brdf, name.into(), &|| {}));
        println!("{name} rgl {:?}", Deviation::of(&rgl, &brdf));
        let merl = Measurement::Merl(Merl::tabulate(&brdf, &|| {}));
        println!("{name} merl {:?}", Deviation::of(&merl, &brdf));
    }
}
