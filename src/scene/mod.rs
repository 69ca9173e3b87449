//! Scenes in and out: glTF and GLB without loss, OBJ as glTF.
//!
//! A glTF document is kept as text and edited as text; buffers are passed on byte for byte. So
//! everything that is not an assigned material comes out as it came in: unknown extensions,
//! extras, key order, number spelling, compressed geometry, images.
//!
//! # What an assignment changes
//!
//! * In the material: `pbrMetallicRoughness` takes the fit's base colour (alpha stays), metallic
//!   and roughness, and loses its two textures; extensions that describe reflection or
//!   transmission go (KHR_materials_ior, _sheen, _transmission, …); KHR_materials_specular,
//!   KHR_materials_clearcoat and [`EXTENSION`](crate::asset::EXTENSION) come; `extras.sgd` is set.
//!   The name, the normal, occlusion and emissive textures, `alphaMode`, `doubleSided`, unknown
//!   extensions and other extras stay.
//! * In the document: `extensionsUsed`, and in a .glb the buffer views of the lookup textures,
//!   whose bytes follow those of the BIN chunk.

mod assignment;
mod ball;
mod build;
mod bytes;
mod check;
mod container;
mod contents;
mod conversion;
mod draft;
mod error;
mod export;
mod fingerprint;
mod glb;
mod job;
mod material;
mod obj;
mod outline;
mod output_file;
mod prune;
mod resource;
mod restore;
mod size;
mod slot;
mod text;
mod triangles;
mod walk;

use std::{
    collections::BTreeSet,
    ffi::OsStr,
    fs,
    io::Read,
    path::{Path, PathBuf},
};

pub use assignment::{Assignment, AssignmentError};
pub use bytes::Bytes;
pub use container::Container;
pub use contents::{Contents, ContentsError, Kind, MaterialContent, SceneContent, SlotContent};
pub use error::SceneError;
pub use fingerprint::is_unedited;
pub use output_file::{Export, OutputFile};
pub use slot::{Pattern, Slot, SlotId, resolve};
pub use triangles::Triangle;

use serde::Serialize;
use serde_json::Value;

use crate::asset::{Extension, ExtensionError};

use glb::Glb;
use outline::Outline;
use resource::Resource;
use size::Text;
use text::Pieces;

/// The number of each kind of thing in a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Meshes.
    pub meshes: usize,
    /// Triangles of all meshes.
    pub triangles: u64,
    /// Nodes.
    pub nodes: usize,
    /// Scenes.
    pub scenes: usize,
    /// Images.
    pub images: usize,
    /// Textures.
    pub textures: usize,
    /// Animations.
    pub animations: usize,
    /// Skins.
    pub skins: usize,
    /// Cameras.
    pub cameras: usize,
    /// Bytes of all buffers.
    pub buffer_bytes: u64,
}

/// A scene as a glTF document.
///
/// # Example
///
/// ```
/// use sgdbake::Scene;
///
/// let scene = Scene::ball(8)?; // or Scene::open("chair.glb".as_ref())?
/// assert_eq!(scene.slots()[0].name.as_deref(), Some("ball"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Scene {
    /// The JSON text, character for character.
    text: String,
    outline: Outline,
    source: Source,
    /// The content of the first buffer where it has no address of its own.
    bin: Option<Vec<Bytes>>,
    /// .glb chunks after BIN, with their headers.
    rest: Option<Bytes>,
    /// Notes on the input.
    warnings: Vec<String>,
}

/// Where a scene came from.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Source {
    /// A .glb or .gltf in this folder.
    File(Container, PathBuf),
    /// Made here; images lie in the folder, where there is one.
    Built(Option<PathBuf>),
}

impl Scene {
    /// Opens a .obj, .gltf or .glb. Buffers and images stay on disk until they are written.
    ///
    /// # Errors
    /// Files that cannot be read or are not valid, and addresses that leave the scene's folder.
    pub fn open(path: &Path) -> Result<Self, SceneError> {
        Self::open_with_progress(path, &mut |_| ())
    }

    /// Like [`Scene::open`]; `progress` is told the bytes of an OBJ read so far.
    ///
    /// # Errors
    /// As [`Scene::open`].
    pub fn open_with_progress(
        path: &Path,
        progress: &mut dyn FnMut(u64),
    ) -> Result<Self, SceneError> {
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        // `Resource::locate` needs the canonical folder, and an empty path has none.
        let folder = if folder == Path::new("") { PathBuf::from(".") } else { folder };
        let ending = path.extension().and_then(OsStr::to_str).unwrap_or("").to_ascii_lowercase();
        // Opening a pipe would wait for a writer.
        let metadata = fs::metadata(path)?;
        if !metadata.is_file() {
            return Err(SceneError::NotAFile);
        }
        let mut start = Vec::new();
        fs::File::open(path)?.take(4).read_to_end(&mut start)?;
        // The signature of a .glb counts before the name, which may end in .gltf or anything else.
        match &*ending {
            _ if Glb::is_glb(&start) => {
                let Glb { json, bin, rest } = Glb::open(path)?;
                Self::new(
                    json,
                    bin.map(|bytes| vec![bytes]),
                    rest,
                    Source::File(Container::Glb, folder),
                )
            }
            "obj" => {
                size::check(Text::Obj, metadata.len())?;
                obj::open(path, folder, progress)
            }
            "glb" => Err(SceneError::Glb("the file does not start with glTF".into())),
            "gltf" => {
                size::check(Text::Gltf, metadata.len())?;
                let text = String::from_utf8(fs::read(path)?).map_err(|_| SceneError::Utf8)?;
                Self::new(text, None, None, Source::File(Container::Gltf, folder))
            }
            _ => Err(SceneError::Kind(path.display().to_string())),
        }
    }

