//! Scenes in, the same scenes out: what is not an assigned material is compared value by value and
//! byte by byte, over every glTF under ../shared/models (skipped with a message where that folder
//! is absent) and over generated documents full of things no tool knows.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use serde_json::{Map, Value, json};
use sgdbake::scene::{
    Attachment, Clearcoat, EXTENSION, Pattern, Replacement, Scene, SlotId, Specular, resolve,
};

/// The shared test scenes, or `None` with a message.
fn models() -> Option<PathBuf> {
    let shared = std::env::var_os("SGDBAKE_SHARED").map(PathBuf::from);
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let models = shared.unwrap_or(beside).join("models");
    if !models.is_dir() {
        eprintln!("skipped: no {}", models.display());
        return None;
    }
    Some(models)
}

fn gltf_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("the folder was there").flatten() {
        let path = entry.path();
        let gltf = path.extension().is_some_and(|ending| ending == "gltf" || ending == "glb");
        match path.is_dir() {
            true => found.extend(gltf_files(&path)),
            false if gltf => found.push(path),
            false => {}
        }
    }
    found.sort();
    found
}

fn replacement() -> Replacement {
    let texture = |quantity: &str, bytes: &Arc<[u8]>| Attachment {
        entry: json!({"quantity": quantity, "format": "exr"}).as_object().unwrap().clone(),
        file_name: format!("{quantity}.exr"),
        mime: "image/x-exr",
        bytes: bytes.clone(),
    };
    let bytes: Arc<[u8]> = Arc::from(&b"\x76\x2f\x31\x01 not a real EXR"[..]);
    let mut extension = Map::new();
    extension.insert("version".into(), json!(1));
    Replacement {
        name: "gold-paint".into(),
        base_color: [0.5, 0.25, 0.125],
        metallic: 1.0,
        roughness: 0.375,
        specular: Some(Specular { factor: 0.5, color: [1.0, 0.9, 0.8] }),
        clearcoat: Some(Clearcoat { factor: 0.25, roughness: 0.1 }),
        extension,
        extras: json!({"version": 1, "name": "gold-paint"}),
        textures: vec![texture("ndf", &bytes), texture("same", &bytes)],
    }
}

/// Exports to `target` and writes the files.
fn export(scene: &Scene, assigned: &[(SlotId, &Replacement)], target: &Path) {
    fs::create_dir_all(target.parent().unwrap()).unwrap();
    for file in scene.export(assigned, target).unwrap().files {
        file.write_to(&mut fs::File::create(&file.path).unwrap()).unwrap();
    }
}

/// JSON and BIN of a scene file, read without the library.
fn document(path: &Path) -> (Value, Vec<u8>) {
    let bytes = fs::read(path).unwrap();
    if !bytes.starts_with(b"glTF") {
        return (serde_json::from_slice(&bytes).unwrap(), Vec::new());
    }
    let length = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let json = 20..20 + length(12);
    let bin = bytes.get(json.end + 8..).unwrap_or_default().to_vec();
    (serde_json::from_slice(&bytes[json]).unwrap(), bin)
}

#[test]
fn without_an_assignment_the_file_comes_out_byte_for_byte() {
    let Some(models) = models() else { return };
    let folder = tempfile::tempdir().unwrap();
    let files = gltf_files(&models);
    assert!(files.len() >= 9, "{files:?}");
    for path in files {
        let target = folder.path().join(path.file_name().unwrap());
        let scene = Scene::open(&path).unwrap();
        export(&scene, &[], &target);
        assert!(fs::read(&path).unwrap() == fs::read(&target).unwrap(), "{}", path.display());
    }
}

/// What an assignment may change in a document: the material, `extensionsUsed`, and what is
/// appended to buffer views and buffer 0.
fn without_the_assigned(mut document: Value, slot: SlotId, before: &Value) -> Value {
    let SlotId::Material(index) = slot else { panic!("a material slot") };
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
    let Some(models) = models() else { return };
    let folder = tempfile::tempdir().unwrap();
    let replacement = replacement();
    for path in gltf_files(&models) {
        let target = folder.path().join(path.file_name().unwrap());
        let scene = Scene::open(&path).unwrap();
        for slot in scene.slots() {
            if slot.id == SlotId::Unassigned {
                continue;
            }
            export(&scene, &[(slot.id, &replacement)], &target);
            let (before, bin_before) = document(&path);
            let (after, bin_after) = document(&target);
            assert!(bin_after.starts_with(&bin_before), "{}", path.display());
            let material = &after["materials"][slot.id.index().unwrap()];
            assert_eq!(material["extensions"][EXTENSION]["textures"].as_array().unwrap().len(), 2);
            assert_eq!(
                without_the_assigned(after, slot.id, &before),
                without_the_assigned(before.clone(), slot.id, &before),
                "{}",
                path.display()
            );
        }
    }
}

#[test]
fn a_ball_is_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene::ball(16).unwrap();
    let slots = scene.slots();
    assert_eq!(slots[0].triangles, 2 * 32 * 15);
    let assignments = [(Pattern::new("*"), replacement())];
    let resolved = resolve(&slots, &assignments).unwrap();
    let assigned = [(slots[0].id, resolved[0].unwrap())];
    for name in ["ball.glb", "ball.gltf"] {
        let target = folder.path().join(name);
        export(&scene, &assigned, &target);
        assert_eq!(Scene::open(&target).unwrap().slots(), slots);
    }
    assert!(
        folder.path().join("ball.bin").is_file() && folder.path().join("ball.ndf.exr").is_file()
    );
}
