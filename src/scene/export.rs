//! A scene and its assignments become files.

use std::{
    collections::{BTreeSet, HashMap, HashSet},
    ffi::OsStr,
    io::{self, Write},
    path::{Path, PathBuf},
    sync::Arc,
};

use base64::{Engine, prelude::BASE64_STANDARD};

use crate::asset::{Asset, Texture};
use crate::encode::{Location, TextureEntry};
use crate::scene::{
    Bytes, Container, Scene, SceneError, SlotId, Source,
    draft::{Draft, data_uri},
    fingerprint, glb,
    material::{self, extensions_of, lookup_uris},
    prune::replaced,
    resource::{Resource, percent_encode},
    text::{Pieces, quote},
};

/// The files and warnings of an export.
#[derive(Debug)]
pub struct Export {
    /// The scene first, then the files that it refers to.
    pub files: Vec<OutputFile>,
    /// Losses, and oddities that are likely not meant.
    pub warnings: Vec<String>,
}

/// A file to be written.
#[derive(Debug)]
pub struct OutputFile {
    /// Where.
    pub path: PathBuf,
    /// Its content, to be concatenated.
    pub pieces: Vec<Bytes>,
    /// True for a file of the input, unchanged.
    pub copy: bool,
}

impl Scene {
    /// The files of the scene with assets in its slots, for `target` (.glb or .gltf, which
    /// may differ from the input's container). Without an asset and in the input's container
    /// the document comes out byte for byte. Files that the document names are part of the export
    /// where the target lies in another folder.
    ///
    /// # Errors
    /// Missing resources, and what [`Container::of`] refuses.
    pub fn export(
        &self,
        assigned: &[(SlotId, &Asset)],
        target: &Path,
    ) -> Result<Export, SceneError> {
        let mut job = Job::new(self, target, &replaced(assigned))?;
        job.assign(assigned)?;
        job.finish(target, !assigned.is_empty())
    }
}

/// A scene on its way to its files.
pub(super) struct Job<'s> {
    scene: &'s Scene,
    container: Container,
    stem: String,
    folder: PathBuf,
    pub draft: Draft<'s>,
    files: Vec<OutputFile>,
    /// File names in the target's folder that are taken.
    names: HashSet<PathBuf>,
    /// Where the bytes of a texture went: its buffer view or its address.
    stored: HashMap<*const u8, Location>,
    pub warnings: Vec<String>,
}

impl<'s> Job<'s> {
    /// The scene in the target's container; the materials in `replaced` get another extension.
    pub fn new(
        scene: &'s Scene,
        target: &Path,
        replaced: &BTreeSet<usize>,
    ) -> Result<Self, SceneError> {
        let container = Container::of(target)?;
        let mut job = Self {
            scene,
            container,
            stem: target.file_stem().and_then(OsStr::to_str).unwrap_or("scene").to_owned(),
            folder: target.parent().unwrap_or(Path::new("")).to_owned(),
            draft: Draft::new(&scene.text, scene.bin.as_ref())?,
            files: Vec::new(),
            names: HashSet::new(),
            stored: HashMap::new(),
            warnings: Vec::new(),
        };
        job.resources(replaced)?;
        job.convert(replaced)?;
        Ok(job)
    }

    /// Files of the scene that stay files are copied along, unless they lie there already.
    fn resources(&mut self, replaced: &BTreeSet<usize>) -> Result<(), SceneError> {
        let mut resources = self.scene.extension_files(replaced)?;
        if self.embeds() {
            let embedded = self.scene.lookups(replaced);
            resources.retain(|resource| !embedded.contains(&&*resource.uri));
        } else {
            resources.extend(self.scene.resources()?);
        }
        let source = self.scene.folder();
        let same = match (source.canonicalize(), self.folder().canonicalize()) {
            (Ok(source), Ok(target)) => source == target,
            _ => false,
        };
        for resource in resources {
            let new = !self.names.contains(&resource.path);
            if new && !same {
                let pieces = vec![Bytes::file(&resource.locate(source)?)?];
                let path = self.folder.join(&resource.path);
                self.files.push(OutputFile { path, pieces, copy: true });
            }
            self.names.insert(resource.path);
        }
        Ok(())
    }

