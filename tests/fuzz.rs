//! A bounded run of every fuzz target: its seeds, and seeded mutations of them (cut, repeated,
//! overwritten, digits and lengths changed). The open-ended run is `cargo fuzz run TARGET
//! fuzz/corpus/TARGET fuzz/seeds/TARGET`.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

#[path = "support/asset.rs"]
mod support;
#[path = "../fuzz/targets.rs"]
mod targets;

use std::{fs, path::Path};

use rand::{Rng, RngExt, SeedableRng, seq::IndexedRandom};
use rand_pcg::Pcg64;
use support::asset;

const MUTATIONS_PER_SEED: usize = 60;
/// Bytes that mean something to one of the formats.
const TELLING: &[u8] = b"0123456789-.eE/\\\"{}[],: \n\t=#*%\0\xff\x7f\x80";

fn run(target: fn(&[u8]), name: &str) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(name);
    let mut seeds: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    seeds.sort();
    assert!(!seeds.is_empty());
    let mut rng = Pcg64::seed_from_u64(6);
    for seed in seeds {
        let bytes = fs::read(&seed).unwrap();
        target(&bytes);
        for _ in 0..MUTATIONS_PER_SEED {
            target(&mutated(&bytes, &mut rng));
        }
    }
}

fn mutated(bytes: &[u8], rng: &mut impl Rng) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..rng.random_range(1..4) {
        if bytes.is_empty() {
            break;
        }
        let at = rng.random_range(0..bytes.len());
        let end = rng.random_range(at..=bytes.len().min(at + 40));
        match rng.random_range(0..6) {
            0 => bytes.truncate(at),
            1 => drop(bytes.drain(at..end)),
            2 => bytes[at] = rng.random(),
            3 => bytes[at] = *TELLING.choose(rng).unwrap(),
            4 => bytes.insert(at, *TELLING.choose(rng).unwrap()),
            _ => {
                let copy = bytes[at..end].to_vec();
                bytes.splice(at..at, copy);
            }
        }
    }
    bytes
}

#[test]
fn glb() {
    run(targets::glb, "glb");
}

#[test]
fn gltf() {
    run(targets::gltf, "gltf");
}

#[test]
fn obj() {
    run(targets::obj, "obj");
}

#[test]
fn mtl() {
    run(targets::mtl, "mtl");
}

#[test]
fn material() {
    run(targets::material, "material");
}

#[test]
fn assignment() {
    run(targets::assignment, "assignment");
}

#[test]
fn manifest() {
    run(targets::manifest, "manifest");
}

#[test]
fn measurement() {
    run(targets::measurement, "measurement");
}
