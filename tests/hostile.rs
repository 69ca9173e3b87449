//! Damaged and malicious scenes and textures: a clear error, never a panic, nothing allocated by a claim.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::{fs, path::Path};

use serde_json::{Value, json};
use sgdbake::encode::{EntryError, Format, encode, read_entry};
use sgdbake::lut::{Depth, Depths, Extent, Quantity, Request, bake};
use sgdbake::material::find;
use sgdbake::scene::{Scene, SceneError};

/// A .glb of any chunks, with any claimed length.
fn glb(chunks: &[(&[u8; 4], &[u8])], claimed: impl Fn(usize) -> usize) -> Vec<u8> {
    let mut body = Vec::new();
    for (kind, content) in chunks {
        body.extend((content.len() as u32).to_le_bytes());
        body.extend(*kind);
        body.extend(*content);
    }
    let length = claimed(12 + body.len()) as u32;
    [&b"glTF"[..], &2u32.to_le_bytes(), &length.to_le_bytes(), &body].concat()
}

fn open(name: &str, bytes: &[u8]) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    Scene::open(&path)
}

/// A valid document with every kind of reference in it, and its buffer.
fn document() -> (Value, Vec<u8>) {
    let document = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1]}, {"mesh": 0, "skin": 0, "camera": 0}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
        "skins": [{"joints": [0], "inverseBindMatrices": 2}],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": 0}, "indices": 1, "material": 0, "targets": [{"POSITION": 0}],
            "extensions": {"KHR_materials_variants": {"mappings": [{"material": 0, "variants": [0]}]}},
        }]}],
        "materials": [{"name": "m"}],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{}],
        "images": [{"bufferView": 0, "mimeType": "image/png"}],
        "animations": [{"samplers": [{"input": 1, "output": 0}], "channels": []}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR",
             "sparse": {"count": 1, "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 1}}},
            {"bufferView": 2, "componentType": 5126, "count": 1, "type": "MAT4"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 8},
            {"buffer": 0, "byteOffset": 44, "byteLength": 64},
        ],
        "buffers": [{"byteLength": 108}],
    });
    (document, vec![0; 108])
}

fn open_document(document: &Value, bin: &[u8]) -> Result<Scene, SceneError> {
    open("a.glb", &glb(&[(b"JSON", document.to_string().as_bytes()), (b"BIN\0", bin)], |n| n))
}

#[test]
fn containers_that_lie_about_their_lengths_are_refused() {
    let json = br#"{"asset":{"version":"2.0"}}     "#;
    assert!(open("a.glb", &glb(&[(b"JSON", json)], |n| n)).is_ok());
    let whole = glb(&[(b"JSON", json), (b"BIN\0", &[0; 8])], |n| n);
    for end in 0..whole.len() {
        assert!(open("a.glb", &whole[..end]).is_err(), "cut at {end}");
    }
    assert!(open("a.glb", &glb(&[(b"JSON", json)], |n| n + 4)).is_err());
    assert!(open("a.glb", &glb(&[(b"JSON", json)], |n| n - 4)).is_err());
    assert!(open("a.glb", &glb(&[(b"BIN\0", json)], |n| n)).is_err());
    let mut gigabyte = whole.clone();
    gigabyte[12..16].copy_from_slice(&0x4000_0000u32.to_le_bytes());
    assert!(matches!(open("a.glb", &gigabyte), Err(SceneError::Glb(_))));
}

#[test]
fn every_reference_is_checked() {
    let (valid, bin) = document();
    open_document(&valid, &bin).unwrap();
    for pointer in [
        "/scene",
        "/scenes/0/nodes/0",
        "/nodes/0/children/0",
        "/nodes/1/mesh",
        "/nodes/1/skin",
        "/nodes/1/camera",
        "/skins/0/joints/0",
        "/skins/0/inverseBindMatrices",
        "/meshes/0/primitives/0/attributes/POSITION",
        "/meshes/0/primitives/0/indices",
        "/meshes/0/primitives/0/material",
        "/meshes/0/primitives/0/targets/0/POSITION",
        "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings/0/material",
        "/textures/0/source",
        "/textures/0/sampler",
        "/images/0/bufferView",
        "/animations/0/samplers/0/input",
        "/animations/0/samplers/0/output",
        "/accessors/0/bufferView",
        "/accessors/0/count",
        "/accessors/1/sparse/count",
        "/accessors/1/sparse/indices/bufferView",
        "/accessors/1/sparse/values/bufferView",
        "/bufferViews/0/buffer",
        "/bufferViews/0/byteLength",
        "/buffers/0/byteLength",
    ] {
        for bad in
            [json!(1_000_000), json!(u64::MAX), json!(-1), json!(0.5), json!("x"), json!(1e300)]
        {
            let mut broken = valid.clone();
            *broken.pointer_mut(pointer).expect("the document has it") = bad.clone();
            assert!(open_document(&broken, &bin).is_err(), "{pointer} = {bad}");
        }
    }
    for offset in
        ["/accessors/0/byteOffset", "/bufferViews/1/byteOffset", "/bufferViews/0/byteStride"]
    {
        let mut broken = valid.clone();
        let (parent, key) = offset.rsplit_once('/').unwrap();
        broken.pointer_mut(parent).unwrap()[key] = json!(u64::MAX);
        assert!(open_document(&broken, &bin).is_err(), "{offset}");
    }
}

