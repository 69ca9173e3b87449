//! `sgdbake inspect`: what is in a scene, a manifest or one of the textures.

use std::ffi::OsStr;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::cli::export::unreadable;
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::encode::entry;
use crate::encode::manifest::Format;
use crate::scene::{Counts, Scene, Slot};

/// Prints what is in a scene (.glb, .gltf, .obj), a manifest, or a lookup texture (.exr, .ktx2,
/// .png): which measured materials, and the textures' sizes and tolerances.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  sgdbake inspect out.glb --json")]
pub struct Arguments {
    /// The file
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Machine-readable output
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Debug, Default, Serialize)]
pub struct Contents {
    schema: &'static str,
    kind: Kind,
    materials: Vec<MaterialContent>,
    textures: Vec<TextureContent>,
    #[serde(skip_serializing_if = "Option::is_none")]
    scene: Option<SceneContent>,
}

#[derive(Clone, Copy, Debug, Default, Serialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    #[default]
    Scene,
    Manifest,
    Texture,
}

/// A measured material.
#[derive(Debug, Serialize)]
struct MaterialContent {
    name: String,
    row: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    slot: Option<String>,
}

/// A lookup texture, as its manifest entry says it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct TextureContent {
    quantity: String,
    #[serde(flatten)]
    location: Location,
    #[serde(default)]
    format: String,
    #[serde(default)]
    depth: String,
    #[serde(default)]
    size: Vec<u64>,
    #[serde(default)]
    rows: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    row: Option<usize>,
    #[serde(default)]
    error: Promise,
}

/// Where its bytes are.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Location {
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    uri: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    buffer_view: Option<u64>,
}

/// The promised and the measured error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Promise {
    tolerance: Option<f64>,
    measured: Option<f64>,
}

#[derive(Debug, Serialize)]
struct SceneContent {
    #[serde(flatten)]
    counts: Counts,
    extensions_used: Vec<String>,
    slots: Vec<SlotContent>,
}

#[derive(Debug, Serialize)]
struct SlotContent {
    slot: String,
    index: Option<usize>,
    meshes: Vec<String>,
    triangles: u64,
    used: bool,
}

/// The parts of a manifest, or of the extension of a material, that are shown.
#[derive(Debug, Deserialize)]
struct Entry {
    name: String,
    row: Option<usize>,
    #[serde(default)]
    textures: Vec<TextureContent>,
}

#[derive(Debug, Deserialize)]
struct Manifest {
    schema: String,
    materials: Vec<Entry>,
    textures: Vec<TextureContent>,
}

const SCHEMA: &str = "sgdbake/inspect/1";

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let contents = contents(&arguments.file)?;
    if arguments.json { output.json(&contents) } else { print(&contents, output) }
}

fn contents(path: &Path) -> Result<Contents, Failure> {
    let job = |error: &dyn std::fmt::Display| Failure::job(format!("{}: {error}", path.display()));
    let mut start = Vec::new();
    let file = fs::File::open(path).map_err(|error| job(&error))?;
    file.take(12).read_to_end(&mut start).map_err(|error| job(&error))?;
    let ending = path.extension().map(OsStr::to_ascii_lowercase);
    if Format::of(&start).is_some() {
        let bytes = fs::read(path).map_err(|error| job(&error))?;
        return of_texture(&bytes).map_err(|error| job(&error));
    }
    if ending.is_some_and(|ending| ending == "json") {
        let text = fs::read_to_string(path).map_err(|error| job(&error))?;
        return of_manifest(&text).map_err(|error| job(&error));
    }
    Scene::open(path).map_err(|error| unreadable(path, error)).map(|scene| of_scene(&scene))
}