    fn folder(&self) -> &Path {
        if self.folder == Path::new("") { Path::new(".") } else { &self.folder }
    }

    /// Returns whether the input's files move into the target.
    fn embeds(&self) -> bool {
        self.container == Container::Glb
            && !matches!(self.scene.source, Source::File(Container::Glb, _))
    }

    fn convert(&mut self, replaced: &BTreeSet<usize>) -> Result<(), SceneError> {
        match self.container {
            Container::Gltf if self.scene.bin.is_some() => self.unpack_buffer()?,
            Container::Glb if self.embeds() => {
                self.pack_buffers()?;
                self.pack_images()?;
                self.pack_lookups(replaced)?;
            }
            _ => {}
        }
        if self.container == Container::Gltf && self.scene.rest.is_some() {
            self.warnings.push("a .gltf has no place for the .glb's further chunks".into());
        }
        Ok(())
    }

    /// .glb → .gltf: the BIN chunk becomes a file.
    fn unpack_buffer(&mut self) -> Result<(), SceneError> {
        let Some(buffer) = self.scene.outline.buffers.first() else { return Ok(()) };
        if buffer.uri.is_some() {
            return Ok(());
        }
        let length = buffer.byte_length.0;
        let pieces = self.draft.bin.take().unwrap_or_default();
        let pieces = start(pieces, length);
        let name = self.name("bin");
        self.edit_member("buffers", 0, &[("uri", Some(quote(&percent_encode(&name))))])?;
        self.files.push(OutputFile { path: self.folder.join(name), pieces, copy: false });
        Ok(())
    }

    /// .gltf → .glb: the first buffer becomes the BIN chunk, files of others data URIs.
    fn pack_buffers(&mut self) -> Result<(), SceneError> {
        for (index, buffer) in self.scene.outline.buffers.iter().enumerate() {
            let Some(uri) = &buffer.uri else {
                // In a .glb it would stand for the BIN chunk.
                if index == 0 && self.scene.bin.is_none() {
                    return Err(SceneError::NoContent);
                }
                continue;
            };
            let bytes = match Resource::new(uri)? {
                Some(resource) => self.read(&resource)?,
                None if index == 0 => decode_data_uri(uri)?,
                None => continue,
            };
            if bytes.len() < buffer.byte_length.0 {
                let place = format!("buffers[{index}]");
                let lengths = (buffer.byte_length.0, bytes.len());
                let reason = format!("claims {} bytes, its data has {}", lengths.0, lengths.1);
                return Err(SceneError::Invalid(place, reason));
            }
            let bytes = bytes.slice(0..buffer.byte_length.0);
            if index == 0 {
                self.draft.bin = Some(vec![bytes]);
                self.edit_member("buffers", 0, &[("uri", None)])?;
            } else {
                let uri = quote(&data_uri(&[bytes])?);
                self.edit_member("buffers", index, &[("uri", Some(uri))])?;
            }
        }
        Ok(())
    }

    /// .gltf → .glb: image files become buffer views.
    fn pack_images(&mut self) -> Result<(), SceneError> {
        let mut views = HashMap::new();
        for (index, image) in self.scene.outline.images.iter().enumerate() {
            let Some(uri) = &image.uri else { continue };
            let Some(resource) = Resource::new(uri)? else {
                self.pack_data_image(index, uri, image.mime_type.as_deref())?;
                continue;
            };
            let mime = image.mime_type.clone().or_else(|| mime(&resource.path).map(Into::into));
            let mime = mime.ok_or_else(|| {
                let reason = format!("{uri:?} has no mimeType, and its ending tells none");
                SceneError::Invalid(format!("images[{index}]"), reason)
            })?;
            let view = match views.get(&resource.path) {
                Some(view) => *view,
                None => {
                    let bytes = self.read(&resource)?;
                    self.draft.embed(bytes)?
                }
            };
            views.insert(resource.path, view);
            self.place_image(index, &mime, view)?;
        }
        Ok(())
    }

