//! Sizes up to which the texts of a scene are read: they are held in memory, buffers and images are
//! not.

use crate::scene::SceneError;

/// A text that is held in memory.
#[derive(Clone, Copy, Debug)]
pub(super) enum Text {
    /// An OBJ.
    Obj,
    /// A material library of an OBJ.
    Mtl,
    /// The JSON of a glTF.
    Gltf,
}

/// Returns an error if a text is longer than is read of its kind.
///
/// # Errors
/// [`SceneError::Size`].
pub(super) fn check(text: Text, found: u64) -> Result<(), SceneError> {
    const GIB: u64 = 1 << 30;
    let (kind, most, advice) = match text {
        // Its meshes take about twice the file's bytes, and a .glb holds 4 GiB of them.
        Text::Obj => ("an .obj", 4 * GIB, "Convert it to .glb or .gltf, or split it"),
        Text::Mtl => ("an .mtl", GIB / 4, "Leave out the materials that no face uses"),
        Text::Gltf => (
            "the JSON of a glTF",
            2 * GIB,
            "Save its buffers and images as files of their own, or in a .glb",
        ),
    };
    if found > most { Err(SceneError::Size { kind, found, most, advice }) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_itself_is_read() {
        for text in [Text::Obj, Text::Mtl, Text::Gltf] {
            let Err(SceneError::Size { most, .. }) = check(text, u64::MAX) else { panic!() };
            assert!(check(text, most).is_ok() && check(text, most + 1).is_err());
        }
    }
}
