//! Images and lookup textures that only replaced materials showed are taken out. No array gets
//! shorter and no index changes, so that extensions this crate does not know stay right: a texture
//! keeps its place, its image becomes a placeholder of one pixel, and the bytes leave the buffer.

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::Range,
};

use base64::{Engine as _, prelude::BASE64_STANDARD};

use crate::asset::Asset;
use crate::scene::{
    Bytes, Scene, SceneError, SlotId,
    draft::Draft,
    material,
    outline::Outline,
    text::{Pieces, quote},
    walk::{self, Member},
};

/// A white PNG of one pixel.
const PIXEL: &[u8] =
    b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01\0\0\0\x01\x08\0\0\0\0:~\x9bU\0\0\0\nIDAT\
    x\x9cc\xf8\x0f\0\x01\x01\x01\0\xb18\xf6\x14\0\0\0\0IEND\xaeB`\x82";

/// Bytes are taken out in runs of whole multiples of this, so that what follows stays aligned.
const ALIGNMENT: u64 = 8;

impl Scene {
    /// The scene without the images and lookup textures that, of all materials, only those about
    /// to be replaced show.
    ///
    /// # Errors
    /// Materials that are not valid JSON objects.
    pub fn pruned(self, assigned: &[(SlotId, &Asset)]) -> Result<Self, SceneError> {
        let images = self.unused_images(assigned)?;
        self.without_content(&images, &replaced(assigned))
    }

    /// The scene without these images, and without the lookup textures that only these materials
    /// have.
    pub(super) fn without_content(
        self,
        images: &BTreeSet<usize>,
        replaced: &BTreeSet<usize>,
    ) -> Result<Self, SceneError> {
        let released = self.released(images, replaced);
        if images.is_empty() && released.is_empty() {
            return Ok(self);
        }
        // The bytes leave before the draft is made, so that the placeholder goes behind what stays.
        let holes = self.holes(&released);
        let (mut bin, mut removed) = (self.bin.clone(), 0);
        if let (Some(pieces), false) = (&mut bin, holes.is_empty()) {
            let all: u64 = pieces.iter().map(Bytes::len).sum();
            *pieces = without(pieces, &holes);
            removed = all - pieces.iter().map(Bytes::len).sum::<u64>();
        }
        let mut draft = Draft::new(&self.text, bin.as_ref())?;
        if removed > 0 {
            move_views(draft.array("bufferViews")?, &self.outline, &holes)?;
            let length = self.outline.buffers[0].byte_length.0 - removed;
            draft.edit("buffers", 0, |raw| {
                let mut buffer = Pieces::object(raw)?;
                buffer.set("byteLength", length.to_string());
                Ok(buffer.to_text())
            })?;
        }
        // A .glb should hold no data URIs, and a .gltf has no buffer that is sure to be writable.
        let pixel = match &draft.bin {
            Some(_) if !images.is_empty() => Some(draft.embed(PIXEL.to_vec().into())?),
            _ => None,
        };
        for index in images {
            draft.edit("images", *index, |raw| placeholder(raw, pixel))?;
        }
        let (text, bin) = draft.finish()?;
        let warnings = self.warnings;
        Ok(Scene { warnings, ..Scene::new(text, bin, self.rest, self.source)? })
    }

    /// Images of textures that replaced materials let go of, and that nothing else shows.
    fn unused_images(&self, assigned: &[(SlotId, &Asset)]) -> Result<BTreeSet<usize>, SceneError> {
        let mut replaced: BTreeMap<usize, &Asset> = BTreeMap::new();
        replaced.extend(assigned.iter().filter_map(|(slot, r)| Some((slot.index()?, *r))));
        let root = Pieces::object(&self.text)?;
        let materials = Pieces::array(root.get("materials").unwrap_or("[]"))?;
        // Textures that replaced materials show, and those that any material shows afterwards.
        let (mut before, mut after) = (BTreeSet::new(), BTreeSet::new());
        for (index, raw) in materials.values().enumerate() {
            match replaced.get(&index) {
                Some(asset) => {
                    before.extend(textures(raw));
                    // The replacement keeps the normal, occlusion and emissive textures.
                    after.extend(textures(&material::replace(raw, asset, Vec::new(), None)?));
                }
                None => after.extend(textures(raw)),
            }
        }
        let all = Pieces::array(root.get("textures").unwrap_or("[]"))?;
        let (mut gone, mut kept) = (BTreeSet::new(), BTreeSet::new());
        for (index, raw) in all.values().enumerate() {
            let index = index as u64;
            // A texture that no material shows is left alone: an unknown extension may show it.
            let unused = before.contains(&index) && !after.contains(&index);
            if unused { &mut gone } else { &mut kept }.extend(sources(raw));
        }
        // Two textures may show one image.
        let images = gone.difference(&kept).filter_map(|image| usize::try_from(*image).ok());
        Ok(images.filter(|image| *image < self.outline.images.len()).collect())
    }

    /// The buffer view of each image, and of each lookup texture of a replaced material.
    fn released(&self, images: &BTreeSet<usize>, replaced: &BTreeSet<usize>) -> Vec<u64> {
        let mut views: Vec<u64> = images
            .iter()
            .filter_map(|image| Some(self.outline.images[*image].buffer_view?.0))
            .collect();
        for (_, body) in self.extensions().filter(|(index, _)| replaced.contains(index)) {
            views.extend(numbers(&body.to_string(), |member| member.key == "bufferView"));
        }
        views
    }

    /// Ranges of the first buffer that only buffer views cover whose every use is in `released`.
    /// The first bytes stay, as a buffer must not be empty.
    fn holes(&self, released: &[u64]) -> Vec<Range<u64>> {
        let outline = &self.outline;
        let mut users: BTreeMap<u64, usize> = BTreeMap::new();
        // Every member `bufferView` is a use, also in extensions that are not known.
        for view in numbers(&self.text, |member| member.key == "bufferView") {
            *users.entry(view).or_default() += 1;
        }
        for view in released {
            users.entry(*view).and_modify(|count| *count -= 1);
        }
        let views: BTreeSet<u64> =
            users.into_iter().filter(|(_, count)| *count == 0).map(|(view, _)| view).collect();
        let mut ranges = Vec::new();
        for (index, view) in outline.buffer_views.iter().enumerate() {
            if view.buffer.0 == 0 {
                let gone = views.contains(&(index as u64));
                ranges.push((gone, view.byte_offset.0, view.byte_length.0));
            }
            let compressed = view.extensions.compressed().filter(|c| c.buffer.0 == 0);
            // Compressed geometry is read from a range of its own, which stays.
            ranges.extend(compressed.map(|c| (false, c.byte_offset.0, c.byte_length.0)));
        }
        let mut holes: Vec<Range<u64>> = ranges
            .iter()
            .filter(|(gone, ..)| *gone)
            .map(|(_, start, length)| {
                // `check` has seen that the sum does not overflow.
                let end = (start + length) / ALIGNMENT * ALIGNMENT;
                start.max(&1).next_multiple_of(ALIGNMENT)..end
            })
            .filter(|hole| hole.start < hole.end)
            // Views may overlap: a hole that holds bytes of another view is dropped.
            .filter(|hole| !ranges.iter().any(|(gone, s, n)| !gone && overlap(hole, *s, *n)))
            .collect();
        holes.sort_by_key(|hole| hole.start);
        // Merged, so that `moved` counts each byte once. `dedup_by` passes the later hole first.
        holes.dedup_by(|next, hole| {
            let merged = next.start <= hole.end;
            if merged {
                hole.end = hole.end.max(next.end);
            }
            merged
        });
        holes
    }
}

/// The materials of the document that are replaced.
pub(super) fn replaced(assigned: &[(SlotId, &Asset)]) -> BTreeSet<usize> {
    assigned.iter().filter_map(|(slot, _)| slot.index()).collect()
}

/// The image's text with the placeholder in place of its content: in a buffer view, or as a data
/// URI.
fn placeholder(raw: &str, view: Option<usize>) -> serde_json::Result<String> {
    let mut image = Pieces::object(raw)?;
    image.remove("bufferView");
    image.remove("uri");
    image.set("mimeType", quote("image/png"));
    match view {
        Some(view) => image.set("bufferView", view.to_string()),
        None => {
            let data = BASE64_STANDARD.encode(PIXEL);
            image.set("uri", quote(&format!("data:image/png;base64,{data}")));
        }
    }
    Ok(image.to_text())
}

/// Texture indices in a material: `index` of every member whose name ends in `Texture`.
fn textures(material: &str) -> Vec<u64> {
    numbers(material, |member| {
        member.key == "index" && member.parent.is_some_and(|parent| parent.ends_with("Texture"))
    })
}

/// Image indices in a texture: its own `source` and those of its extensions.
fn sources(texture: &str) -> Vec<u64> {
    numbers(texture, |member| member.key == "source")
}

/// The numbers of the members that `wanted` picks.
fn numbers(text: &str, wanted: impl Fn(&Member<'_>) -> bool) -> Vec<u64> {
    let mut found = Vec::new();
    walk::visit(text, &mut |member| {
        found.extend(member.index().filter(|_| wanted(member)));
    });
    found
}

/// The pieces without the holes, which are in order and apart.
fn without(pieces: &[Bytes], holes: &[Range<u64>]) -> Vec<Bytes> {
    let mut kept = Vec::new();
    let mut start = 0;
    for piece in pieces {
        let end = start + piece.len();
        let mut from = start;
        for hole in holes.iter().filter(|hole| hole.start < end && start < hole.end) {
            if from < hole.start {
                kept.push(piece.clone().slice(from - start..hole.start - start));
            }
            // The hole may go on in the next piece.
            from = hole.end.clamp(from, end);
        }
        if from < end {
            kept.push(piece.clone().slice(from - start..end - start));
        }
        start = end;
    }
    kept
}

/// Returns whether a range of bytes and another, of `length` bytes, share any.
fn overlap(a: &Range<u64>, start: u64, length: u64) -> bool {
    a.start < start.saturating_add(length) && start < a.end
}

/// The place of a byte once the holes before it are gone.
fn moved(holes: &[Range<u64>], offset: u64) -> u64 {
    // A hole behind the offset counts nothing; one that contains it counts up to it.
    let before = holes.iter().map(|hole| hole.end.min(offset).saturating_sub(hole.start));
    offset - before.sum::<u64>()
}

/// Moves every view of the first buffer down by the holes before it. A view of a hole shrinks to
/// one byte.
fn move_views(
    views: &mut Pieces<'_>,
    outline: &Outline,
    holes: &[Range<u64>],
) -> serde_json::Result<()> {
    for (index, view) in outline.buffer_views.iter().enumerate() {
        let raw = views.item(index).unwrap_or("{}").to_owned();
        let mut object = Pieces::object(&raw)?;
        let range = view.byte_offset.0..view.byte_offset.0 + view.byte_length.0;
        // A view that does not move keeps its text, and so a missing `byteOffset`.
        if view.buffer.0 == 0 && moved(holes, range.start) != range.start {
            object.set("byteOffset", moved(holes, range.start).to_string());
        }
        if view.buffer.0 == 0
            && holes.iter().any(|hole| hole.start < range.end && range.start < hole.end)
        {
            // Nothing reads it any more, but it must stay valid, and an empty view is not.
            object.set("byteOffset", "0");
            object.set("byteLength", "1");
        }
        if let Some(c) = view.extensions.compressed().filter(|c| c.buffer.0 == 0) {
            // The compressed bytes have a place of their own, which moves too.
            let offset = moved(holes, c.byte_offset.0).to_string();
            let raw = object.get("extensions").unwrap_or("{}").to_owned();
            let mut extensions = Pieces::object(&raw)?;
            for name in crate::scene::outline::COMPRESSION {
                if let Some(raw) = extensions.get(name).map(str::to_owned) {
                    let mut body = Pieces::object(&raw)?;
                    body.set("byteOffset", offset.clone());
                    extensions.set(name, body.to_text());
                }
            }
            object.set("extensions", extensions.to_text());
        }
        views.replace(index, object.to_text());
    }
    Ok(())
}