/// What a manifest says.
///
/// # Errors
///
/// Text that is no manifest of this version.
pub fn of_manifest(text: &str) -> Result<Contents, String> {
    let manifest: Manifest = serde_json::from_str(text).map_err(|error| error.to_string())?;
    if manifest.schema != crate::encode::manifest::SCHEMA {
        return Err(format!("schema {:?} is not known", manifest.schema));
    }
    let material = |entry: Entry| MaterialContent { name: entry.name, row: entry.row, slot: None };
    Ok(Contents {
        schema: SCHEMA,
        kind: Kind::Manifest,
        materials: manifest.materials.into_iter().map(material).collect(),
        textures: manifest.textures,
        scene: None,
    })
}

/// What the manifest entry in a texture file says.
///
/// # Errors
///
/// Bytes that are no texture file, or a damaged one, or one without the entry.
pub fn of_texture(bytes: &[u8]) -> Result<Contents, String> {
    let entry = entry::read(bytes).map_err(|error| error.to_string())?;
    let texture: TextureContent =
        serde_json::from_str(&entry).map_err(|error| format!("its entry: {error}"))?;
    Ok(Contents {
        schema: SCHEMA,
        kind: Kind::Texture,
        materials: texture.materials(),
        textures: vec![texture],
        scene: None,
    })
}

impl TextureContent {
    /// The first material of each row.
    fn materials(&self) -> Vec<MaterialContent> {
        let material = |(index, name): (usize, &String)| MaterialContent {
            name: name.clone(),
            row: Some(self.row.unwrap_or(index)),
            slot: None,
        };
        self.rows.iter().enumerate().map(material).collect()
    }
}

fn of_scene(scene: &Scene) -> Contents {
    let slots = scene.slots();
    let mut contents = Contents { schema: SCHEMA, kind: Kind::Scene, ..Contents::default() };
    for (index, body) in scene.measured() {
        let Ok(entry) = serde_json::from_value::<Entry>(body.clone()) else { continue };
        let slot = slots.get(index).map(Slot::label);
        contents.materials.push(MaterialContent { name: entry.name, row: entry.row, slot });
        for texture in entry.textures {
            if !contents.textures.contains(&texture) {
                contents.textures.push(texture);
            }
        }
    }
    contents.scene = Some(SceneContent {
        counts: scene.counts(),
        extensions_used: scene.extensions_used().to_vec(),
        slots: slots
            .into_iter()
            .map(|slot| SlotContent {
                slot: slot.label(),
                index: slot.id.index(),
                meshes: slot.meshes,
                triangles: slot.triangles,
                used: slot.used,
            })
            .collect(),
    });
    contents
}

fn print(contents: &Contents, output: &mut Output) -> Result<(), Failure> {
    if let Some(scene) = &contents.scene {
        let Counts { meshes, triangles, images, animations, .. } = scene.counts;
        output.line(format_args!(
            "scene: {meshes} meshes, {triangles} triangles, {images} images, {animations} animations"
        ))?;
        for slot in &scene.slots {
            let meshes = if slot.used { slot.meshes.join(", ") } else { "unused".into() };
            output
                .line(format_args!("slot {}: {} triangles; {meshes}", slot.slot, slot.triangles))?;
        }
    }
    for MaterialContent { name, row, slot } in &contents.materials {
        let row = row.map_or("no textures".into(), |row| format!("row {row}"));
        let slot = slot.as_ref().map(|slot| format!(" in slot {slot}")).unwrap_or_default();
        output.line(format_args!("material {name}{slot}: {row}"))?;
    }
    for texture in &contents.textures {
        let size: Vec<_> = texture.size.iter().map(u64::to_string).collect();
        let error = |name: &str, value: Option<f64>| match value {
            Some(value) => format!(", {name} {value:.2e}"),
            None => String::new(),
        };
        output.line(format_args!(
            "texture {}: {} {} {}{}{}",
            texture.quantity,
            size.join(" × "),
            texture.depth,
            texture.format,
            error("tolerance", texture.error.tolerance),
            error("measured error", texture.error.measured),
        ))?;
    }
    Ok(())
}
