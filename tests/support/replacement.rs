//! A material to put into test scenes.

use std::sync::Arc;

use serde_json::{Map, json};
use sgdbake::scene::{Attachment, Clearcoat, Replacement, Specular};

/// A replacement with everything in it, its two textures sharing their bytes.
pub fn replacement() -> Replacement {
    let texture = |quantity: &str, bytes: &Arc<[u8]>| Attachment {
        entry: Map::from_iter([
            ("quantity".into(), json!(quantity)),
            ("format".into(), json!("exr")),
        ]),
        file_name: format!("{quantity}.exr"),
        mime: "image/x-exr",
        bytes: bytes.clone(),
    };
    let bytes: Arc<[u8]> = Arc::from(&b"\x76\x2f\x31\x01 not a real EXR"[..]);
    let mut extension = Map::new();
    extension.insert("version".into(), json!(1));
    extension.insert("name".into(), json!("gold-paint"));
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
