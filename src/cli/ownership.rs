//! Files that sgdbake wrote, told by the place where each kind of file names its writer. A file
//! that only mentions sgdbake is somebody else's.

use std::fs::File;
use std::io::{BufRead, BufReader, Read as _, Seek as _};
use std::path::Path;

use serde::Deserialize;
use sgdbake::asset::Measured;
use sgdbake::encode::generator_of;
use sgdbake::material::parse;
use sgdbake::scene::is_unedited;

/// Prefixes of generators, schemas and comments.
const NAME: &str = "sgdbake ";
const SCHEMA: &str = "sgdbake/";

/// The most bytes of a text that are looked at for its writer.
const HEAD: u64 = 4096;

/// Returns whether sgdbake wrote the regular file at `path`. Reads no more than the file's header,
/// or the JSON of a scene or report.
pub fn is_ours(path: &Path) -> bool {
    let Ok(file) = File::open(path) else { return false };
    let mut file = BufReader::new(file);
    let mut head = Vec::new();
    if (&mut file).take(HEAD).read_to_end(&mut head).is_err() || file.rewind().is_err() {
        return false;
    }
    if head.starts_with(b"tensor_file\0") {
        return bsdf_is_ours(&head);
    }
    if head.starts_with(b"glTF") {
        return glb_json(&mut file).is_some_and(json_is_ours);
    }
    // A leading `{` is JSON, `#` TOML or Markdown; the rest are textures and texts.
    match head.iter().find(|byte| !byte.is_ascii_whitespace()) {
        Some(b'{') => json_is_ours(file),
        // A `#` that starts no material may be the heading of a report.
        Some(b'#') if material_is_ours(&head, path) => true,
        _ => generator_of(file).is_some_and(is_name) || text_names_us(&head),
    }
}

fn is_name(writer: String) -> bool {
    writer.starts_with(NAME) || writer.starts_with(SCHEMA)
}

/// The members of a JSON document that name its writer.
#[derive(Deserialize)]
struct Document {
    schema: Option<String>,
    asset: Option<Asset>,
}

#[derive(Deserialize)]
struct Asset {
    generator: Option<String>,
}

/// The largest JSON that is looked into.
const LARGEST_JSON: u64 = 1 << 28;

/// Returns whether a report or manifest has our schema, or a scene is an export that nobody edited
/// since. A scene without such a mark counts by its generator.
fn json_is_ours(json: impl BufRead) -> bool {
    let mut text = String::new();
    if json.take(LARGEST_JSON).read_to_string(&mut text).is_err() {
        return false;
    }
    let Ok(document) = serde_json::from_str::<Document>(&text) else { return false };
    let writer = document.schema.or_else(|| document.asset?.generator);
    is_unedited(&text).unwrap_or_else(|| writer.is_some_and(is_name))
}

/// Returns whether `measure` wrote a material file, and nobody edited its parameters since.
fn material_is_ours(head: &[u8], path: &Path) -> bool {
    // A file of measure's is shorter than the head.
    let Ok(text) = std::str::from_utf8(head) else { return false };
    parse(text, path).is_ok_and(|material| Measured::is_unedited(text, &material))
}

/// The JSON chunk of a .glb, with the spaces that pad it.
fn glb_json(file: &mut BufReader<File>) -> Option<impl BufRead> {
    let mut header = [0; 20];
    file.read_exact(&mut header).ok()?;
    // 12 bytes of file header, then the length of the first chunk and its kind.
    let [.., a, b, c, d, _, _, _, _] = header;
    Some(file.take(u32::from_le_bytes([a, b, c, d]).into()))
}

/// A .bsdf keeps its description in its first field, behind the list of fields.
fn bsdf_is_ours(head: &[u8]) -> bool {
    const WRITER: &[u8] = b", written by sgdbake ";
    memchr::memmem::find(head, WRITER).is_some()
}

/// Pages, pictures, shaders and manuals name the writer in their first lines.
fn text_names_us(head: &[u8]) -> bool {
    let head = String::from_utf8_lossy(head);
    // Only the head of a page counts: its body may quote such an element.
    let html = head.starts_with("<!doctype html>")
        && head
            .split_once("</head>")
            .map_or(&*head, |(head, _)| head)
            .contains("<meta name=\"generator\" content=\"sgdbake ");
    // Lines that define the apostrophe stand before `.TH`.
    let manual = head.lines().take(4).any(|line| line.starts_with(".TH sgdbake"));
    html || manual
        || head.starts_with("<!-- sgdbake ")
        || head.starts_with("// Written by sgdbake (")
        || head.starts_with("# Speed against error\n\nMeasured by sgdbake ")
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::*;

    fn ours(content: &[u8]) -> bool {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), content).unwrap();
        is_ours(file.path())
    }

    #[test]
    fn a_mention_is_no_mark() {
        let page = "<!doctype html>\n<html><head><title>Tools</title></head>\
                    <body><meta name=\"generator\" content=\"sgdbake 0.1.0\"></body></html>";
        let scene = r#"{"asset":{"version":"2.0","generator":"an editor"},
            "materials":[{"extensions":{"SGD_materials_shifted_gamma":{"version":2}}}]}"#;
        for content in
            ["I use sgdbake 0.1.0.", page, scene, r#"{"note":"sgdbake/manifest/2"}"#, "", "{"]
        {
            assert!(!ours(content.as_bytes()), "{content}");
        }
    }

    #[test]
    fn a_generator_or_schema_in_its_place_is() {
        let page = "<!doctype html>\n<html><head><meta name=\"generator\" content=\"sgdbake 9\">\
                    </head></html>";
        let scene = r#"{"asset":{"version":"2.0","generator":"sgdbake 0.1.0"}}"#;
        for content in [
            page,
            scene,
            r#"{"a":[1],"schema":"sgdbake/manifest/1"}"#,
            "// Written by sgdbake (its shader version 1)",
            ".ie x\n.el y\n.TH sgdbake-bake 1",
        ] {
            assert!(ours(content.as_bytes()), "{content}");
        }
        let length = (20 + scene.len() as u32).to_le_bytes();
        let chunk = (scene.len() as u32).to_le_bytes();
        let glb = [&b"glTF\x02\0\0\0"[..], &length, &chunk, b"JSON", scene.as_bytes()].concat();
        assert!(ours(&glb));
    }
}
