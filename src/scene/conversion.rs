//! From one container into another: files become parts of the .glb, or the other way round.

use std::collections::{BTreeSet, HashMap};
use std::ffi::OsStr;
use std::path::Path;

use base64::{Engine as _, prelude::BASE64_STANDARD};

use crate::scene::draft::data_uri;
use crate::scene::job::Job;
use crate::scene::material::{self, lookup_uris};
use crate::scene::output_file::OutputFile;
use crate::scene::resource::{Resource, percent_encode};
use crate::scene::text::quote;
use crate::scene::{Bytes, Container, Scene, SceneError};

impl Scene {
    /// The scene in the target's container; the materials in `replaced` get another extension.
    ///
    /// # Errors
    /// Missing resources, and what [`Container::of`] refuses.
    pub(super) fn job(
        &self,
        target: &Path,
        replaced: &BTreeSet<usize>,
    ) -> Result<Job<'_>, SceneError> {
        let mut job = Job::new(self, target, replaced)?;
        job.convert(replaced)?;
        Ok(job)
    }
}

impl Job<'_> {
    fn convert(&mut self, replaced: &BTreeSet<usize>) -> Result<(), SceneError> {
        match self.container {
            Container::Gltf if self.scene.bin.is_some() => self.unpack_buffer()?,
            Container::Glb if self.embeds() => {
                self.pack_buffers()?;
                self.pack_images()?;
                self.pack_lookups(replaced)?;
            }
            // Within one container everything stays where it is.
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
        // Without the padding of the chunk.
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
                // A data URI may stay one: a .glb has room for one buffer only.
                None => continue,
            };
            // `check` measures files, not data URIs; and a file may have changed since.
            if bytes.len() < buffer.byte_length.0 {
                let place = format!("buffers[{index}]");
                let lengths = (buffer.byte_length.0, bytes.len());
                let reason = format!("claims {} bytes, its data has {}", lengths.0, lengths.1);
                return Err(SceneError::Invalid(place, reason));
            }
            // A file may be longer; what the buffer does not claim is not part of the scene.
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
            // glTF requires a media type beside a buffer view.
            let mime = mime.ok_or_else(|| {
                let reason = format!("{uri:?} has no mimeType, and its ending tells none");
                SceneError::Invalid(format!("images[{index}]"), reason)
            })?;
            // Several images may name one file.
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

    /// The image of a data URI becomes a buffer view too: a .glb should hold none. Anything
    /// else stays as it is.
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
                // The glTF material shows without them, so the export goes on.
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
