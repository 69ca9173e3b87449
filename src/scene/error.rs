//! Errors of scenes.

use std::io;

use thiserror::Error;

use crate::asset::ExtrasError;

/// Why a scene cannot be read, assigned or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SceneError {
    /// Reading or writing failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The file's ending names no known kind of scene.
    #[error("{0:?} has no file extension of a scene; use .obj, .gltf or .glb")]
    Kind(String),
    /// The .glb container is damaged.
    #[error("not a valid .glb: {0}")]
    Glb(String),
    /// The JSON is not UTF-8.
    #[error("the glTF JSON is not UTF-8 text")]
    Utf8,
    /// The JSON does not parse, or an item has the wrong type.
    #[error("not a valid glTF: {0}")]
    Json(#[from] serde_json::Error),
    /// An index or a size contradicts the rest of the document; the first field is its place.
    #[error("not a valid glTF: {0}: {1}")]
    Invalid(String, String),
    /// A resource that must not be followed.
    #[error("{uri:?} {reason}; only files in the scene's own folder are read")]
    Uri {
        /// The address as it stands in the scene.
        uri: String,
        /// The problem.
        reason: &'static str,
    },
    /// A resource of the scene is not there.
    #[error("the scene's file {uri:?} cannot be read: {source}")]
    Missing {
        /// The address as it stands in the scene.
        uri: String,
        /// Why.
        source: io::Error,
    },
    /// A first buffer without content, which a .glb has no place for.
    #[error("buffers[0] has no uri, and in a .glb it would stand for the BIN chunk; write a .gltf")]
    NoContent,
    /// A version of glTF that is not read.
    #[error("{found}; sgdbake reads glTF 2.0. Convert the scene to glTF 2.0 first")]
    Version {
        /// The version that was found, in words.
        found: String,
    },
    /// Something that is not a regular file: a folder, a pipe, a device.
    #[error("not a regular file; save the scene to a file first")]
    NotAFile,
    /// A file of more bytes than are read of its kind.
    #[error("found {found} bytes; {kind} is read up to {most}. {advice}")]
    Size {
        /// The kind of file.
        kind: &'static str,
        /// Its bytes.
        found: u64,
        /// The most that are read.
        most: u64,
        /// A way around it.
        advice: &'static str,
    },
    /// An assignment that fits nothing.
    #[error("no material slot matches {pattern:?}; the scene has {}", list(.slots))]
    NoSlot {
        /// The pattern as given.
        pattern: String,
        /// Names of the slots there are.
        slots: Vec<String>,
    },
    /// Parameters in a material's extras that cannot be read.
    #[error("materials[{index}] {name:?}: {source}")]
    Extras {
        /// The material's index.
        index: usize,
        /// Its name.
        name: String,
        /// The problem.
        source: ExtrasError,
    },
    /// More bytes than a .glb can hold.
    #[error("{0} bytes are more than a .glb can hold (4 GiB); write a .gltf")]
    TooLarge(u64),
    /// The OBJ is damaged; the line counts from 1.
    #[error("not a valid OBJ: line {line}: {reason}")]
    Obj {
        /// Where reading stopped.
        line: usize,
        /// The problem.
        reason: String,
    },
}

fn list(slots: &[String]) -> String {
    match slots {
        [] => "none".into(),
        _ => slots.join(", "),
    }
}
