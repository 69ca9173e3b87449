//! A document while it is changed: the root's members as text, and bytes to be added.

use std::collections::{BTreeMap, btree_map::Entry};

use base64::{Engine, prelude::BASE64_STANDARD};
use serde_json::json;

use crate::scene::{
    Bytes, SceneError, glb,
    text::{Pieces, quote},
};

/// The text of a document under change, and the content of its .glb buffer.
#[derive(Debug)]
pub(super) struct Draft<'s> {
    root: Pieces<'s>,
    margins: [&'s str; 2],
    /// The root arrays that were asked for; each is cut once, however often it is changed.
    arrays: BTreeMap<&'static str, Pieces<'s>>,
    /// Content of the BIN chunk, where there is one.
    pub bin: Option<Vec<Bytes>>,
    embedded: Option<Embedded>,
}

/// Bytes that are added to a buffer.
#[derive(Debug)]
struct Embedded {
    /// The buffer they go to.
    buffer: usize,
    /// The added bytes and their padding.
    pieces: Vec<Bytes>,
    /// Length of the buffer with them.
    length: u64,
}

impl<'s> Draft<'s> {
    pub fn new(text: &'s str, bin: Option<&Vec<Bytes>>) -> serde_json::Result<Self> {
        // `Pieces` drops the white space around the document; `finish` puts it back.
        let (before, rest) = text.split_at(text.len() - text.trim_start().len());
        let after = &rest[rest.trim_end().len()..];
        Ok(Draft {
            root: Pieces::object(text)?,
            margins: [before, after],
            arrays: BTreeMap::new(),
            bin: bin.cloned(),
            embedded: None,
        })
    }

    /// A root array; a missing one is empty.
    pub fn array(&mut self, key: &'static str) -> serde_json::Result<&mut Pieces<'s>> {
        Ok(match self.arrays.entry(key) {
            Entry::Occupied(array) => array.into_mut(),
            Entry::Vacant(place) => {
                place.insert(Pieces::array(self.root.original(key).unwrap_or("[]"))?)
            }
        })
    }

    /// Changes one element of a root array.
    pub fn edit(
        &mut self,
        key: &'static str,
        index: usize,
        change: impl FnOnce(&str) -> serde_json::Result<String>,
    ) -> Result<(), SceneError> {
        let array = self.array(key)?;
        let raw = array.item(index).ok_or_else(|| absent(key, index))?;
        let text = change(raw)?;
        array.replace(index, text);
        Ok(())
    }

    /// Adds an element to a root array and returns its index.
    pub fn append(&mut self, key: &'static str, item: String) -> serde_json::Result<usize> {
        let array = self.array(key)?;
        array.push(item);
        Ok(array.len() - 1)
    }

    /// Names extensions in `extensionsUsed`, each once.
    pub fn declare<'n>(
        &mut self,
        extensions: impl Iterator<Item = &'n str>,
    ) -> serde_json::Result<()> {
        let used = self.array("extensionsUsed")?;
        for name in extensions {
            let quoted = quote(name);
            if !used.values().any(|value| value == quoted) {
                used.push(quoted);
            }
        }
        Ok(())
    }

    /// Appends `bytes` to the BIN chunk and returns the index of their buffer view.
    /// Where the first buffer is a file of its own, a new buffer with a data URI takes them.
    pub fn embed(&mut self, bytes: Bytes) -> serde_json::Result<usize> {
        let has_bin = self.bin.is_some();
        let buffers = self.array("buffers")?;
        // BIN is the content of the first buffer, and only where that has no address. A document
        // without buffers gets one for it.
        let own_file = match buffers.item(0) {
            Some(first) => !has_bin || Pieces::object(first)?.get("uri").is_some(),
            None => false,
        };
        let buffer = if own_file { buffers.len() } else { 0 };
        let bin = self.bin.iter().flatten().filter(|_| !own_file);
        // The chunk with its padding, which may be longer than the `byteLength` of the buffer.
        let length = bin.map(Bytes::len).sum();
        let embedded = self.embedded.get_or_insert(Embedded { buffer, pieces: Vec::new(), length });
        let padding = vec![0; glb::padding(embedded.length)];
        let offset = embedded.length + padding.len() as u64;
        embedded.length = offset + bytes.len();
        let view =
            json!({"buffer": embedded.buffer, "byteOffset": offset, "byteLength": bytes.len()});
        embedded.pieces.extend([padding.into(), bytes]);
        self.append("bufferViews", view.to_string())
    }

    /// The finished text and the content of the BIN chunk.
    pub fn finish(mut self) -> Result<(String, Option<Vec<Bytes>>), SceneError> {
        if let Some(embedded) = self.embedded.take() {
            self.store(embedded)?;
        }
        for (key, array) in self.arrays {
            let text = array.to_text();
            // glTF has no empty arrays: one that is missing and got nothing is not added.
            if text != self.root.original(key).unwrap_or("[]") {
                self.root.set(key, text);
            }
        }
        let [before, after] = self.margins;
        Ok((format!("{before}{}{after}", self.root.to_text()), self.bin))
    }

    /// Adds the embedded bytes to the buffer they were meant for.
    fn store(&mut self, embedded: Embedded) -> Result<(), SceneError> {
        let Embedded { buffer, pieces, length } = embedded;
        let buffers = self.array("buffers")?.len();
        // The first buffer is there, and BIN grows behind it.
        if buffer < buffers {
            self.edit("buffers", buffer, |raw| {
                let mut buffer = Pieces::object(raw)?;
                buffer.set("byteLength", length.to_string());
                Ok(buffer.to_text())
            })?;
        } else if buffer > 0 {
            // A further buffer needs an address, as BIN serves the first alone.
            let uri = data_uri(&pieces)?;
            self.append("buffers", json!({"byteLength": length, "uri": uri}).to_string())?;
            return Ok(());
        } else {
            self.append("buffers", json!({"byteLength": length}).to_string())?;
        }
        self.bin.get_or_insert_default().extend(pieces);
        Ok(())
    }
}

fn absent(key: &str, index: usize) -> SceneError {
    SceneError::Invalid(format!("{key}[{index}]"), "is not there".into())
}

/// Bytes as a data URI.
pub(super) fn data_uri(pieces: &[Bytes]) -> Result<String, SceneError> {
    let mut bytes = Vec::new();
    for piece in pieces {
        piece.write_to(&mut bytes)?;
    }
    Ok(format!("data:application/octet-stream;base64,{}", BASE64_STANDARD.encode(bytes)))
}
