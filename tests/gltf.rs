//! Scenes in, the same scenes out: what is not an assigned material is compared value by value and
//! byte by byte, over every glTF under ../shared/models (skipped with a message where that folder
//! is absent) and over generated documents full of things no tool knows.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

#[path = "support/document.rs"]
mod document;
mod support;

use std::{fs, path::Path};

use base64::{Engine, prelude::BASE64_STANDARD};
use document::{document, glb, text_and_bin};
use serde_json::{Value, json};
use sgdbake::asset::EXTENSION;
use sgdbake::scene::{Pattern, Scene, SlotId, resolve};
use support::{asset, export, models, scene_files};

/// A document as nobody should write it: odd spellings and spacing, unknown members and extensions
/// at every level, compressed geometry, variants, sparse accessors, several scenes and buffers.
/// `buffer0` is a member with a comma for the first buffer's address, or nothing in a .glb.
fn odd_document(buffer0: &str) -> String {
    let second = BASE64_STANDARD.encode([7; 12]);
    format!(
        r#"
{{ "extensionsRequired" : ["KHR_draco_mesh_compression","MADE_up"],
	"asset":{{"version":"2.0","extras":{{"deep":[[[{{"é\u00e9\/":1.50E+003}}]]]}}}},"extensionsUsed":["KHR_draco_mesh_compression",
 "MADE_up","KHR_materials_variants","KHR_materials_sheen"], "unknown":null,"unknown":"twice",
 "scenes":[{{"nodes":[0]}},{{"nodes":[ 0 ],"extras":-0.0}}],"scene":1,
 "extensions":{{"KHR_materials_variants":{{"variants":[{{"name":"a"}}]}},"MADE_up":{{"bufferView":0,"x":1e400}}}},
 "nodes":[{{"mesh":0,"rotation":[0.0,-0,1.00000000000000000001,0],"extensions":{{"MADE_up":[]}}}}],
 "meshes":[{{"name":"first","weights":[0.10],"primitives":[
   {{"attributes":{{"POSITION":0,"_ODD":0}},"material":1,"targets":[{{"POSITION":1}}],
     "extensions":{{"KHR_materials_variants":{{"mappings":[{{"material":0,"variants":[0]}}]}},"KHR_draco_mesh_compression":{{"bufferView":1,"attributes":{{"POSITION":0}}}}}}}},
   {{ "attributes" : {{"POSITION":0}} , "mode":4.0 }}]}}],
 "materials":[{{"name":"kept","pbrMetallicRoughness":{{"roughnessFactor":0.70}},"alphaCutoff":5e-1,"alphaMode":"MASK"}},
  {{ "doubleSided":true, "pbrMetallicRoughness":{{"baseColorFactor":[1,1,1,0.250],"baseColorTexture":{{"index":0}},"metallicRoughnessTexture":{{"index":0}}}},
     "normalTexture":{{"index":0,"scale":1.0E0}}, "extras":{{"mine":[1.10]}},"alphaMode":"BLEND",
     "extensions":{{"KHR_materials_sheen":{{}},"KHR_materials_emissive_strength":{{"emissiveStrength":2.0}},"MADE_up":{{"v":1.0}}}}}}],
 "textures":[{{"source":0}}],"images":[{{"mimeType":"image/png","bufferView":1}}],
 "accessors":[{{"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,1],
   "sparse":{{"count":1,"indices":{{"bufferView":0,"componentType":5121}},"values":{{"bufferView":2}}}}}},
   {{"componentType":5126,"count":3,"type":"VEC3"}}],
 "bufferViews":[{{"buffer":0,"byteLength":4}},{{"buffer":0,"byteOffset":4,"byteLength":5,"extensions":{{"MADE_up":0}}}},{{"buffer":1,"byteLength":12}}],
 "buffers":[{{{buffer0}"byteLength":9,"extras":"first"}},{{"byteLength":12,"uri":"data:application/octet-stream;base64,{second}"}}]  }}
"#
    )
}

const ODD_BIN: [u8; 12] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 0, 0];

