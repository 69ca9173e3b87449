//! A scene on its way to the files of an export.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::asset::{Asset, Texture};
use crate::encode::{Location, TextureEntry};
use crate::scene::draft::Draft;
use crate::scene::output_file::{Export, OutputFile};
use crate::scene::resource::{Resource, percent_encode};
use crate::scene::text::Pieces;
use crate::scene::{Bytes, Container, Scene, SceneError, Source, fingerprint, glb};

/// A scene on its way to its files.
pub(super) struct Job<'s> {
    pub scene: &'s Scene,
    pub container: Container,
    stem: String,
    pub folder: PathBuf,
    pub draft: Draft<'s>,
    pub files: Vec<OutputFile>,
    /// File names in the target's folder that are taken.
    names: HashSet<PathBuf>,
    /// Where the bytes of a texture went: its buffer view or its address.
    stored: HashMap<*const u8, Location>,
    pub warnings: Vec<String>,
}

impl<'s> Job<'s> {
    /// The scene as it is; the materials in `replaced` get another extension.
    pub fn new(
        scene: &'s Scene,
        target: &Path,
        replaced: &BTreeSet<usize>,
    ) -> Result<Self, SceneError> {
        let container = Container::of(target)?;
        let mut job = Self {
            scene,
            container,
            // Other files are named after the target, and addresses must be UTF-8.
            stem: target.file_stem().and_then(OsStr::to_str).unwrap_or("scene").to_owned(),
            folder: target.parent().unwrap_or(Path::new("")).to_owned(),
            draft: Draft::new(&scene.text, scene.bin.as_ref())?,
            files: Vec::new(),
            names: HashSet::new(),
            stored: HashMap::new(),
            warnings: Vec::new(),
        };
        job.resources(replaced)?;
        Ok(job)
    }

    /// Files of the scene that stay files are copied along, unless they lie there already.
    fn resources(&mut self, replaced: &BTreeSet<usize>) -> Result<(), SceneError> {
        let mut resources = self.scene.extension_files(replaced)?;
        // Files that move into the .glb are not copied; those of unknown extensions stay files.
        if self.embeds() {
            let embedded = self.scene.lookups(replaced);
            resources.retain(|resource| !embedded.contains(&&*resource.uri));
        } else {
            resources.extend(self.scene.resources()?);
        }
        let source = self.scene.folder();
        // A target folder that cannot be found is yet to be made, and so another one.
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
            // Even where the file lies there already: no texture may get its name.
            self.names.insert(resource.path);
        }
        Ok(())
    }

    pub fn folder(&self) -> &Path {
        if self.folder == Path::new("") { Path::new(".") } else { &self.folder }
    }

    /// Returns whether the input's files move into the target.
    pub fn embeds(&self) -> bool {
        self.container == Container::Glb
            && !matches!(self.scene.source, Source::File(Container::Glb, _))
    }

    pub fn read(&self, resource: &Resource) -> Result<Bytes, SceneError> {
        Ok(Bytes::file(&resource.locate(self.scene.folder())?)?)
    }

    pub fn edit_member(
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

    /// The extension's entries for the textures of an asset.
    pub fn attach_all(&mut self, asset: &Asset) -> Result<Vec<TextureEntry>, SceneError> {
        asset.textures.iter().map(|texture| self.attach(texture)).collect()
    }

    /// The extension's entry for a texture whose bytes are stored with the scene, once.
    fn attach(&mut self, texture: &Texture) -> Result<TextureEntry, SceneError> {
        // The job keeps the bytes, so that no other texture comes to lie at this address.
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
    pub fn name(&mut self, ending: &str) -> String {
        let names = std::iter::once(format!("{}.{ending}", self.stem))
            .chain((2..).map(|n| format!("{}-{n}.{ending}", self.stem)));
        let mut free = names.filter(|name| !self.names.contains(Path::new(name)));
        let name = free.next().expect("the numbers do not end");
        self.names.insert(PathBuf::from(&name));
        name
    }

    pub fn finish(mut self, target: &Path, assigned: bool) -> Result<Export, SceneError> {
        let (text, bin) = self.draft.finish()?;
        // A document without an assignment comes out byte for byte.
        let text = if assigned { fingerprint::mark(text) } else { text };
        let pieces = match self.container {
            Container::Glb => glb::assemble(text, bin, self.scene.rest.clone())?,
            Container::Gltf => vec![text.into_bytes().into()],
        };
        self.files.insert(0, OutputFile { path: target.to_owned(), pieces, copy: false });
        Ok(Export { files: self.files, warnings: self.warnings })
    }
}
