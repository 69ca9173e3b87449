//! An attacker on the promise of textures: random legal materials, baked, and the worst pair of
//! directions searched with a decoder of its own.
//!
//! Some materials a run; `SGDBAKE_ATTACKS=2000` takes as many, and prints what it found.

// What it counted is its result.
#![allow(clippy::print_stdout)]

use glam::DVec3;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use rayon::prelude::*;
use sgdbake::brdf::{MaskingKind, Reflectance, SgdBrdf};
use sgdbake::lut::attack::attack;
use sgdbake::lut::decode::{Lookup, LutBrdf, VolumeBrdf};
use sgdbake::lut::probe::{Probe, probes};
use sgdbake::lut::{
    BakeError, Baked, Depth, Depths, Extent, Proof, Quantity, Request, Table, bake,
};
use sgdbake::material::{LobeFields, LobeParams, Material, catalog};
use sgdbake::microfacet::Accuracy;

const FACTORS: [Quantity; 3] = [Quantity::Ndf, Quantity::Masking, Quantity::Fresnel];

/// How many materials a test takes.
fn attacks(usual: u32) -> u32 {
    std::env::var("SGDBAKE_ATTACKS").ok().and_then(|n| n.parse().ok()).unwrap_or(usual)
}

fn runner(cases: u32) -> TestRunner {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha))
}

/// e^x, x between the logarithms of two numbers.
fn log_uniform(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

/// A colour that may be 0, or differ by decades from channel to channel.
fn colour(low: f64, high: f64) -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![
        1 => Just([0.0; 3]),
        4 => [log_uniform(low, high), log_uniform(low, high), log_uniform(low, high)],
        2 => log_uniform(low, high).prop_map(|x| [x; 3]),
    ]
}

/// Any curve: also one that changes sign or leaves [0, 1].
fn fresnel() -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![
        [0.0..1.0, 0.0..1.0, 0.0..1.0],
        [-2.0..3.0, -2.0..3.0, -2.0..3.0],
        (-8.0..8.0).prop_map(|x: f64| [x; 3]),
    ]
}

fn lobe() -> impl Strategy<Value = LobeParams> {
    let p = prop_oneof![Just(0.0), 0.0..2.0, 2.0..6.0];
    (log_uniform(1e-6, 3.0), p, colour(1e-4, 5.0), fresnel(), fresnel()).prop_map(
        |(alpha, p, rho_s, f0, f1)| {
            LobeParams::new(LobeFields { alpha, p, masking: None, rho_s, f0, f1 })
                .expect("in range")
        },
    )
}

fn material() -> impl Strategy<Value = Material> {
    (colour(1e-4, 1.0), proptest::collection::vec(lobe(), 1..=3)).prop_map(|(rho_d, lobes)| {
        Material::new("random", rho_d, lobes).expect("at most three lobes")
    })
}

/// |f_lut − f| cosθi of a probe over the promise's bound, the worst of the colours.
fn error(exact: &SgdBrdf, decoder: &dyn Reflectance, probe: &Probe) -> f64 {
    let [wi, wo]: [DVec3; 2] = probe.pair;
    let (truth, found) = (exact.eval(wi, wo), decoder.eval(wi, wo));
    let of = |c: usize| {
        let difference = (found[c] - truth[c]).abs() * wi.z;
        if difference > 0.0 { difference / probe.colours[c].bound } else { 0.0 }
    };
    (0..3).map(of).fold(0.0, f64::max)
}

/// The largest error that climbs from the worst of several hundred pairs find.
fn searched(exact: &SgdBrdf, decoder: &dyn Reflectance, climbs: usize) -> f64 {
    let starts = probes(exact, 77);
    let mut starts: Vec<(f64, &Probe)> =
        starts.iter().map(|probe| (error(exact, decoder, probe), probe)).collect();
    starts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let climb = |(_, start): &(f64, &Probe)| attack(exact, start, |p| error(exact, decoder, p)).0;
    starts.iter().take(climbs).map(climb).fold(0.0, f64::max)
}

/// The exact reflectance, to 1e-8.
fn exactly(material: &Material) -> SgdBrdf {
    SgdBrdf::with_accuracy(material, MaskingKind::Exact, Accuracy::Table).tabulated()
}

fn request(quantities: &[Quantity], tolerance: f64, depths: Depths) -> Request {
    Request {
        quantities: quantities.to_vec(),
        masking: MaskingKind::Exact,
        extent: Extent::Tolerance(tolerance),
        depths,
    }
}

/// The largest error found over the tolerance; `None` where no texture keeps it.
fn share(
    material: &Material,
    request: &Request,
    decoder: impl Fn(&Baked) -> Box<dyn Reflectance>,
) -> Option<f64> {
    let tolerance = request.tolerance().expect("asked for");
    let baked = match bake(&[material], request) {
        Ok(baked) => baked,
        Err(BakeError::NotReached { best, .. }) => {
            println!("refused at {tolerance:.2e}: {best:.2e} {material:?}");
            return None;
        }
        Err(other) => panic!("{other}"),
    };
    let exact = exactly(material);
    let found = searched(&exact, &*decoder(&baked), 6);
    let proof = baked.tables.first().and_then(|table| table.error.proof);
    println!("{found:.2e} of {tolerance:.2e} {proof:?}");
    let measured = baked.tables.iter().filter_map(|table| table.error.measured);
    Some(measured.fold(found, f64::max) / tolerance)
}

