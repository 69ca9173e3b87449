//! A scene whose slot takes a measured material: a .glb with the best glTF fit.

// An example shows what it found.
#![allow(clippy::print_stdout)]

use std::path::Path;

use sgdbake::fit::gltf;
use sgdbake::material::find;
use sgdbake::scene::{Bytes, Replacement, Scene, Specular};

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let material = &find("gold-paint")?.material;
    let best = gltf::fit(material).material;
    let replacement = Replacement {
        name: material.name.clone(),
        base_color: best.base_color,
        metallic: best.metallic,
        roughness: best.roughness,
        specular: Some(Specular { factor: best.specular_factor, color: best.specular_color }),
        clearcoat: None,
        extension: serde_json::Map::new(),
        extras: serde_json::to_value(material.channels)?,
        textures: Vec::new(),
    };
    let scene = Scene::ball(48)?;
    for slot in scene.slots() {
        println!("slot: {}", slot.label());
    }
    let assigned: Vec<_> = scene.slots().iter().map(|slot| (slot.id, &replacement)).collect();
    let export = scene.export(&assigned, Path::new("ball.glb"))?;
    for file in &export.files {
        let bytes: u64 = file.pieces.iter().map(Bytes::len).sum();
        println!("{}: {bytes} bytes", file.path.display());
    }
    Ok(())
}
