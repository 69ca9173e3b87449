//! `sgdbake inspect`: the contents of a scene, a manifest or a texture.

use std::path::PathBuf;

use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::scene_file::unreadable;
use crate::cli::terminal::name;
use sgdbake::encode::TextureEntry;
use sgdbake::scene::{Contents, ContentsError, Counts, SceneContent};

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

/// The object that `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    schema: &'static str,
    #[serde(flatten)]
    contents: &'a Contents,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let path = &arguments.file;
    let contents = Contents::read(path).map_err(|error| match error {
        ContentsError::Scene(error) => unreadable(path, error),
        error => Failure::job(format!("{}: {error}", path.display())),
    })?;
    if arguments.json {
        return output.json(&Report { schema: "sgdbake/inspect/1", contents: &contents });
    }
    contents.warnings.iter().for_each(|warning| output.note(format_args!("warning: {warning}")));
    print(&contents, output)
}

fn print(contents: &Contents, output: &mut Output) -> Result<(), Failure> {
    if let Some(scene) = &contents.scene {
        print_scene(scene, output)?;
    }
    for material in &contents.materials {
        let row = material.row.map_or("no textures".into(), |row| format!("row {row}"));
        let slot = material.slot.as_ref().map(|slot| format!(" in slot {slot}"));
        let slot = slot.unwrap_or_default();
        output.line(format_args!("material {}{}: {row}", name(&material.name), name(&slot)))?;
    }
    contents.textures.iter().try_for_each(|texture| output.line(texture_line(texture)))
}

fn print_scene(scene: &SceneContent, output: &mut Output) -> Result<(), Failure> {
    let Counts { meshes, triangles, images, animations, .. } = scene.counts;
    output.line(format_args!(
        "scene: {meshes} meshes, {triangles} triangles, {images} images, {animations} animations"
    ))?;
    for slot in &scene.slots {
        let meshes = if slot.used { slot.meshes.join(", ") } else { "unused".into() };
        let index = slot.index.map_or_else(String::new, |index| format!("#{index} "));
        // The label of a slot without a name is its index already.
        let index = if slot.slot.starts_with('#') { String::new() } else { index };
        output.line(format_args!(
            "slot {index}{}: {} triangles; {}",
            name(&slot.slot),
            slot.triangles,
            name(&meshes)
        ))?;
    }
    Ok(())
}

/// An error with its name, if there is one.
fn error_text(name: &str, error: Option<f64>) -> String {
    error.map_or_else(String::new, |error| format!(", {name} {error:.2e}"))
}

fn texture_line(texture: &TextureEntry) -> String {
    let size: Vec<_> = texture.size.iter().map(usize::to_string).collect();
    format!(
        "texture {}: {} {} {}{}{}",
        texture.quantity.name(),
        size.join(" × "),
        texture.depth.name(),
        texture.format.extension(),
        error_text("tolerance", texture.error.tolerance),
        error_text("measured error", texture.error.measured),
    )
}