    fn new(
        text: String,
        bin: Option<Vec<Bytes>>,
        rest: Option<Bytes>,
        source: Source,
    ) -> Result<Self, SceneError> {
        let outline = Outline::read(&text)?;
        let scene = Scene { text, outline, source, bin, rest, warnings: Vec::new() };
        // Addresses outside the folder are refused before `check` opens any of them.
        scene.resources()?;
        check::check(&scene)?;
        Ok(scene)
    }

    /// The material slots, in the order of the materials; primitives without one come last.
    pub fn slots(&self) -> Vec<Slot> {
        slot::slots(&self.outline)
    }

    /// The number of each kind of thing.
    pub fn counts(&self) -> Counts {
        let outline = &self.outline;
        // Counts are claims of the document, whose sum may exceed 64 bits.
        let triangles = self.slots().iter().fold(0u64, |n, slot| n.saturating_add(slot.triangles));
        Counts {
            meshes: outline.meshes.len(),
            triangles,
            nodes: outline.nodes.len(),
            scenes: outline.scenes.len(),
            images: outline.images.len(),
            textures: outline.textures.len(),
            animations: outline.animations.len(),
            skins: outline.skins.len(),
            cameras: outline.cameras.len(),
            buffer_bytes: outline
                .buffers
                .iter()
                .fold(0u64, |n, buffer| n.saturating_add(buffer.byte_length.0)),
        }
    }

    /// Names in `extensionsUsed`.
    pub fn extensions_used(&self) -> &[String] {
        &self.outline.extensions_used
    }

    /// The extension of each material that has one, by material index.
    pub fn measured(
        &self,
    ) -> impl Iterator<Item = (usize, Result<Extension, ExtensionError>)> + '_ {
        self.extensions().map(|(index, body)| (index, Extension::read(body)))
    }

    /// The body of the extension of each material that has one, of whatever version.
    fn extensions(&self) -> impl Iterator<Item = (usize, &Value)> {
        let materials = self.outline.materials.iter().enumerate();
        materials.filter_map(|(index, material)| Some((index, material.extensions.sgd.as_ref()?)))
    }

    /// Oddities of the input that are not errors.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The files that the document names, each once.
    fn resources(&self) -> Result<Vec<Resource>, SceneError> {
        let buffers = self.outline.buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
        let images = self.outline.images.iter().filter_map(|image| image.uri.as_deref());
        let uris: BTreeSet<_> = buffers.chain(images).collect();
        uris.into_iter().filter_map(|uri| Resource::new(uri).transpose()).collect()
    }

    /// Files that extensions name by a member `uri`, but for those of the replaced materials.
    /// An unknown extension may use the key for something else, so an address that is not a file in
    /// the scene's folder is passed over.
    fn extension_files(&self, replaced: &BTreeSet<usize>) -> serde_json::Result<Vec<Resource>> {
        let mut uris = BTreeSet::new();
        let root = Pieces::object(&self.text)?;
        // Buffers and images are in `resources`; of materials some are replaced.
        let apart = ["buffers", "images", "materials"];
        for (_, raw) in root.members().filter(|(key, _)| !apart.contains(key)) {
            take_uris(raw, &mut uris);
        }
        let materials = Pieces::array(root.get("materials").unwrap_or("[]"))?;
        for (index, raw) in materials.values().enumerate() {
            match replaced.contains(&index) {
                true => take_uris(&material::without_extension(raw)?, &mut uris),
                false => take_uris(raw, &mut uris),
            }
        }
        let resources = uris.iter().filter_map(|uri| Resource::new(uri).ok()?);
        Ok(resources.filter(|resource| resource.locate(self.folder()).is_ok()).collect())
    }

    /// The addresses of lookup textures in materials that are not replaced.
    fn lookups(&self, replaced: &BTreeSet<usize>) -> BTreeSet<&str> {
        let kept = self.extensions().filter(|(index, _)| !replaced.contains(index));
        kept.flat_map(|(_, body)| material::lookup_uris(body)).collect()
    }

    /// Where relative addresses start.
    fn folder(&self) -> &Path {
        match &self.source {
            Source::File(_, folder) => folder,
            Source::Built(folder) => folder.as_deref().unwrap_or(Path::new(".")),
        }
    }
}

/// Takes the addresses that members `uri` of a JSON value name.
fn take_uris(raw: &str, uris: &mut BTreeSet<String>) {
    walk::visit(raw, &mut |member| {
        if member.key == "uri" {
            uris.extend(member.text());
        }
    });
}