#[test]
fn cyclic_nodes_are_refused() {
    let (mut document, bin) = document();
    document["nodes"][1]["children"] = json!([0]);
    let message = open_document(&document, &bin).unwrap_err().to_string();
    assert_eq!(message, "not a valid glTF: nodes[0]: is on or below a cycle of nodes");
}

/// A chain of nodes that list their child twice would be drawn 2ⁿ times.
#[test]
fn nodes_that_form_no_trees_are_refused() {
    let refusal = |nodes: Value, roots: Value| {
        let document =
            json!({"asset": {"version": "2.0"}, "nodes": nodes, "scenes": [{"nodes": roots}]});
        open("a.gltf", document.to_string().as_bytes()).unwrap_err().to_string()
    };
    let chain: Vec<Value> = (1..=26).map(|next| json!({"children": [next, next]})).collect();
    let doubling = Value::Array([chain, vec![json!({})]].concat());
    let expected = "nodes[0].children: lists nodes[1] twice; a node lists each child once";
    assert_eq!(refusal(doubling, json!([0])), format!("not a valid glTF: {expected}"));
    let diamond = json!([{"children": [1, 2]}, {"children": [3]}, {"children": [3]}, {}]);
    let expected = "nodes[2].children: lists nodes[3], a child of nodes[1] too; \
                    a node has at most one parent";
    assert_eq!(refusal(diamond, json!([0])), format!("not a valid glTF: {expected}"));
    let pair = json!([{"children": [1]}, {}]);
    let expected = "scenes[0].nodes: lists nodes[1], a child of nodes[0]; a scene lists root nodes";
    assert_eq!(refusal(pair.clone(), json!([0, 1])), format!("not a valid glTF: {expected}"));
    let expected = "scenes[0].nodes: lists nodes[0] twice; a scene lists each root once";
    assert_eq!(refusal(pair, json!([0, 0])), format!("not a valid glTF: {expected}"));
}

