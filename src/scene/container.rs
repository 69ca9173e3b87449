//! The two containers of glTF.

use std::{ffi::OsStr, path::Path};

use crate::scene::SceneError;

/// How a glTF document is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Container {
    /// One binary file; textures are embedded.
    Glb,
    /// A JSON file, with buffers and textures in files of their own.
    Gltf,
}

impl Container {
    /// The container that a file name's ending asks for.
    ///
    /// # Errors
    /// [`SceneError::Kind`] for another ending than .glb and .gltf.
    pub fn of(path: &Path) -> Result<Self, SceneError> {
        match path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase).as_deref() {
            Some("glb") => Ok(Container::Glb),
            Some("gltf") => Ok(Container::Gltf),
            _ => Err(SceneError::Kind(path.display().to_string())),
        }
    }
}
