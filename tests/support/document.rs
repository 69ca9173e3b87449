//! Scene files without the library.

use std::{fs, path::Path};

use serde_json::Value;

/// JSON and BIN of a scene file, read without the library.
pub fn document(path: &Path) -> (Value, Vec<u8>) {
    let (text, bin) = text_and_bin(path);
    (serde_json::from_str(&text).unwrap(), bin)
}

/// Text and BIN of a scene file.
pub fn text_and_bin(path: &Path) -> (String, Vec<u8>) {
    let bytes = fs::read(path).unwrap();
    if !bytes.starts_with(b"glTF") {
        return (String::from_utf8(bytes).unwrap(), Vec::new());
    }
    let length = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!(length(8), bytes.len());
    let json = 20..20 + length(12);
    let bin = match bytes.get(json.end..json.end + 8) {
        Some(header) if &header[4..] == b"BIN\0" => {
            bytes[json.end + 8..json.end + 8 + length(json.end)].to_vec()
        }
        _ => Vec::new(),
    };
    (String::from_utf8(bytes[json].to_vec()).unwrap(), bin)
}

/// A .glb of JSON, BIN and a chunk nobody knows.
pub fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let mut body = Vec::new();
    let json = format!("{json}{}", " ".repeat(json.len().wrapping_neg() % 4));
    for (kind, content) in [(b"JSON", json.as_bytes()), (b"BIN\0", bin), (b"odd?", b"unknown!")] {
        body.extend((content.len() as u32).to_le_bytes());
        body.extend(kind);
        body.extend(content);
    }
    [&b"glTF\x02\0\0\0"[..], &(12 + body.len() as u32).to_le_bytes(), &body].concat()
}
