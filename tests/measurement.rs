//! Measurement files: read, written and read again; values against the exact reflectance they were
//! made of; damaged files, each with a clear error.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

mod common;

use std::f64::consts::{FRAC_1_PI, PI, TAU};
use std::fs;
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
fn damaged_merl_files_are_refused() {
    let whole = merl_bytes(&Matte);
    let cut = refused(&whole[..whole.len() - 1]);
    assert_eq!(
        cut,
        "34992011 bytes long, where its header needs 34992012: truncated, or not a whole copy"
    );
    assert!(refused(&[&whole[..], b"x"].concat()).contains("34992013 bytes long"));
    assert!(refused(&whole[..12]).contains("12 bytes long"));
    let mut swapped = whole.clone();
    swapped[..12].copy_from_slice(&[0, 0, 0, 90, 0, 0, 0, 90, 0, 0, 0, 180]);
    assert!(refused(&swapped).contains("big-endian"));
    let mut small = Vec::new();
    [10_u32, 10, 20].iter().for_each(|n| small.extend(n.to_le_bytes()));
    small.resize(12 + 24 * 2000, 0);
    assert!(refused(&small).contains("10 × 10 × 20 cells; readable are 90 × 90 × 180"));
    for (value, shown) in [(f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        let mut bytes = whole.clone();
        put(&mut bytes, offset(2, [3, 4, 5]), value);
        assert!(refused(&bytes).contains(&format!("blue at θh 3, θd 4, φd 5 is {shown}")));
    }
    let mut nothing = whole;
    nothing[12..]
        .chunks_exact_mut(8)
        .for_each(|cell| cell.copy_from_slice(&(-1.0_f64).to_le_bytes()));
    assert!(refused(&nothing).contains("no measured value"));
}

/// A field of a tensor file: name, shape, type (1 = u8, 10 = f32), bytes.
type Field = (&'static str, Vec<u64>, u8, Vec<u8>);

fn floats(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_le_bytes).collect()
}

/// The smallest RGL file.
fn fields() -> Vec<Field> {
    vec![
        ("description", vec![4], 1, b"tiny".to_vec()),
        ("jacobian", vec![1], 1, vec![1]),
        ("phi_i", vec![1], 10, floats([0.0])),
        ("theta_i", vec![2], 10, floats([0.0, 1.5])),
        ("ndf", vec![2, 2], 10, floats([1.0; 4])),
        ("sigma", vec![2, 2], 10, floats([1.0; 4])),
        ("vndf", vec![1, 2, 2, 2], 10, floats([1.0; 8])),
        ("luminance", vec![1, 2, 2, 2], 10, floats([1.0; 8])),
        ("rgb", vec![1, 2, 3, 2, 2], 10, floats([0.5; 24])),
    ]
}

fn tensor_file(fields: &[Field]) -> Vec<u8> {
    let mut bytes = b"tensor_file\0\x01\0".to_vec();
    bytes.extend((fields.len() as u32).to_le_bytes());
    let entry = |field: &Field| 2 + field.0.len() + 2 + 1 + 8 + 8 * field.1.len();
    let mut offset = bytes.len() + fields.iter().map(entry).sum::<usize>();
    for (name, shape, kind, data) in fields {
        bytes.extend((name.len() as u16).to_le_bytes());
        bytes.extend(name.bytes());
        bytes.extend((shape.len() as u16).to_le_bytes());
        bytes.push(*kind);
        bytes.extend((offset as u64).to_le_bytes());
        shape.iter().for_each(|size| bytes.extend(size.to_le_bytes()));
        offset += data.len();
    }
    fields.iter().for_each(|field| bytes.extend(&field.3));
    bytes
}

/// The smallest file with one field changed.
fn changed(name: &str, change: impl Fn(&mut Field)) -> Vec<u8> {
    let mut fields = fields();
    fields.iter_mut().filter(|field| field.0 == name).for_each(change);
    tensor_file(&fields)
}

#[test]
fn damaged_rgl_files_are_refused() {
    let whole = tensor_file(&fields());
    assert!(read(&whole).is_ok());
    for end in 12..whole.len() {
        let message = refused(&whole[..end]);
        assert!(message.contains("not a valid tensor file"), "cut at {end}: {message}");
    }
    let mut version = whole.clone();
    version[12] = 2;
    assert!(refused(&version).contains("version 2.0; readable is 1.0"));
    let mut many = whole.clone();
    many[14..18].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(refused(&many).contains("number of fields is 4294967295"));
    for missing in 0..9 {
        let mut fields = fields();
        let (name, ..) = fields.remove(missing);
        assert!(refused(&tensor_file(&fields)).contains(&format!("'{name}' is missing")));
    }
    let mut spectral = fields();
    spectral.push(("wavelengths", vec![1], 10, floats([500.0])));
    assert!(refused(&tensor_file(&spectral)).contains("spectral"));
    let anisotropic = changed("phi_i", |field| {
        (field.1, field.3) = (vec![4], floats([0.0, 0.5, 1.0, 1.5]));
    });
    assert!(refused(&anisotropic).contains("anisotropic RGL file (4 azimuths"));
    // Sizes whose product overflows, and data beyond the end.
    for size in [u64::MAX, 1 << 62, 1 << 40] {
        let message = refused(&changed("rgb", |field| field.1[2] = size));
        assert!(message.contains("'rgb' reaches beyond the end"), "{message}");
    }
    for (name, value, message) in [
        ("rgb", f32::NAN, "'rgb' holds NaN at 0"),
        ("ndf", -1.0, "'ndf' holds -1 at 0"),
        ("sigma", 0.0, "'sigma' holds 0 at 0; needed is a positive number"),
        ("vndf", f32::INFINITY, "'vndf' holds inf at 0"),
        ("theta_i", 2.0, "ascending"),
    ] {
        let found =
            refused(&changed(name, |field| field.3[..4].copy_from_slice(&value.to_le_bytes())));
        assert!(found.contains(message), "{found}");
    }
    let black = changed("vndf", |field| field.3.fill(0));
    assert!(refused(&black).contains("'vndf' holds 0"));
    let line = changed("ndf", |field| field.1 = vec![1, 4]);
    assert!(refused(&line).contains("'ndf' is tables of 1 × 4"));
    let double = changed("sigma", |field| field.2 = 11);
    assert!(refused(&double).contains("'sigma' is type 11"));
}

/// Fields that share their bytes could ask for far more memory than the file has.
#[test]
fn overlapping_fields_do_not_fill_the_memory() {
    let mut fields = fields();
    let size = 512_u64;
    for (name, shape) in [("ndf", vec![size, size]), ("sigma", vec![size, size])] {
        let field = fields.iter_mut().find(|field| field.0 == name).unwrap();
        field.1 = shape;
    }
    let data = floats(vec![1.0; (size * size) as usize]);
    fields.iter_mut().find(|field| field.0 == "rgb").unwrap().3.extend(&data);
    let mut bytes = tensor_file(&fields);
    // All data from the start of the file: offsets stand after each name and its two numbers.
    let place = bytes.windows(3).position(|w| w == b"ndf").unwrap() + 3 + 3;
    bytes[place..place + 8].copy_from_slice(&0_u64.to_le_bytes());
    assert!(read(&bytes).is_err());
}

#[test]
fn damaged_tables_are_refused_with_their_line() {
    let head = "theta_i,phi_i,theta_o,phi_o,r,g,b\n10,0,20,90,0.1,0.2,0.3\n";
    assert!(read(head.as_bytes()).is_ok());
    for (row, message) in [
        ("10,0,20,90,0.1,0.2", "line 3: 6 columns, where the header has 7"),
        ("10,0,20,90,0.1,x,0.3", "line 3: g is 'x'; a finite number is needed"),
        ("10,0,20,90,0.1,,0.3", "line 3: g is ''"),
        ("10,0,20,90,0.1,NaN,0.3", "line 3: g is 'NaN'"),
        ("10,0,20,90,0.1,0.2,1e300", "line 3: b is '1e300'"),
        ("10,0,20,90,-0.1,0.2,0.3", "line 3: r is -0.1; a reflectance is at least 0"),
        ("90,0,20,90,0.1,0.2,0.3", "line 3: wi does not point above the surface"),
        ("10,0,-95,90,0.1,0.2,0.3", "line 3: wo does not point above the surface"),
    ] {
        let found = refused(format!("{head}{row}\n").as_bytes());
        assert!(found.starts_with(message), "{found}");
    }
    let zero = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z,r,g,b\n0,0,0,0,0,1,1,1,1\n";
    assert!(refused(zero.as_bytes()).contains("line 2: wi does not point"));
    assert!(refused(b"theta_i,phi_i,theta_o,r,g,b\n1,2,3,4,5,6\n").contains("the header"));
    assert!(refused(b"theta_i,phi_i,theta_o,phi_o,r,g,b\n").contains("no measured value"));
    assert!(
        read(
            "\u{feff}# by us\nr, g, b, theta_i, phi_i, theta_o, phi_o\n1,1,1,-30,0,60,180\n"
                .as_bytes()
        )
        .is_ok()
    );
}

#[test]
fn what_is_no_measurement_says_so_whatever_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gold.binary");
    for (content, message) in [
        (&b""[..], "the file is empty"),
        (b"Dear reader,\nthis is a letter.\n", "text whose first line is not the header"),
        (b"once upon a time", "text whose first line is not the header"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "not a measurement"),
        (b"\x01\x02", "not a measurement"),
    ] {
        fs::write(&path, content).unwrap();
        let error = Measurement::read(&path).unwrap_err().to_string();
        assert!(error.starts_with(&path.display().to_string()), "{error}");
        assert!(error.contains(message), "{error}");
    }
    // The content decides.
    fs::write(&path, "theta_i,phi_i,theta_o,phi_o,r,g,b\n10,0,20,90,0.1,0.2,0.3\n").unwrap();
    assert_eq!(Measurement::read(&path).unwrap().format(), Format::Csv);
    let absent = Measurement::read(&folder.path().join("no.csv")).unwrap_err().to_string();
    assert!(absent.contains("cannot be read"), "{absent}");
    assert!(Measurement::read(folder.path()).is_err());
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