fn factors(baked: &Baked) -> Box<dyn Reflectance> {
    Box::new(LutBrdf::new(baked, 0, Lookup::Filtered).expect("all three are baked"))
}

fn volume(baked: &Baked) -> Box<dyn Reflectance> {
    Box::new(VolumeBrdf::new(baked, 0).expect("baked"))
}

/// Runs an attack on random materials and prints the largest share of the tolerance met.
fn run(name: &str, cases: u32, attack: impl Fn(&Material, f64) -> Option<f64>) {
    let worst = std::cell::Cell::new((0.0_f64, 0_u32, 0_u32));
    let outcome = runner(cases).run(&(material(), 0.0..1.0), |(material, tightness)| {
        let (largest, kept, refused) = worst.get();
        match attack(&material, tightness) {
            Some(share) => {
                worst.set((largest.max(share), kept + 1, refused));
                prop_assert!(share <= 1.0, "{share} of the tolerance");
            }
            None => worst.set((largest, kept, refused + 1)),
        }
        Ok(())
    });
    let (largest, kept, refused) = worst.get();
    println!("{name}: {kept} kept, {refused} refused, at most {largest:.3} of the tolerance");
    if let Err(failure) = outcome {
        panic!("{failure}");
    }
    // A sharp lobe whose Fresnel curve crosses 0 at the mirror direction needs more texels than
    // there are: it is refused, not broken.
    assert!(refused <= kept, "{name}: {refused} of {kept} could not be baked");
}

/// Every published material in one bake, at tolerances that half floats and that only floats hold.
#[test]
fn the_catalogue_keeps_its_tolerances() {
    let materials: Vec<&Material> = catalog().iter().map(|entry| &entry.material).collect();
    for tolerance in [1e-2, 1e-3, 3e-4] {
        let baked = bake(&materials, &request(&FACTORS, tolerance, Depths::Smallest));
        let baked = baked.expect("within reach");
        let shares = (0..materials.len()).into_par_iter().map(|index| {
            let lut = LutBrdf::new(&baked, index, Lookup::Filtered).expect("all are baked");
            searched(&exactly(materials[index]), &lut, 3) / tolerance
        });
        let largest = shares.reduce(|| 0.0, f64::max);
        let note = baked.tables[0].error;
        println!("catalogue at {tolerance:e}: {largest:.3} of the tolerance, {note:?}");
        assert!(largest <= 1.0 && note.measured.is_some_and(|error| error <= tolerance));
        assert_eq!(note.proof, Some(Proof::Bounded));
    }
}

#[test]
fn random_materials_keep_every_2d_tolerance() {
    run("2d", attacks(24), |material, tightness| {
        let tolerance = 10_f64.powf(-2.0 - 1.7 * tightness);
        share(material, &request(&FACTORS, tolerance, Depths::Smallest), factors)
    });
}

#[test]
fn random_materials_keep_the_tolerance_in_floats() {
    run("2d float", attacks(10), |material, tightness| {
        let tolerance = 10_f64.powf(-2.0 - 2.0 * tightness);
        share(material, &request(&FACTORS, tolerance, Depths::Only(Depth::Float)), factors)
    });
}

#[test]
fn random_materials_keep_a_3d_tolerance() {
    run("3d", attacks(32) / 8, |material, tightness| {
        let tolerance = 10_f64.powf(-1.5 - 0.7 * tightness);
        share(material, &request(&[Quantity::Brdf3d], tolerance, Depths::Smallest), volume)
    });
}

/// Where F is 0 in the mirror direction all that is left to see is dark next to the lobe: the
/// tolerance is kept or refused.
#[test]
fn a_curve_that_changes_sign_is_kept_or_refused() {
    let fields = LobeFields {
        alpha: 2.06e-5,
        p: 0.518,
        masking: None,
        rho_s: [0.81; 3],
        f0: [-0.274; 3],
        f1: [0.0; 3],
    };
    let lobe = LobeParams::new(fields).expect("in range");
    let material = Material::new("odd", [0.004; 3], vec![lobe]).expect("in range");
    for tolerance in [1e-2, 1e-3] {
        let share = share(&material, &request(&FACTORS, tolerance, Depths::Smallest), factors);
        assert!(share.is_none_or(|share| share <= 1.0), "{share:?} at {tolerance}");
    }
}

#[test]
fn the_manifest_s_note_says_what_the_error_rests_on() {
    let material = &sgdbake::material::find("gold-paint").expect("in the catalogue").material;
    let note = |quantities: &[Quantity], masking| -> Vec<Option<Proof>> {
        let wanted = Request { masking, ..request(quantities, 1e-2, Depths::Smallest) };
        let baked = bake(&[material], &wanted).expect("within reach");
        baked.tables.iter().map(|table: &Table| table.error.proof).collect()
    };
    assert_eq!(note(&FACTORS, MaskingKind::Exact), [Some(Proof::Bounded); 3]);
    // The published masking fit has a corner of which no bound is known.
    assert_eq!(note(&FACTORS, MaskingKind::Fitted), [Some(Proof::Sampled); 3]);
    assert_eq!(note(&[Quantity::Brdf3d], MaskingKind::Exact), [Some(Proof::Sampled)]);
}
