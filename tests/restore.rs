//! The extension is dropped or broken, and comes back from `extras.sgd` as it was.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

#[path = "support/document.rs"]
mod document;

use std::{fs, path::Path};

use document::{document, glb, text_and_bin};
use serde_json::{Value, json};
use sgdbake::asset::{Asset, EXTENSION, StatedError, build, rebuild};
use sgdbake::brdf::MaskingKind;
use sgdbake::encode::{Format, Location};
use sgdbake::lut::{Depths, Extent, Quantity, Request};
use sgdbake::material::named;
use sgdbake::scene::{Export, Scene, SlotId, is_unedited};

/// The text without the extension in any material, as a tool writes it that drops what it does not
/// know.
fn stripped(document: &mut Value) {
    for material in document["materials"].as_array_mut().unwrap() {
        material["extensions"].as_object_mut().unwrap().shift_remove(EXTENSION);
    }
    let used = document["extensionsUsed"].as_array_mut().unwrap();
    used.retain(|name| name != EXTENSION);
}

/// Two materials of the catalogue in a scene, one of them twice, and their assets.
fn exported(target: &Path) -> Vec<Asset> {
    let materials = ["gold-paint", "black-fabric@refit"].map(|name| named(name).unwrap());
    let mut assets = build(&materials, &request(), Format::Exr).unwrap().assets;
    // As of a measurement that no catalogue knows.
    assets[1].material.error = Some(StatedError { delta_e: 1.25, source: "a sample".into() });
    let text =
        r#"{"asset":{"version":"2.0"},"materials":[{"name":"a"},{"name":"b"},{"name":"c"}]}"#;
    let source = target.with_file_name("plain.gltf");
    fs::write(&source, text).unwrap();
    let slots = [(0, &assets[0]), (1, &assets[1]), (2, &assets[0])];
    let slots = slots.map(|(index, asset)| (SlotId::Material(index), asset));
    write(Scene::open(&source).unwrap().export(&slots, target).unwrap());
    assets
}

fn request() -> Request {
    Request {
        quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
        masking: MaskingKind::Fitted,
        extent: Extent::Tolerance(1e-2),
        depths: Depths::Smallest,
    }
}

/// Restores every material that has extras, and writes the files.
fn restore(path: &Path, target: &Path) {
    let scene = Scene::open(path).unwrap();
    let (indices, extras): (Vec<_>, Vec<_>) = scene.extras().unwrap().into_iter().unzip();
    let assets = rebuild(&extras, &request(), Format::Exr).unwrap();
    let restored: Vec<_> = indices.into_iter().zip(&assets).collect();
    write(scene.restored(&restored, target).unwrap());
}

fn write(export: Export) {
    for file in export.files {
        fs::create_dir_all(file.path.parent().unwrap()).unwrap();
        file.write_to(&mut fs::File::create(&file.path).unwrap()).unwrap();
    }
}

#[test]
fn a_restored_gltf_is_the_exported_one_byte_for_byte() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    exported(&at("scene.gltf"));
    let (mut json, _) = document(&at("scene.gltf"));
    stripped(&mut json);
    fs::create_dir(at("stripped")).unwrap();
    fs::write(at("stripped/scene.gltf"), json.to_string()).unwrap();
    restore(&at("stripped/scene.gltf"), &at("restored/scene.gltf"));
    // The order of `extensionsUsed` follows that of the declarations.
    let sorted = |path: &Path| {
        let (mut json, _) = document(path);
        let used = json["extensionsUsed"].as_array_mut().unwrap();
        used.sort_by_key(Value::to_string);
        for material in json["materials"].as_array_mut().unwrap() {
            let body = material["extensions"][EXTENSION].as_object_mut().unwrap();
            body.shift_remove("document");
        }
        json.to_string()
    };
    assert_eq!(sorted(&at("restored/scene.gltf")), sorted(&at("scene.gltf")));
    for name in ["ndf", "masking", "fresnel"].map(|name| format!("scene.{name}.exr")) {
        assert!(fs::read(at("restored").join(&name)).unwrap() == fs::read(at(&name)).unwrap());
    }
    let (text, _) = text_and_bin(&at("restored/scene.gltf"));
    assert_eq!(is_unedited(&text), Some(true));
}

#[test]
fn restoring_replaces_a_broken_extension_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let assets = exported(&at("scene.glb"));
    let (mut json, bin) = document(&at("scene.glb"));
    // A tool that moves buffer views, and one that edits a material's fit.
    json["materials"][0]["extensions"][EXTENSION]["textures"][0]["bufferView"] = json!(99);
    json["materials"][1]["extensions"][EXTENSION] = json!("broken");
    json["materials"][1]["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.125);
    json["materials"][2].as_object_mut().unwrap().shift_remove("extras");
    fs::write(at("broken.glb"), glb(&json.to_string(), &bin)).unwrap();
    restore(&at("broken.glb"), &at("restored.glb"));
    let (mut restored, after) = document(&at("restored.glb"));
    assert!(after.starts_with(&bin));
    let found: Vec<_> = Scene::open(&at("restored.glb")).unwrap().measured().collect();
    for ((_, extension), asset) in found.iter().zip([&assets[0], &assets[1]]) {
        let extension = extension.as_ref().unwrap();
        assert_eq!(extension.material, asset.material);
        for (entry, texture) in extension.textures.iter().zip(&asset.textures) {
            let Location::BufferView { buffer_view, .. } = entry.location else { panic!() };
            let view = &restored["bufferViews"][buffer_view];
            let number = |key: &str| view[key].as_u64().unwrap() as usize;
            let range = number("byteOffset")..number("byteOffset") + number("byteLength");
            assert!(after[range] == texture.bytes[..]);
            assert_eq!(entry.at(texture.entry.location.clone()), texture.entry);
        }
    }
    for index in [0, 1] {
        let extensions = restored["materials"][index]["extensions"].as_object_mut().unwrap();
        extensions.shift_remove(EXTENSION);
        let before = json["materials"][index]["extensions"].as_object_mut().unwrap();
        before.shift_remove(EXTENSION);
    }
    assert_eq!(restored["materials"], json["materials"], "without extras it is left alone");
}

#[test]
fn pruning_takes_out_the_lookup_textures_that_restoring_replaces() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    exported(&at("scene.glb"));
    let first = document(&at("scene.glb")).1.len();
    restore(&at("scene.glb"), &at("twice.glb"));
    let twice = document(&at("twice.glb")).1.len();
    let scene = Scene::open(&at("twice.glb")).unwrap();
    let pruned = scene.without_lookups(&(0..3).collect()).unwrap();
    write(pruned.export(&[], &at("pruned.glb")).unwrap());
    restore(&at("pruned.glb"), &at("again.glb"));
    let again = document(&at("again.glb")).1.len();
    // What is left of each texture is less than twice the alignment.
    assert!(twice > first + 1000 && again < twice + 6 * 16, "{first} {twice} {again}");
}