/// The odd document as a .glb, as a .gltf with a file, and as a .gltf with a data URI.
fn odd_files(folder: &Path) -> [std::path::PathBuf; 3] {
    fs::create_dir_all(folder).unwrap();
    let data = BASE64_STANDARD.encode(&ODD_BIN[..9]);
    let data = format!(r#""uri":"data:application/octet-stream;base64,{data}","#);
    fs::write(folder.join("odd name.bin"), &ODD_BIN[..9]).unwrap();
    let files = [
        ("odd.glb", glb(&odd_document(""), &ODD_BIN)),
        ("odd.gltf", odd_document(r#""uri":"odd%20name.bin","#).into_bytes()),
        ("data.gltf", odd_document(&data).into_bytes()),
    ];
    files.map(|(name, bytes)| {
        fs::write(folder.join(name), bytes).unwrap();
        folder.join(name)
    })
}

#[test]
fn without_an_assignment_the_file_comes_out_byte_for_byte() {
    let folder = tempfile::tempdir().unwrap();
    let mut files = odd_files(&folder.path().join("in")).to_vec();
    files.extend(models().iter().flat_map(|models| scene_files(models)));
    for path in files.iter().filter(|path| path.extension().unwrap() != "obj") {
        let target = folder.path().join("out").join(path.file_name().unwrap());
        let scene = Scene::open(path).unwrap();
        export(&scene, &[], &target);
        assert!(fs::read(path).unwrap() == fs::read(&target).unwrap(), "{}", path.display());
        for file in scene.export(&[], &target).unwrap().files {
            let beside = path
                .parent()
                .unwrap()
                .join(file.path.strip_prefix(target.parent().unwrap()).unwrap());
            assert!(fs::read(beside).unwrap() == fs::read(file.path).unwrap());
        }
    }
}

/// What an assignment may change in a document: the material, `extensionsUsed`, and what is
/// appended to buffer views and buffer 0.
fn without_the_assigned(mut document: Value, slot: SlotId, before: &Value) -> Value {
    let index = slot.index().expect("a material slot");
    document["materials"][index] = Value::Null;
    let root = document.as_object_mut().unwrap();
    root.shift_remove("extensionsUsed");
    if let Some(views) = root.get_mut("bufferViews").and_then(Value::as_array_mut) {
        views.truncate(before["bufferViews"].as_array().map_or(0, Vec::len));
    }
    if let Some(buffer) = document["buffers"].get_mut(0) {
        buffer["byteLength"] = Value::Null;
    }
    document
}

#[test]
fn with_a_slot_assigned_all_else_is_equal() {
    let folder = tempfile::tempdir().unwrap();
    let asset = asset();
    let mut files = odd_files(&folder.path().join("in")).to_vec();
    files.extend(models().iter().flat_map(|models| scene_files(models)));
    for path in files.iter().filter(|path| path.extension().unwrap() != "obj") {
        let target = folder.path().join("out").join(path.file_name().unwrap());
        let scene = Scene::open(path).unwrap();
        for slot in scene.slots().iter().filter(|slot| slot.id != SlotId::Unassigned) {
            export(&scene, &[(slot.id, &asset)], &target);
            let (before, bin_before) = document(path);
            let (after, bin_after) = document(&target);
            assert!(bin_after.starts_with(&bin_before), "{}", path.display());
            let material = &after["materials"][slot.id.index().unwrap()];
            assert_eq!(material["extensions"][EXTENSION]["textures"].as_array().unwrap().len(), 2);
            let kept = without_the_assigned(before.clone(), slot.id, &before);
            assert_eq!(without_the_assigned(after, slot.id, &before), kept, "{}", path.display());
        }
    }
}

#[test]
fn the_text_around_an_assignment_keeps_every_character() {
    let folder = tempfile::tempdir().unwrap();
    let [path, ..] = odd_files(folder.path());
    let target = folder.path().join("out.glb");
    export(&Scene::open(&path).unwrap(), &[(SlotId::Material(0), &asset())], &target);
    let (before, _) = text_and_bin(&path);
    let (after, bin) = text_and_bin(&target);
    let after = after.trim_end_matches(' ');
    let material = |text: &str| {
        let start = text.find(r#"{"name":"kept""#).unwrap();
        text[start..text.find(",\n  { \"doubleSided\"").unwrap()].to_owned()
    };
    let used = format!(
        r#""KHR_materials_sheen","{EXTENSION}","KHR_materials_specular","KHR_materials_clearcoat"]"#
    );
    let expected = before
        .trim_end_matches(' ')
        .replace(&material(&before), &material(after))
        .replace(r#""KHR_materials_sheen"]"#, &used)
        .replace(
            "12}],\n \"buffers\"",
            "12},{\"buffer\":0,\"byteOffset\":12,\"byteLength\":19}],\n \"buffers\"",
        )
        .replace(r#""byteLength":9,"#, r#""byteLength":31,"#);
    assert_eq!(after, expected);
    assert_eq!(bin[..12], ODD_BIN);
    assert!(fs::read(&target).unwrap().ends_with(b"odd?unknown!"));
}

#[test]
fn a_replaced_material_keeps_what_is_not_reflection() {
    let folder = tempfile::tempdir().unwrap();
    let [path, ..] = odd_files(folder.path());
    let target = folder.path().join("out.glb");
    let scene = Scene::open(&path).unwrap();
    export(&scene, &[(SlotId::Material(1), &asset())], &target);
    let (after, _) = document(&target);
    let material = &after["materials"][1];
    assert_eq!(
        material["pbrMetallicRoughness"].to_string(),
        r#"{"baseColorFactor":[0.5,0.25,0.125,0.250],"metallicFactor":1.0,"roughnessFactor":0.375}"#
    );
    assert_eq!(material["normalTexture"].to_string(), r#"{"index":0,"scale":1.0e+0}"#);
    assert_eq!(material["name"], "gold-paint");
    assert_eq!(material["doubleSided"], true);
    assert_eq!(material["alphaMode"], "BLEND");
    assert_eq!(material["extras"]["mine"].to_string(), "[1.10]");
    assert_eq!(material["extras"]["sgd"]["name"], "gold-paint");
    let extensions: Vec<_> = material["extensions"].as_object().unwrap().keys().collect();
    assert_eq!(
        extensions,
        [
            "KHR_materials_emissive_strength",
            "MADE_up",
            "KHR_materials_specular",
            "KHR_materials_clearcoat",
            EXTENSION
        ]
    );
    let used = after["extensionsUsed"].as_array().unwrap();
    assert!(
        used.contains(&json!(EXTENSION))
            && !after["extensionsRequired"].to_string().contains("SGD")
    );
    let textures = &material["extensions"][EXTENSION]["textures"];
    assert_eq!(textures[0]["bufferView"], textures[1]["bufferView"], "equal bytes are stored once");
    assert_eq!(textures[0]["mimeType"], "image/x-exr");
}

/// KHR_materials_pbrSpecularGlossiness overrules the base colour, and its alpha with it.
#[test]
fn the_alpha_of_a_specular_glossiness_material_stays() {
    let folder = tempfile::tempdir().unwrap();
    let [path, target] = ["in.gltf", "out.gltf"].map(|name| folder.path().join(name));
    let gloss = |body: Value| {
        json!({"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.75]},
            "extensions": {"KHR_materials_pbrSpecularGlossiness": body}})
    };
    let materials = [
        gloss(json!({"diffuseFactor": [0.5, 0.5, 0.5, 0.25]})),
        gloss(json!({"diffuseTexture": {"index": 0}})),
    ];
    let before = json!({"asset": {"version": "2.0"}, "materials": materials,
        "textures": [{}], "extensionsUsed": ["KHR_materials_pbrSpecularGlossiness"]});
    fs::write(&path, before.to_string()).unwrap();
    let (scene, asset) = (Scene::open(&path).unwrap(), asset());
    let assigned = [0, 1].map(|index| (SlotId::Material(index), &asset));
    export(&scene, &assigned, &target);
    let (after, _) = document(&target);
    for (index, alpha) in [(0, "0.25"), (1, "1")] {
        let factor = &after["materials"][index]["pbrMetallicRoughness"]["baseColorFactor"];
        assert_eq!(factor.to_string(), format!("[0.5,0.25,0.125,{alpha}]"));
    }
    let warnings = scene.export(&assigned, &target).unwrap().warnings;
    let lost = "material 1: its alpha came from the base colour texture, which goes";
    assert_eq!(warnings, [lost]);
}

#[test]
fn primitives_without_a_material_can_be_assigned() {
    let folder = tempfile::tempdir().unwrap();
    let [path, ..] = odd_files(folder.path());
    let target = folder.path().join("out.glb");
    let scene = Scene::open(&path).unwrap();
    let slots = scene.slots();
    assert_eq!(slots[2].label(), "(none)");
    let assignments = [(Pattern::new("(none)"), asset())];
    let resolved = resolve(&slots, &assignments).unwrap();
    assert!(resolved[..2].iter().all(Option::is_none));
    export(&scene, &[(slots[2].id, resolved[2].unwrap())], &target);
    let (before, _) = document(&path);
    let (after, _) = document(&target);
    assert_eq!(after["materials"].as_array().unwrap().len(), 3);
    assert_eq!(after["materials"][0], before["materials"][0]);
    let primitives = |document: &Value, i: usize| document["meshes"][0]["primitives"][i].clone();
    assert_eq!(primitives(&after, 0), primitives(&before, 0), "variants stay valid");
    assert_eq!(primitives(&after, 1)["material"], 2);
    assert_eq!(Scene::open(&target).unwrap().slots()[2].name.as_deref(), Some("gold-paint"));
}

#[test]
fn containers_are_converted_there_and_back() {
    let folder = tempfile::tempdir().unwrap();
    for path in odd_files(&folder.path().join("in")) {
        let [there, back] = ["there", "back"].map(|name| folder.path().join(name));
        let was_glb = path.extension().unwrap() == "glb";
        let [other, own] = if was_glb { ["gltf", "glb"] } else { ["glb", "gltf"] };
        let [there, back] =
            [there.join("odd").with_extension(other), back.join("odd").with_extension(own)];
        export(&Scene::open(&path).unwrap(), &[], &there);
        export(&Scene::open(&there).unwrap(), &[], &back);
        let with_first_uri = |path: &Path, uri: Value| {
            let (mut json, _) = document(path);
            json["buffers"][0]["uri"] = uri;
            json
        };
        assert_eq!(with_first_uri(&back, Value::Null), with_first_uri(&path, Value::Null));
        let glb = if was_glb { &back } else { &there };
        assert_eq!(document(glb).1, ODD_BIN);
    }
    assert_eq!(fs::read(folder.path().join("back/odd.bin")).unwrap(), ODD_BIN[..9]);
}

#[test]
fn images_of_a_gltf_move_into_a_glb_with_equal_bytes() {
    let Some(models) = models() else { return };
    let folder = tempfile::tempdir().unwrap();
    for path in scene_files(&models).iter().filter(|path| path.extension().unwrap() == "gltf") {
        let target = folder.path().join("out.glb");
        export(&Scene::open(path).unwrap(), &[], &target);
        let (before, _) = document(path);
        let (after, bin) = document(&target);
        for (i, image) in before["images"].as_array().into_iter().flatten().enumerate() {
            let file = path.parent().unwrap().join(image["uri"].as_str().unwrap());
            let view =
                &after["bufferViews"][after["images"][i]["bufferView"].as_u64().unwrap() as usize];
            let number = |key: &str| view[key].as_u64().unwrap() as usize;
            let bytes = &bin[number("byteOffset")..][..number("byteLength")];
            assert!(bytes == fs::read(file).unwrap(), "{}", path.display());
        }
    }
}

#[test]
fn a_first_buffer_with_an_address_of_its_own_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let [path, target] = ["in.glb", "out.glb"].map(|name| folder.path().join(name));
    let uri = "data:application/octet-stream;base64,AAAA";
    let before = json!({
        "asset": {"version": "2.0"}, "materials": [{}], "buffers": [{"uri": uri, "byteLength": 3}],
    });
    fs::write(&path, glb(&before.to_string(), &ODD_BIN)).unwrap();
    export(&Scene::open(&path).unwrap(), &[(SlotId::Material(0), &asset())], &target);
    let (after, bin) = document(&target);
    assert_eq!((&after["buffers"][0], bin), (&before["buffers"][0], ODD_BIN.to_vec()));
    assert_eq!(
        after["bufferViews"][0].to_string(),
        r#"{"buffer":1,"byteOffset":0,"byteLength":19}"#
    );
    assert_eq!(after["buffers"][1]["byteLength"], 19);
}

#[test]
fn a_ball_is_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene::ball(16).unwrap();
    let slots = scene.slots();
    assert_eq!(slots[0].triangles, 2 * 32 * 15);
    for name in ["ball.glb", "ball.gltf"] {
        let target = folder.path().join(name);
        export(&scene, &[(slots[0].id, &asset())], &target);
        assert_eq!(Scene::open(&target).unwrap().slots(), slots);
    }
    assert!(
        folder.path().join("ball.bin").is_file() && folder.path().join("ball.ndf.exr").is_file()
    );
}

#[test]
fn pruning_takes_out_what_only_replaced_materials_showed() {
    let folder = tempfile::tempdir().unwrap();
    let picture = |n: u8| vec![n; 1000];
    let bin = [vec![1; 12], picture(2), vec![3; 12], picture(4), vec![5; 40]].concat();
    let views = [(0, 12), (12, 1000), (1012, 12), (1024, 1000), (2024, 40)];
    let views: Vec<_> =
        views.iter().map(|(o, n)| json!({"buffer": 0, "byteOffset": o, "byteLength": n})).collect();
    let material = |texture: usize| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": texture}}, "normalTexture": {"index": 1}});
    let image = |view: usize| json!({"bufferView": view, "mimeType": "image/png"});
    let mut before = json!({
        "asset": {"version": "2.0"},
        "materials": [material(0), material(1), material(0)],
        "textures": [{"source": 0}, {"source": 1}],
        "images": [image(1), image(3)],
        "extensions": {"MADE_up": {"bufferView": 4}},
        "bufferViews": views.clone(),
        "buffers": [{"byteLength": bin.len()}],
    });
    let path = folder.path().join("in.glb");
    let target = folder.path().join("out.glb");
    let asset = asset();
    let pruned = |before: &Value, slots: &[usize]| {
        fs::write(&path, glb(&before.to_string(), &bin)).unwrap();
        let slots: Vec<_> = slots.iter().map(|slot| (SlotId::Material(*slot), &asset)).collect();
        let scene = Scene::open(&path).unwrap().pruned(&slots).unwrap();
        export(&scene, &[], &target);
        document(&target)
    };
    // Texture 0 is still shown by the third material, texture 1 stays a normal texture.
    assert_eq!(pruned(&before, &[0, 1]), (before.clone(), bin.clone()));
    let (after, rest) = pruned(&before, &[0, 1, 2]);
    // A data URI would be a warning of the validator.
    assert_eq!(after["images"][0], json!({"mimeType": "image/png", "bufferView": 5}));
    assert_eq!(after["images"][1], before["images"][1]);
    assert_eq!(after["textures"], before["textures"]);
    assert_eq!(rest.len(), bin.len() - 992 + 68);
    for (index, n) in [(0, 1u8), (2, 3), (3, 4), (4, 5)] {
        let number = |key: &str| after["bufferViews"][index][key].as_u64().unwrap() as usize;
        let bytes = &rest[number("byteOffset")..][..number("byteLength")];
        assert!(bytes.iter().all(|byte| *byte == n), "view {index}");
        assert_eq!(
            number("byteLength"),
            before["bufferViews"][index]["byteLength"].as_u64().unwrap() as usize
        );
    }
    // A view that something unknown refers to stays, however the number is spelled.
    for view in [json!(1), json!(1.0)] {
        before["extensions"]["MADE_up"]["bufferView"] = view;
        assert!(pruned(&before, &[0, 1, 2]).1.starts_with(&bin));
    }
    // A first buffer with an address of its own is not the BIN chunk: neither changes.
    before["extensions"]["MADE_up"]["bufferView"] = json!(4);
    before["buffers"][0]["uri"] = json!("first.bin");
    fs::write(folder.path().join("first.bin"), &bin).unwrap();
    let (after, rest) = pruned(&before, &[0, 1, 2]);
    assert!(rest == bin && after["buffers"][0] == before["buffers"][0]);
    assert_eq!(after["bufferViews"].as_array().unwrap()[..5], views);
}

/// Lookup textures of a measured material that stays, and files that an unknown extension names.
#[test]
fn files_that_extensions_name_travel_with_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let asset = asset();
    let slots = |indices: &[usize]| -> Vec<_> {
        indices.iter().map(|index| (SlotId::Material(*index), &asset)).collect()
    };
    let plain = json!({
        "asset": {"version": "2.0"},
        "materials": [{"name": "a"}, {"name": "b"}, {"extensions": {EXTENSION: {"version": 1}}}],
        "extensions": {"MADE_up": {"uri": "made%20up.dat", "more": [{"uri": "absent.dat"}, {"uri": "https://a.b/c"}, {"uri": "../out"}]}},
    });
    fs::write(at("plain.gltf"), plain.to_string()).unwrap();
    fs::write(at("made up.dat"), b"made up").unwrap();
    export(&Scene::open(&at("plain.gltf")).unwrap(), &slots(&[0, 1]), &at("one/scene.gltf"));
    assert_eq!(fs::read(at("one/made up.dat")).unwrap(), b"made up");

    // Of the same name, so that the new texture has to give way to the one that stays.
    let measured = Scene::open(&at("one/scene.gltf")).unwrap();
    export(&measured, &slots(&[1]), &at("two/scene.gltf"));
    let (before, after) = (document(&at("one/scene.gltf")).0, document(&at("two/scene.gltf")).0);
    let bytes = &*asset.textures[0].bytes;
    let uris = |document: &Value, index: usize| -> Vec<String> {
        let textures = &document["materials"][index]["extensions"][EXTENSION]["textures"];
        let textures = textures.as_array().unwrap().iter();
        textures.map(|texture| texture["uri"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(uris(&after, 0), uris(&before, 0));
    assert_ne!(uris(&after, 1), uris(&before, 0));
    for uri in [uris(&after, 0), uris(&after, 1)].concat() {
        assert_eq!(fs::read(at("two").join(uri)).unwrap(), bytes);
    }
    assert_eq!(fs::read(at("two/made up.dat")).unwrap(), b"made up");
    assert_eq!(fs::read_dir(at("two")).unwrap().count(), 4);

    export(&measured, &slots(&[1]), &at("three/scene.glb"));
    let (after, bin) = document(&at("three/scene.glb"));
    for texture in after["materials"][0]["extensions"][EXTENSION]["textures"].as_array().unwrap() {
        assert_eq!((texture.get("uri"), &texture["mimeType"]), (None, &json!("image/x-exr")));
        let view = &after["bufferViews"][texture["bufferView"].as_u64().unwrap() as usize];
        let start = view["byteOffset"].as_u64().unwrap() as usize;
        assert_eq!(&bin[start..][..view["byteLength"].as_u64().unwrap() as usize], bytes);
    }
    assert_eq!(after["extensions"], plain["extensions"]);
    assert_eq!(after["materials"][2], plain["materials"][2], "it has no textures to embed");
    assert_eq!(fs::read_dir(at("three")).unwrap().count(), 2);
}

#[test]
fn pruning_takes_out_the_lookup_textures_of_replaced_materials() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let asset = asset();
    let ball = (SlotId::Material(0), &asset);
    export(&Scene::ball(4).unwrap(), &[ball], &at("0.glb"));
    let again = |from: &str, to: &str, prune: bool| {
        let scene = Scene::open(&at(from)).unwrap();
        let scene = if prune { scene.pruned(&[ball]).unwrap() } else { scene };
        export(&scene, &[ball], &at(to));
        document(&at(to)).1.len()
    };
    let first = document(&at("0.glb")).1.len();
    let texture = asset.textures[0].bytes.len();
    assert!(again("0.glb", "1.glb", false) >= first + texture);
    let pruned = again("0.glb", "2.glb", true);
    assert!(pruned < first + texture, "{pruned} {first}");
    // What is left of each is less than twice the alignment.
    assert!(again("2.glb", "3.glb", true) < pruned + 16);
}