    /// The image of a data URI becomes a buffer view too: a .glb should hold none. What is no such
    /// image stays as it is.
    fn pack_data_image(
        &mut self,
        index: usize,
        uri: &str,
        mime: Option<&str>,
    ) -> Result<(), SceneError> {
        let Some((head, data)) = uri.split_once(";base64,") else { return Ok(()) };
        let mime = mime.or_else(|| head.get("data:".len()..)).filter(|mime| mime.contains('/'));
        let Some((mime, bytes)) = mime.zip(BASE64_STANDARD.decode(data).ok()) else {
            return Ok(());
        };
        let view = self.draft.embed(bytes.into())?;
        self.place_image(index, mime, view)
    }

    fn place_image(&mut self, index: usize, mime: &str, view: usize) -> Result<(), SceneError> {
        let members = [
            ("uri", None),
            ("mimeType", Some(quote(mime))),
            ("bufferView", Some(view.to_string())),
        ];
        self.edit_member("images", index, &members)
    }

    /// .gltf → .glb: files of lookup textures become buffer views.
    fn pack_lookups(&mut self, replaced: &BTreeSet<usize>) -> Result<(), SceneError> {
        let mut places = HashMap::new();
        for uri in self.scene.lookups(replaced) {
            let Ok(Some(resource)) = Resource::new(uri) else { continue };
            match self.read(&resource) {
                Ok(bytes) => {
                    let mime = mime(&resource.path).unwrap_or("application/octet-stream");
                    places.insert(uri, (self.draft.embed(bytes)?, mime));
                }
                Err(problem) => self.warnings.push(problem.to_string()),
            }
        }
        for (index, body) in self.scene.extensions().filter(|(index, _)| !replaced.contains(index))
        {
            if lookup_uris(body).any(|uri| places.contains_key(uri)) {
                self.draft.edit("materials", index, |raw| material::embedded(raw, &places))?;
            }
        }
        Ok(())
    }

    fn read(&self, resource: &Resource) -> Result<Bytes, SceneError> {
        Ok(Bytes::file(&resource.locate(self.scene.folder())?)?)
    }

    fn edit_member(
        &mut self,
        key: &'static str,
        index: usize,
        members: &[(&str, Option<String>)],
    ) -> Result<(), SceneError> {
        self.draft.edit(key, index, |raw| {
            let mut object = Pieces::object(raw)?;
            for (name, value) in members {
                match value {
                    Some(value) => object.set(name, value.clone()),
                    None => drop(object.remove(name)),
                }
            }
            Ok(object.to_text())
        })
    }

    fn assign(&mut self, assigned: &[(SlotId, &Asset)]) -> Result<(), SceneError> {
        // One mark is enough.
        let mut mark = Some(fingerprint::PLACEHOLDER.to_owned());
        for (slot, asset) in assigned {
            let mark = mark.take();
            let textures = self.attach_all(asset)?;
            match slot {
                SlotId::Material(index) => {
                    let warnings = &mut self.warnings;
                    self.draft.edit("materials", *index, |raw| {
                        let losses = material::losses(raw)?.into_iter();
                        warnings.extend(losses.map(|loss| format!("material {index}: {loss}")));
                        material::replace(raw, asset, textures, mark)
                    })?;
                }
                SlotId::Unassigned => {
                    let material = material::replace("{}", asset, textures, mark)?;
                    let index = self.draft.append("materials", material)?;
                    self.assign_bare_primitives(index)?;
                }
            }
            self.draft.declare(extensions_of(asset))?;
        }
        Ok(())
    }

    /// Primitives without a material get the one at `index`.
    fn assign_bare_primitives(&mut self, index: usize) -> Result<(), SceneError> {
        for (at, mesh) in self.scene.outline.meshes.iter().enumerate() {
            let bare: Vec<usize> = (0..mesh.primitives.len())
                .filter(|i| mesh.primitives[*i].material.is_none())
                .collect();
            if bare.is_empty() {
                continue;
            }
            self.draft.edit("meshes", at, |raw| {
                let mut mesh = Pieces::object(raw)?;
                let mut primitives = Pieces::array(mesh.original("primitives").unwrap_or("[]"))?;
                for i in bare {
                    let raw = primitives.item(i).unwrap_or("{}").to_owned();
                    let mut primitive = Pieces::object(&raw)?;
                    primitive.set("material", index.to_string());
                    primitives.replace(i, primitive.to_text());
                }
                mesh.set("primitives", primitives.to_text());
                Ok(mesh.to_text())
            })?;
        }
        Ok(())
    }

