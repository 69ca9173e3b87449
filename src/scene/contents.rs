//! A summary of a scene, a manifest or a lookup texture: the measured materials and the textures in
//! it.

use std::ffi::OsStr;
use std::fs;
use std::io::{self, Read as _};
use std::path::Path;

use serde::Serialize;

use crate::asset::{Manifest, ManifestError};
use crate::encode::{EntryError, Format, TextureEntry, read_entry};
use crate::scene::{Counts, Scene, SceneError, Slot, SlotId};

/// The contents of a file.
#[derive(Debug, Serialize)]
pub struct Contents {
    /// The kind of file.
    pub kind: Kind,
    /// The measured materials.
    pub materials: Vec<MaterialContent>,
    /// The lookup textures, each once.
    pub textures: Vec<TextureEntry>,
    /// The rest of a scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<SceneContent>,
    /// Remarks on the file that are not errors.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

/// A kind of file that has contents.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// .glb, .gltf or .obj.
    Scene,
    /// manifest.json.
    Manifest,
    /// .exr, .ktx2 or .png.
    Texture,
}

/// A measured material.
#[derive(Debug, Serialize)]
pub struct MaterialContent {
    /// Its name.
    pub name: String,
    /// Its row in the textures; `None` without a visible lobe.
    pub row: Option<usize>,
    /// The slot of a scene that it is in.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slot: Option<String>,
}

/// The parts of a scene other than measured materials.
#[derive(Debug, Serialize)]
pub struct SceneContent {
    /// The number of each kind.
    #[serde(flatten)]
    pub counts: Counts,
    /// The document's `extensionsUsed`.
    pub extensions_used: Vec<String>,
    /// The material slots.
    pub slots: Vec<SlotContent>,
}

/// A material slot.
#[derive(Debug, Serialize)]
pub struct SlotContent {
    /// Its label.
    pub slot: String,
    /// The index of its material; `None` for primitives without one.
    pub index: Option<usize>,
    /// The meshes that use it.
    pub meshes: Vec<String>,
    /// Triangles that use it.
    pub triangles: u64,
    /// True if anything uses it.
    pub used: bool,
}

/// Why the contents of a file cannot be listed.
#[derive(Debug, thiserror::Error)]
pub enum ContentsError {
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The file is larger than any that this program writes.
    #[error("found {found} bytes; {kind} has at most {most}")]
    Size {
        /// What the name says that the file is.
        kind: &'static str,
        /// Its bytes.
        found: u64,
        /// The most that are read.
        most: u64,
    },
    /// A texture without a readable entry.
    #[error(transparent)]
    Texture(#[from] EntryError),
    /// A .json that is not a manifest.
    #[error(transparent)]
    Manifest(#[from] ManifestError),
    /// A scene that cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Bytes of the largest texture that a bake writes, 16384² texels of three floats, with its header.
const MAX_TEXTURE_BYTES: u64 = 12 * 16384 * 16384 + (64 << 20);
/// Bytes of a manifest of the most rows, each with a name of the longest.
const MAX_MANIFEST_BYTES: u64 = 1 << 30;

/// Refuses a file of more bytes than any of its kind has.
fn check_size(found: u64, most: u64, kind: &'static str) -> Result<(), ContentsError> {
    if found > most { Err(ContentsError::Size { kind, found, most }) } else { Ok(()) }
}

impl Contents {
    /// Reads the contents of a file: a texture by its first bytes or its name, a manifest by its
    /// name, else a scene.
    ///
    /// # Errors
    /// A file that cannot be read, or is damaged.
    pub fn read(path: &Path) -> Result<Self, ContentsError> {
        // Opening a pipe would wait for a writer.
        let metadata = fs::metadata(path)?;
        if !metadata.is_file() {
            return Err(ContentsError::Scene(SceneError::NotAFile));
        }
        let mut start = Vec::new();
        // 12 bytes: the signature of KTX 2, the longest.
        fs::File::open(path)?.take(12).read_to_end(&mut start)?;
        let ending = path.extension().and_then(OsStr::to_str).unwrap_or("").to_ascii_lowercase();
        if Format::of(&start).is_some() {
            check_size(metadata.len(), MAX_TEXTURE_BYTES, "a texture")?;
            return Ok(Self::of_texture(&fs::read(path)?)?);
        }
        if ending.parse::<Format>().is_ok() {
            // Named like a texture without its signature; the first bytes suffice for the error.
            return Ok(Self::of_texture(&start)?);
        }
        if ending == "json" {
            check_size(metadata.len(), MAX_MANIFEST_BYTES, "a manifest")?;
            return Ok(Self::of_manifest(&fs::read_to_string(path)?)?);
        }
        Ok(Self::of_scene(&Scene::open(path)?))
    }

    /// The contents of a manifest.
    ///
    /// # Errors
    /// Text that is not a manifest of this version.
    pub fn of_manifest(text: &str) -> Result<Self, ManifestError> {
        let Manifest { materials, textures, .. } = Manifest::read(text)?;
        let materials = materials.into_iter().map(|material| MaterialContent {
            name: material.entry.parameters.name,
            row: material.entry.row,
            slot: None,
        });
        Ok(Self { materials: materials.collect(), textures, ..Self::empty(Kind::Manifest) })
    }

    /// The contents of a texture file: its entry, and the first material of each row.
    ///
    /// # Errors
    /// Another kind of file, a damaged one, or one without an entry.
    pub fn of_texture(bytes: &[u8]) -> Result<Self, EntryError> {
        let entry = read_entry(bytes)?;
        let materials = entry.rows.iter().enumerate().map(|(index, name)| MaterialContent {
            name: name.clone(),
            // A texture without a row axis states the one row that it holds.
            row: Some(entry.row.unwrap_or(index)),
            slot: None,
        });
        Ok(Self {
            materials: materials.collect(),
            textures: vec![entry],
            ..Self::empty(Kind::Texture)
        })
    }

    /// The contents of a scene.
    #[must_use]
    pub fn of_scene(scene: &Scene) -> Self {
        let slots = scene.slots();
        let mut contents = Self { warnings: scene.warnings().to_vec(), ..Self::empty(Kind::Scene) };
        for (index, extension) in scene.measured() {
            let slot = slots.iter().find(|slot| slot.id == SlotId::Material(index));
            let slot = slot.map(Slot::label);
            match extension {
                Ok(extension) => {
                    let (name, row) = (extension.material.parameters.name, extension.material.row);
                    contents.materials.push(MaterialContent { name, row, slot });
                    // Materials share textures, each with rows of its own.
                    for texture in extension.textures {
                        if !contents.textures.contains(&texture) {
                            contents.textures.push(texture);
                        }
                    }
                }
                Err(error) => contents.warnings.push(format!("materials[{index}]: {error}")),
            }
        }
        contents.scene = Some(SceneContent {
            counts: scene.counts(),
            extensions_used: scene.extensions_used().to_vec(),
            slots: slots.into_iter().map(SlotContent::from).collect(),
        });
        contents
    }

    fn empty(kind: Kind) -> Self {
        Self {
            kind,
            materials: Vec::new(),
            textures: Vec::new(),
            scene: None,
            warnings: Vec::new(),
        }
    }
}

impl From<Slot> for SlotContent {
    fn from(slot: Slot) -> Self {
        Self {
            slot: slot.label(),
            index: slot.id.index(),
            meshes: slot.meshes,
            triangles: slot.triangles,
            used: slot.used,
        }
    }
}
