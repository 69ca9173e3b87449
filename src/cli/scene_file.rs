//! Scenes that commands read and write.

use std::fs;
use std::path::Path;

use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::output::{NewFile, Output, Writing};
use crate::cli::ownership::is_ours;
use sgdbake::scene::{Export, OutputFile, Scene, SceneError};

/// Reads a scene, with a progress bar.
pub fn read(path: &Path, output: &Output) -> Result<Scene, Failure> {
    let size = fs::metadata(path).map_or(0, |metadata| metadata.len());
    let bar = output.progress(size, "reading");
    let scene = Scene::open_with_progress(path, &mut |bytes| bar.set_position(bytes));
    bar.finish_and_clear();
    scene.map_err(|error| unreadable(path, error))
}

/// A scene that cannot be read, with its path.
pub fn unreadable(path: &Path, error: SceneError) -> Failure {
    let message = format!("{}: {error}", path.display());
    match error {
        SceneError::Kind(_) => Failure::usage(message).help("a scene is a .obj, .gltf or .glb"),
        SceneError::Uri { .. } | SceneError::Missing { .. } => {
            Failure::job(message).help("put the file into the scene's folder")
        }
        _ => Failure::job(message),
    }
}

/// The files to write, without those of the input that are there already, unchanged.
fn changed(files: &[OutputFile]) -> Vec<&OutputFile> {
    files.iter().filter(|file| !(file.copy && stands_already(file))).collect()
}

/// Returns whether the file is there with this content. Its size is compared first.
fn stands_already(file: &OutputFile) -> bool {
    let same_size =
        fs::metadata(&file.path).is_ok_and(|old| old.is_file() && old.len() == file.len());
    let mut bytes = Vec::new();
    same_size
        && file.write_to(&mut bytes).is_ok()
        && fs::read(&file.path).is_ok_and(|old| old == bytes)
}

/// Writes the files, the scene last: a reader that finds it finds everything. Where sgdbake wrote
/// the old scene, its files are overwritten with it: a buffer has no mark of its own.
pub fn write(
    scene: &Path,
    files: &[OutputFile],
    inputs: &[&Path],
    writing: Writing,
) -> Result<(), Failure> {
    let Writing { dry_run, force } = writing;
    let files = changed(files);
    // A copy has the name that the input gives it: that the scene is ours says nothing about a file
    // that already bears this name, so copies need the force of the user.
    let own_scene = scene.is_file() && is_ours(scene);
    let copies = files.iter().filter(|file| file.copy).map(|file| file.path.as_path());
    writing.check(copies, inputs)?;
    // The scene is the first of the files; reversed, it is written last.
    let new: Vec<NewFile<'_>> =
        // An export lists the scene first.
        files.iter().rev().map(|file| NewFile::new(&file.path, |out| file.write_to(out))).collect();
    Writing { dry_run, force: force || own_scene }.write_all(&new, inputs)
}

/// A written file.
#[derive(Serialize)]
pub struct FileReport<'a> {
    /// Where.
    pub path: &'a Path,
    /// Its length.
    pub bytes: u64,
}

impl<'a> FileReport<'a> {
    /// The files of an export.
    pub fn of(export: &'a Export) -> Vec<Self> {
        let files = export.files.iter();
        files.map(|file| Self { path: &file.path, bytes: file.len() }).collect()
    }
}

/// A line for each file that was written, or would be.
pub fn print_files(
    files: &[FileReport<'_>],
    dry_run: bool,
    output: &mut Output,
) -> Result<(), Failure> {
    let verb = if dry_run { "would write" } else { "wrote" };
    files.iter().try_for_each(|file| {
        output.line(format_args!("{verb} {} ({} bytes)", file.path.display(), file.bytes))
    })
}