    /// The extension's entries for the textures of an asset.
    pub fn attach_all(&mut self, asset: &Asset) -> Result<Vec<TextureEntry>, SceneError> {
        asset.textures.iter().map(|texture| self.attach(texture)).collect()
    }

    /// The extension's entry for a texture whose bytes are stored with the scene, once.
    fn attach(&mut self, texture: &Texture) -> Result<TextureEntry, SceneError> {
        let bytes = Arc::as_ptr(&texture.bytes).cast::<u8>();
        let place = match self.stored.get(&bytes) {
            Some(place) => place.clone(),
            None => self.store(texture)?,
        };
        self.stored.insert(bytes, place.clone());
        Ok(texture.entry.at(place))
    }

    fn store(&mut self, texture: &Texture) -> Result<Location, SceneError> {
        let bytes = Bytes::Memory(texture.bytes.clone());
        match self.container {
            Container::Glb => {
                let buffer_view = self.draft.embed(bytes)?;
                let mime_type = texture.entry.format.mime_type().to_owned();
                Ok(Location::BufferView { buffer_view, mime_type })
            }
            Container::Gltf => {
                let name = self.name(&texture.entry.file_name());
                let path = self.folder.join(&name);
                self.files.push(OutputFile { path, pieces: vec![bytes], copy: false });
                Ok(Location::Uri { uri: percent_encode(&name) })
            }
        }
    }

    /// A free file name in the target's folder: its stem, a number where that is taken, `ending`.
    fn name(&mut self, ending: &str) -> String {
        let names = std::iter::once(format!("{}.{ending}", self.stem))
            .chain((2..).map(|n| format!("{}-{n}.{ending}", self.stem)));
        let mut free = names.filter(|name| !self.names.contains(Path::new(name)));
        let name = free.next().expect("the numbers do not end");
        self.names.insert(PathBuf::from(&name));
        name
    }

    pub fn finish(mut self, target: &Path, assigned: bool) -> Result<Export, SceneError> {
        let (text, bin) = self.draft.finish()?;
        let text = if assigned { fingerprint::mark(text) } else { text };
        let pieces = match self.container {
            Container::Glb => glb::assemble(text, bin, self.scene.rest.clone())?,
            Container::Gltf => vec![text.into_bytes().into()],
        };
        self.files.insert(0, OutputFile { path: target.to_owned(), pieces, copy: false });
        Ok(Export { files: self.files, warnings: self.warnings })
    }
}

/// The media type that a file name's ending tells.
pub(super) fn mime(path: &Path) -> Option<&'static str> {
    let ending = path.extension().and_then(OsStr::to_str)?.to_ascii_lowercase();
    Some(match &*ending {
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        "webp" => "image/webp",
        "avif" => "image/avif",
        "ktx2" => "image/ktx2",
        "dds" => "image/vnd-ms.dds",
        "exr" => "image/x-exr",
        _ => return None,
    })
}

/// The first `length` bytes of the pieces.
fn start(pieces: Vec<Bytes>, mut length: u64) -> Vec<Bytes> {
    let mut start = Vec::with_capacity(pieces.len());
    for piece in pieces {
        let part = piece.len().min(length);
        if part > 0 {
            start.push(piece.slice(0..part));
        }
        length -= part;
    }
    start
}

fn decode_data_uri(uri: &str) -> Result<Bytes, SceneError> {
    let content = uri.split_once(";base64,").map(|(_, content)| content);
    let bytes = content.and_then(|content| BASE64_STANDARD.decode(content).ok());
    match bytes {
        Some(bytes) => Ok(bytes.into()),
        None => {
            let problem = "is not a base64 data URI".to_owned();
            Err(SceneError::Invalid("buffers[0].uri".to_owned(), problem))
        }
    }
}

impl OutputFile {
    /// Bytes that [`OutputFile::write_to`] writes.
    pub fn len(&self) -> u64 {
        self.pieces.iter().map(Bytes::len).sum()
    }

    /// Returns whether there is nothing to write.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Writes the content to `out`.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        self.pieces.iter().try_for_each(|piece| piece.write_to(out))
    }
}
