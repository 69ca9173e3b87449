//! OBJ files become glTF: written here as text, so that each says what it tests.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::{fs, path::Path};

use serde_json::Value;
use sgdbake::scene::{Scene, SceneError, SlotId};

/// The glTF document and its BIN chunk that an OBJ (and files beside it) becomes.
fn convert(obj: &str, beside: &[(&str, &str)]) -> Result<(Value, Vec<u8>, Scene), SceneError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.obj");
    fs::write(&path, obj).unwrap();
    for (name, text) in beside {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let scene = Scene::open(&path)?;
    let export = scene.export(&[], &folder.path().join("out.glb"))?;
    let mut bytes = Vec::new();
    export.files[0].write_to(&mut bytes).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let json = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    Ok((json, bytes.split_off(28 + length), scene))
}

/// The numbers of an attribute of the first primitive of a mesh.
fn attribute(json: &Value, bin: &[u8], mesh: usize, name: &str) -> Vec<f32> {
    let accessor = &json["meshes"][mesh]["primitives"][0]["attributes"][name];
    let view = &json["bufferViews"]
        [json["accessors"][index(accessor)]["bufferView"].as_u64().unwrap() as usize];
    let start = index(&view["byteOffset"]);
    let bytes = &bin[start..start + index(&view["byteLength"])];
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
}

