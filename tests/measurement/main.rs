//! Measurement files: read, written and read again; values against the exact reflectance they were
//! made of.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

#[path = "../common/mod.rs"]
mod common;
mod damaged;

use std::f64::consts::{FRAC_1_PI, PI, TAU};
use std::io::Cursor;

use glam::DVec3;
use sgdbake::brdf::MaskingKind;
use sgdbake::brdf::{Reflectance, SgdBrdf};
use sgdbake::material::find;
use sgdbake::math::direction::spherical;
use sgdbake::measurement::deviation::Deviation;
use sgdbake::measurement::symmetry::{Spread, symmetric_pairs};
use sgdbake::measurement::{Filled, Format, HalfDifference, Measurement, Merl, Rgl, merl};

fn sgd(name: &str) -> SgdBrdf {
    SgdBrdf::new(&find(name).unwrap().material, MaskingKind::Fitted)
}

fn read(bytes: &[u8]) -> Result<Measurement, String> {
    Measurement::from_reader(&mut Cursor::new(bytes), bytes.len() as u64)
        .map_err(|problem| problem.to_string())
}

fn refused(bytes: &[u8]) -> String {
    read(bytes).expect_err("must be refused")
}

fn merl_bytes(reflectance: &dyn Reflectance) -> Vec<u8> {
    let mut bytes = Vec::new();
    Merl::tabulate(reflectance, &|| {}).write_to(&mut bytes).unwrap();
    bytes
}

fn rgl_bytes(reflectance: &dyn Reflectance) -> Vec<u8> {
    let mut bytes = Vec::new();
    Rgl::tabulate(reflectance, "a test".into(), &|| {}).write_to(&mut bytes).unwrap();
    bytes
}

/// Reflects evenly, more of red than of blue.
struct Matte;

const MATTE: [f64; 3] = [0.6 * FRAC_1_PI, 0.4 * FRAC_1_PI, 0.2 * FRAC_1_PI];

impl Reflectance for Matte {
    fn eval(&self, _: DVec3, _: DVec3) -> [f64; 3] {
        MATTE
    }
}

/// Where a file keeps the value of a colour at a cell.
fn offset(colour: usize, [theta_h, theta_d, phi_d]: [usize; 3]) -> usize {
    12 + 8 * (colour * 1_458_000 + phi_d + 180 * (theta_d + 90 * theta_h))
}

fn put(bytes: &mut [u8], at: usize, value: f64) {
    bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
}

#[test]
fn a_merl_file_is_laid_out_as_documented_and_comes_back_equal() {
    let brdf = sgd("gold-paint");
    let bytes = merl_bytes(&brdf);
    assert_eq!(bytes.len() as u64, merl::FILE_BYTES);
    let cell = [30, 20, 100];
    let [theta_h, theta_d, phi_d] = [10.0_f64, 20.0, 100.0].map(f64::to_radians);
    let [wi, wo] = HalfDifference { theta_h, theta_d, phi_d }.directions();
    for (colour, scale) in [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0].into_iter().enumerate() {
        let at = offset(colour, cell);
        let stored = f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        assert!((stored * scale / brdf.eval(wi, wo)[colour] - 1.0).abs() < 1e-12);
    }
    let measurement = read(&bytes).unwrap();
    assert_eq!(measurement.format(), Format::Merl);
    let Measurement::Merl(again) = &measurement else { panic!("a MERL file") };
    let mut written = Vec::new();
    again.write_to(&mut written).unwrap();
    assert!(written == bytes, "read and written again it is the same file");
    // A cell's own angles give its own value, and a table of the table is the same table.
    let sample = measurement.samples().nth(200_000).unwrap();
    let value = measurement.eval(sample.wi, sample.wo);
    assert!((value[1] / sample.f[1] - 1.0).abs() < 1e-9);
}

#[test]
fn an_rgl_file_comes_back_equal() {
    let brdf = sgd("alum-bronze");
    let bytes = rgl_bytes(&brdf);
    let Measurement::Rgl(rgl) = read(&bytes).unwrap() else { panic!("an RGL file") };
    let mut written = Vec::new();
    rgl.write_to(&mut written).unwrap();
    assert!(written == bytes);
    assert_eq!(*rgl, Rgl::tabulate(&brdf, "a test".into(), &|| {}));
}

