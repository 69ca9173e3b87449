//! Damaged measurement files, each with a clear error.

use std::fs;

use sgdbake::measurement::{Format, Measurement};

use crate::{Matte, merl_bytes, offset, put, read, refused};

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
    assert!(refused(&small).contains("10 × 10 × 20 cells; sgdbake reads 90 × 90 × 180"));
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
    assert!(refused(&version).contains("version 2.0; sgdbake reads 1.0"));
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