fn index(value: &Value) -> usize {
    value.as_u64().unwrap() as usize
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn a_polygon_is_a_fan_and_gets_normals() {
    let (json, bin, scene) = convert(&format!("{SQUARE}f -4 -3 -2 -1\n"), &[]).unwrap();
    let [slot] = &scene.slots()[..] else { panic!("one slot") };
    assert_eq!((slot.id, slot.triangles), (SlotId::Unassigned, 2));
    assert_eq!(attribute(&json, &bin, 0, "NORMAL"), [0.0, 0.0, 1.0].repeat(4));
    assert_eq!(json["accessors"][0]["max"].to_string(), "[1.0,1.0,0.0]");
    assert_eq!(json["meshes"][0]["name"], "scene");
}

#[test]
fn smoothing_groups_shape_the_normals() {
    // Two triangles that meet at a right angle along the y axis.
    let roof = "v 0 0 0\nv 0 1 0\nv 1 0 0\nv 0 0 1\n";
    let faces = "f 1 3 2\nf 1 2 4\n";
    let shared = |text: String| {
        let (json, bin, _) = convert(&text, &[]).unwrap();
        attribute(&json, &bin, 0, "NORMAL")
    };
    let smooth = shared(format!("{roof}{faces}"));
    assert_eq!(smooth.len(), 12);
    let half = 0.5f32.sqrt();
    assert!((smooth[0] - half).abs() < 1e-6 && (smooth[2] - half).abs() < 1e-6, "{smooth:?}");
    assert_eq!(shared(format!("{roof}s 1\n{faces}")), smooth);
    let flat = [[0.0, 0.0, 1.0].repeat(3), [1.0, 0.0, 0.0].repeat(3)].concat();
    assert_eq!(shared(format!("{roof}s off\n{faces}")), flat);
    assert_eq!(shared(format!("{roof}s 1\nf 1 3 2\ns 2\nf 1 2 4\n")), flat);
}

#[test]
fn materials_keep_their_names_with_and_without_a_library() {
    let obj = format!(
        "mtllib my lib.mtl\r\nmtllib a.mtl missing.mtl\r\n{SQUARE}o One thing\r\nusemtl red paint\r\nf 1 2 3\r\nusemtl other\r\nf 1 3 4\r\n"
    );
    let libraries =
        [("my lib.mtl", "newmtl red paint\r\nKd 0.5\r\nNs 250\r\n"), ("a.mtl", "newmtl unused\n")];
    let (json, _, scene) = convert(&obj, &libraries).unwrap();
    let names: Vec<_> = scene.slots().iter().map(|slot| (slot.label(), slot.triangles)).collect();
    assert_eq!(names, [("red paint".into(), 1), ("other".into(), 1)]);
    let material = &json["materials"][0]["pbrMetallicRoughness"];
    assert_eq!(material["baseColorFactor"].to_string(), "[0.5,0.5,0.5,1.0]");
    assert_eq!(material["roughnessFactor"].to_string(), "0.5");
    assert_eq!(json["meshes"][0]["name"], "One thing");
    assert_eq!(json["meshes"][0]["primitives"].as_array().unwrap().len(), 2);
    assert_eq!(
        scene.warnings(),
        [
            "material library \"missing.mtl\" is not there",
            "material \"other\" is in no material library: it is plain",
        ]
    );
}

#[test]
fn colours_and_texture_coordinates_are_converted() {
    let obj = "v 0 0 0 0.5 1 0\nv 1 0 0\nv 0 1 0 0 0 0\nvt 0.25 0.25\nf 1/1 2/1 3/1\n";
    let (json, bin, _) = convert(obj, &[]).unwrap();
    let colors = attribute(&json, &bin, 0, "COLOR_0");
    // sRGB 0.5 is linear ((0.5 + 0.055)/1.055)^2.4.
    assert!((colors[0] - 0.214_041_14).abs() < 1e-6, "{colors:?}");
    assert_eq!(colors[1..6], [1.0, 0.0, 1.0, 1.0, 1.0]);
    assert_eq!(attribute(&json, &bin, 0, "TEXCOORD_0")[..2], [0.25, 0.75]);
}

#[test]
fn textures_of_a_library_are_embedded_or_warned_of() {
    let mtl = "newmtl m\nmap_Kd -s 1 1 1 -clamp on a b.png\nmap_Ke gone.png\nKe 1 1 1\n";
    let obj = format!("mtllib m.mtl\n{SQUARE}usemtl m\nf 1 2 3\n");
    let (json, bin, scene) =
        convert(&obj, &[("m.mtl", mtl), ("a b.png", "not really PNG")]).unwrap();
    assert_eq!(json["images"][0]["mimeType"], "image/png");
    assert!(bin.windows(14).any(|window| window == b"not really PNG"));
    assert_eq!(scene.warnings(), ["texture \"gone.png\" is not there"]);
}

#[test]
fn an_emissive_texture_without_a_colour_shines() {
    let mtl = "newmtl m\nmap_Ke -imfchan l e.png\nnewmtl black\nKe 0 0 0\nmap_Ke e.png\n\
               newmtl red\nKe 1 0 0\nmap_Ke e.png\nnewmtl dark\nKe 0 0 0\nmap_Ke gone.png\n";
    let faces: String =
        ["m", "black", "red", "dark"].map(|m| format!("usemtl {m}\nf 1 2 3\n")).concat();
    let obj = format!("mtllib m.mtl\n{SQUARE}{faces}");
    let (json, ..) = convert(&obj, &[("m.mtl", mtl), ("e.png", "not really PNG")]).unwrap();
    for (index, factor) in [(0, "[1.0,1.0,1.0]"), (1, "[1.0,1.0,1.0]"), (2, "[1.0,0.0,0.0]")] {
        let material = &json["materials"][index];
        assert_eq!(material["emissiveTexture"].to_string(), r#"{"index":0}"#, "{material}");
        assert_eq!(material["emissiveFactor"].to_string(), factor);
    }
    assert!(json["materials"][3].get("emissiveFactor").is_none());
}

#[test]
fn materials_that_no_face_uses_are_left_out() {
    let obj =
        format!("{SQUARE}usemtl unused\nusemtl used\nf 1 2 3\nusemtl point\np 1\nusemtl last\n");
    let (json, _, scene) = convert(&obj, &[]).unwrap();
    assert_eq!(json["materials"].as_array().unwrap().len(), 1);
    assert_eq!((scene.slots()[0].label(), scene.slots()[0].triangles), ("used".into(), 1));
}

#[test]
fn damaged_files_name_their_line() {
    for (text, line) in [
        ("v 0 0 0\nf 1 2 3\n", "line 2"),
        ("v 0 0 0\nf -1 -2 -1\n", "line 2"),
        ("v 0 0\n", "line 1"),
        ("v 0 0 0\n\nf 1 1 99999999999999999999\n", "line 3"),
        ("v 0 0 0\nvt 0 0\nf 1/-1 1/-1 1/-2\n", "line 3"),
        ("v nan 0 0\nf 1 1 1\n", "not finite"),
        ("mtllib ../m.mtl\n", "leaves the scene's folder"),
        ("mtllib http://host/m.mtl\n", "network address"),
    ] {
        let message = convert(text, &[]).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains(line), "{text:?}: {message}");
    }
    assert!(matches!(Scene::open(Path::new("no.obj")), Err(SceneError::Io(_))));
}