/// The largest median and 95th percentile of the relative error between the nodes; see
/// docs/measurement-formats.md for those of more materials.
#[test]
fn values_between_the_nodes_are_near_the_exact_ones() {
    for (name, merl, rgl) in [
        ("gold-paint", [0.0005, 0.005], [0.001, 0.01]),
        ("pink-fabric", [0.0001, 0.003], [0.001, 0.01]),
        ("white-paint", [0.0005, 0.01], [0.003, 0.02]),
        ("gold-metallic-paint2", [0.0015, 0.03], [0.003, 0.03]),
    ] {
        let brdf = sgd(name);
        for (bytes, [median, most]) in [(merl_bytes(&brdf), merl), (rgl_bytes(&brdf), rgl)] {
            let found = Deviation::of(&read(&bytes).unwrap(), &brdf).unwrap();
            assert!(found.median < median && found.percentile_95 < most, "{name}: {found:?}");
            assert!(found.largest > 0.0 && found.pairs > 10_000);
        }
    }
}

#[test]
fn solid_angles_sum_to_both_hemispheres() {
    let whole = TAU * TAU;
    let sum = |m: &Measurement| m.samples().map(|sample| sample.weight).sum::<f64>();
    let merl = read(&merl_bytes(&Matte)).unwrap();
    assert!((sum(&merl) / whole - 1.0).abs() < 0.02, "{}", sum(&merl) / whole);
    let rgl = read(&rgl_bytes(&Matte)).unwrap();
    assert!((sum(&rgl) / whole - 1.0).abs() < 0.02, "{}", sum(&rgl) / whole);
}

#[test]
fn matte_is_matte_in_every_format() {
    let rows: String = grid().map(|row| format!("{row},0.3,0.2,0.1\n")).collect();
    let csv = format!("theta_i,phi_i,theta_o,phi_o,r,g,b\n{rows}");
    for (bytes, expected) in [
        (merl_bytes(&Matte), MATTE),
        (rgl_bytes(&Matte), MATTE),
        (csv.into_bytes(), [0.3, 0.2, 0.1]),
    ] {
        let measurement = read(&bytes).unwrap();
        for (theta_i, theta_o, phi) in [(0.3, 0.5, 2.0), (1.2, 0.1, 0.0), (0.8, 0.8, 3.1)] {
            let f = measurement.eval(spherical(theta_i, 0.4), spherical(theta_o, 0.4 + phi));
            for (found, expected) in f.into_iter().zip(expected) {
                assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
            }
        }
        assert_eq!(measurement.eval(DVec3::Z, -DVec3::Z), [0.0; 3], "nothing from below");
    }
}

/// `theta_i,phi_i,theta_o,phi_o` in degrees, every 5 and 15 degrees.
fn grid() -> impl Iterator<Item = String> {
    (0..17).flat_map(|i| {
        (0..17).flat_map(move |o| (0..24).map(move |p| format!("{},0,{},{}", 5 * i, 5 * o, 15 * p)))
    })
}

#[test]
fn dense_samples_of_a_table_give_the_reflectance_between_them() {
    let brdf = sgd("pink-fabric");
    let mut csv = String::from("wi_x\twi_y\twi_z\two_x\two_y\two_z\tr\tg\tb\n");
    for row in grid() {
        let angles: Vec<f64> =
            row.split(',').map(|n| n.parse::<f64>().unwrap().to_radians()).collect();
        let (wi, wo) = (spherical(angles[0], angles[1]), spherical(angles[2], angles[3]));
        let [r, g, b] = brdf.eval(wi, wo);
        csv +=
            &format!("{}\t{}\t{}\t{}\t{}\t{}\t{r}\t{g}\t{b}\n", wi.x, wi.y, wi.z, wo.x, wo.y, wo.z);
    }
    let measurement = read(csv.as_bytes()).unwrap();
    let error = Deviation::of(&measurement, &brdf).unwrap();
    println!("a table of samples: {error:?}");
    assert!(error.median < 0.02 && error.percentile_95 < 0.1, "{error:?}");
    assert_eq!(measurement.samples().count(), grid().count());
}

#[test]
fn far_from_every_sample_nothing_is_known() {
    let csv =
        "theta_i,phi_i,theta_o,phi_o,r,g,b\n10,0,20,180,0.1,0.2,0.3\n11,0,20,180,0.1,0.2,0.3\n";
    let measurement = read(csv.as_bytes()).unwrap();
    let at = |theta_i: f64, theta_o: f64| {
        measurement.eval(spherical(theta_i.to_radians(), 0.0), spherical(theta_o.to_radians(), PI))
    };
    assert!((at(10.0, 20.0)[1] - 0.2).abs() < 1e-6);
    assert!((at(10.5, 20.0)[1] - 0.2).abs() < 1e-6);
    assert!(at(60.0, 0.0)[1].is_nan());
    assert_eq!(Filled(&measurement).eval(DVec3::Z, spherical(1.5, 0.0)), [0.0; 3], "no neighbour");
}