#[test]
fn deep_json_passes_through_where_it_is_not_read_and_is_an_error_where_it_is() {
    let depth = 100_000;
    let nest = "[".repeat(depth) + &"]".repeat(depth);
    let extras = format!(r#"{{"asset":{{"version":"2.0"}},"extras":{nest}}}"#);
    assert!(open("a.gltf", extras.as_bytes()).is_ok());
    assert!(open("a.gltf", format!(r#"{{"nodes":{nest}}}"#).as_bytes()).is_err());
    assert!(open("a.gltf", "{\"a\":".repeat(depth).as_bytes()).is_err());
}

#[test]
fn what_is_no_json_is_refused() {
    for text in
        ["", "{", "[]", "null", r#"{"buffers":[NaN]}"#, r#"{"buffers":{}}"#, "{}x", "\u{feff}{}"]
    {
        assert!(open("a.gltf", text.as_bytes()).is_err(), "{text}");
    }
    assert!(matches!(open("a.gltf", b"{\"a\":\"\xff\"}"), Err(SceneError::Utf8)));
}

#[test]
fn addresses_that_leave_the_folder_are_refused() {
    for uri in ["../a.bin", "/etc/passwd", "%2e%2e/a", "C:\\a", "http://x/a", "a/../../b"] {
        for key in ["buffers", "images"] {
            let document = json!({key: [{"uri": uri, "byteLength": 1}]});
            let result = open("a.gltf", document.to_string().as_bytes());
            assert!(matches!(result, Err(SceneError::Uri { .. })), "{key} {uri}");
        }
    }
}

#[cfg(unix)]
#[test]
fn links_out_of_the_folder_are_not_followed() {
    let folder = tempfile::tempdir().unwrap();
    let inside = folder.path().join("inside");
    fs::create_dir(&inside).unwrap();
    fs::write(folder.path().join("secret.bin"), [0; 4]).unwrap();
    std::os::unix::fs::symlink("../secret.bin", inside.join("a.bin")).unwrap();
    std::os::unix::fs::symlink(folder.path(), inside.join("up")).unwrap();
    for uri in ["a.bin", "up/secret.bin"] {
        let path = inside.join("a.gltf");
        fs::write(&path, json!({"buffers": [{"uri": uri, "byteLength": 4}]}).to_string()).unwrap();
        assert!(matches!(Scene::open(&path), Err(SceneError::Uri { .. })), "{uri}");
    }
}

#[test]
fn short_buffer_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.bin"), [0; 4]).unwrap();
    let path = folder.path().join("a.gltf");
    let open = |length: usize, uri: &str| {
        fs::write(&path, json!({"buffers": [{"uri": uri, "byteLength": length}]}).to_string())
            .unwrap();
        Scene::open(&path).and_then(|scene| scene.export(&[], Path::new("out.glb")))
    };
    open(4, "a.bin").unwrap();
    open(4, "data:application/octet-stream;base64,AAAAAA==").unwrap();
    assert!(matches!(open(5, "a.bin"), Err(SceneError::Invalid(..))));
    assert!(matches!(
        open(5, "data:application/octet-stream;base64,AAAAAA=="),
        Err(SceneError::Invalid(..))
    ));
    assert!(matches!(open(1, "data:,a"), Err(SceneError::Invalid(..))));
    assert!(matches!(open(1, "b.bin"), Err(SceneError::Missing { .. })));
}

/// One small texture in each format.
fn textures() -> [Vec<u8>; 3] {
    let material = &find("gold-paint").unwrap().material;
    let table = |depth: Depth| {
        let request = Request {
            quantities: vec![Quantity::Fresnel],
            masking: Default::default(),
            extent: Extent::Size(16),
            depths: Depths::Only(depth),
        };
        bake(&[material], &request).unwrap().tables.remove(0)
    };
    let half = table(Depth::Half);
    [
        encode(&half, Format::Exr).unwrap(),
        encode(&half, Format::Ktx2).unwrap(),
        encode(&table(Depth::Unorm16), Format::Png).unwrap(),
    ]
}

#[test]
fn a_texture_alone_says_what_it_is() {
    for bytes in textures() {
        let entry = read_entry(&bytes).unwrap();
        assert_eq!((entry.quantity, entry.size), (Quantity::Fresnel, vec![16, 1]));
        assert_eq!(entry.rows, ["gold-paint"]);
    }
}

#[test]
fn textures_cut_short_are_refused() {
    for bytes in textures() {
        let format = Format::of(&bytes).unwrap();
        for end in 0..bytes.len() {
            assert!(read_entry(&bytes[..end]).is_err(), "{format:?} cut at {end}");
        }
    }
}

#[test]
fn damaged_textures_end_in_an_answer() {
    for bytes in textures() {
        for at in 0..bytes.len() {
            for value in [0x00, 0x7f, 0x80, 0xff] {
                let mut damaged = bytes.clone();
                damaged[at] = value;
                let _ = read_entry(&damaged);
            }
        }
    }
}

#[test]
fn textures_that_claim_more_than_they_hold_are_refused() {
    let [exr, ktx2, png] = textures();
    let claim = |bytes: &[u8], at: usize, claimed: &[u8]| {
        let mut bytes = bytes.to_vec();
        bytes[at..at + claimed.len()].copy_from_slice(claimed);
        read_entry(&bytes).unwrap_err().to_string()
    };
    // KTX 2: levels, bytes of the keys, bytes of the level.
    for (at, claimed) in [(40, &[0xff; 4][..]), (60, &[0xff; 4]), (88, &[0xff; 8])] {
        assert_eq!(claim(&ktx2, at, claimed), "not a valid KTX 2: unexpected end of buffer");
    }
    // PNG: a width that another program's checksum vouches for, and the length of a chunk.
    let mut wide = Vec::new();
    let encoder = ::png::Encoder::new(&mut wide, 1 << 30, 1 << 30);
    encoder.write_header().unwrap();
    assert!(read_entry(&wide).unwrap_err().to_string().starts_with("not a valid PNG"));
    assert!(claim(&png, 33, &[0x7f, 0xff, 0xff, 0xff]).starts_with("not a valid PNG"));
    // EXR: the far corner of the data window.
    let name = b"dataWindow\0box2i\0\x10\0\0\0";
    let window = exr.windows(name.len()).position(|bytes| bytes == name).unwrap() + name.len();
    assert!(claim(&exr, window + 8, &[0xff, 0xff, 0xff, 0x3f]).starts_with("not a valid EXR"));
    // A scanline of 2²⁷ texels would be read whole.
    let wide = claim(&exr, window + 8, &[0, 0, 0, 8]);
    assert!(wide.contains("wider than any lookup texture"), "{wide}");
}

#[test]
fn an_image_of_another_program_is_no_texture() {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, 1, 1);
    encoder.set_color(::png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&[0]).unwrap();
    let message = read_entry(&bytes).unwrap_err().to_string();
    assert_eq!(message, "this PNG has no 'sgdbake' entry, so sgdbake did not bake it");
    assert!(matches!(read_entry(b"{}"), Err(EntryError::UnknownFormat)));
}
