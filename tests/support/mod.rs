//! What the scene tests share.

use std::{
    fs,
    path::{Path, PathBuf},
};

use sgdbake::asset::Asset;
use sgdbake::scene::{Scene, SlotId};

mod asset;

pub use asset::asset;

/// The shared test scenes, or `None` with a message.
pub fn models() -> Option<PathBuf> {
    let shared = std::env::var_os("SGDBAKE_SHARED").map(PathBuf::from);
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let models = shared.unwrap_or(beside).join("models");
    if !models.is_dir() {
        eprintln!("skipped: no {}", models.display());
        return None;
    }
    Some(models)
}

/// Every .obj, .gltf and .glb below a folder, in order.
pub fn scene_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("the folder was there").flatten() {
        let path = entry.path();
        let ending = path.extension().and_then(|ending| ending.to_str());
        match ending {
            _ if path.is_dir() => found.extend(scene_files(&path)),
            Some("obj" | "gltf" | "glb") => found.push(path),
            _ => {}
        }
    }
    found.sort();
    found
}

/// Exports to `target` and writes the files.
pub fn export(scene: &Scene, assigned: &[(SlotId, &Asset)], target: &Path) {
    for file in scene.export(assigned, target).unwrap().files {
        fs::create_dir_all(file.path.parent().unwrap()).unwrap();
        file.write_to(&mut fs::File::create(&file.path).unwrap()).unwrap();
    }
}