#[test]
fn cells_without_a_measurement_are_not_interpolated_into() {
    let mut bytes = merl_bytes(&Matte);
    for theta_d in 50..90 {
        for phi_d in 0..180 {
            put(&mut bytes, offset(1, [10, theta_d, phi_d]), -1.0);
            put(&mut bytes, offset(1, [11, theta_d, phi_d]), -7.5);
        }
    }
    let measurement = read(&bytes).unwrap();
    let theta_h = (10.5_f64 / 90.0).powi(2) * 90.0_f64.to_radians();
    let at = |theta_d: f64| {
        let [wi, wo] =
            HalfDifference { theta_h, theta_d: theta_d.to_radians(), phi_d: 1.0 }.directions();
        (measurement.eval(wi, wo), Filled(&measurement).eval(wi, wo))
    };
    assert!(at(60.0).0.iter().all(|f| f.is_nan()), "in all colours");
    assert!((at(49.3).0[1] / MATTE[1] - 1.0).abs() < 1e-12, "mostly measured");
    assert!((at(60.0).1[1] / MATTE[1] - 1.0).abs() < 1e-12, "filled from smaller θd");
    let mut written = Vec::new();
    let Measurement::Merl(table) = &measurement else { panic!("a MERL file") };
    table.write_to(&mut written).unwrap();
    assert!(written == bytes, "invalid cells are written as they were");
}

/// Reflects more to one side: neither isotropic nor reciprocal.
struct Lopsided;

impl Reflectance for Lopsided {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        [0.2 + 0.1 * wi.x * wo.y + 0.05 * wi.z; 3]
    }
}

#[test]
fn the_average_has_the_symmetries_and_the_spread_shows_their_lack() {
    let (wi, wo) = (spherical(0.7, 0.2), spherical(0.4, 1.9));
    let exact = Spread::of(&sgd("gold-paint"), wi, wo);
    assert!(exact.relative.unwrap() < 1e-12);
    let spread = Spread::of(&Lopsided, wi, wo);
    assert!(spread.relative.unwrap() > 0.01);
    for [wi, wo] in symmetric_pairs(wi, wo) {
        let again = Spread::of(&Lopsided, wi, wo).mean;
        assert!((again[0] - spread.mean[0]).abs() < 1e-15);
    }
    let angles = symmetric_pairs(wi, wo).map(|[wi, wo]| HalfDifference::of(wi, wo));
    for other in angles {
        assert!((other.theta_h - angles[0].theta_h).abs() < 1e-12);
        assert!((other.theta_d - angles[0].theta_d).abs() < 1e-12);
        assert!((other.phi_d.cos().abs() - angles[0].phi_d.cos().abs()).abs() < 1e-12);
    }
}

#[test]
fn a_network_tabulated_is_the_network() {
    let Some(networks) = common::network::all() else { return };
    let (name, network) = networks.first_key_value().unwrap();
    let merl = Measurement::Merl(Merl::tabulate(network, &|| {}));
    let error = Deviation::of(&merl, network).unwrap();
    println!("{name} as MERL cells: {error:?}");
    assert!(error.median < 0.005 && error.percentile_95 < 0.05, "{error:?}");
}

/// Reflects as another, 5 % of each pair's value off it at random.
struct Noisy(SgdBrdf);

impl Reflectance for Noisy {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        // Decimals of a fast oscillation: even in [0, 1), and unlike for any two pairs.
        let random = ((wi.x * 12.9898 + wi.y * 78.233 + wo.x * 37.719 + wo.y * 4.581).sin()
            * 43_758.545)
            .fract();
        self.0.eval(wi, wo).map(|f| f * (1.0 + 0.05 * 3.0_f64.sqrt() * random))
    }
}

#[test]
fn the_noise_of_a_measurement_is_found_and_averaged() {
    let exact = sgd("pink-fabric");
    let merl = read(&merl_bytes(&Noisy(exact.clone()))).unwrap();
    let (mut spreads, mut raw, mut averaged) = (Vec::new(), 0.0, 0.0);
    for sample in merl.samples().step_by(401) {
        let spread = Spread::of(&merl, sample.wi, sample.wo);
        let f = exact.eval(sample.wi, sample.wo)[1];
        spreads.extend(spread.relative);
        raw += (sample.f[1] / f - 1.0).powi(2);
        averaged += (merl.averaged().eval(sample.wi, sample.wo)[1] / f - 1.0).powi(2);
    }
    let count = spreads.len() as f64;
    let rms = (spreads.iter().map(|spread| spread * spread).sum::<f64>() / count).sqrt();
    assert!((rms - 0.05).abs() < 0.005, "{rms}");
    // φd and φd + π are one cell: two independent values are averaged.
    let gain = (averaged / raw).sqrt();
    assert!((gain - 0.5_f64.sqrt()).abs() < 0.05, "{gain}");
}
