//! A document while it is changed: the root's members as text, and bytes to be added.

use base64::{Engine, prelude::BASE64_STANDARD};
use serde_json::{Value, json};

use super::{Bytes, SceneError, glb, text::Pieces};

/// The text of a document under change, and the content of its .glb buffer.
#[derive(Debug)]
pub(super) struct Draft<'s> {
    root: Pieces<'s>,
    margins: [&'s str; 2],
    /// Content of the BIN chunk; what is embedded follows it.
    pub bin: Option<Vec<Bytes>>,
    views: Vec<Value>,
    /// Set when the first buffer is not the BIN chunk: embedded bytes go to a new data URI.
    inline: Option<Vec<Bytes>>,
}

impl<'s> Draft<'s> {
    pub fn new(text: &'s str, bin: Option<&Vec<Bytes>>) -> serde_json::Result<Self> {
        let (before, rest) = text.split_at(text.len() - text.trim_start().len());
        let after = &rest[rest.trim_end().len()..];
        Ok(Draft {
            root: Pieces::object(text)?,
            margins: [before, after],
            bin: bin.cloned(),
            views: Vec::new(),
            inline: None,
        })
    }

    /// Changes the elements of a root array; a missing one counts as empty.
    pub fn edit<R>(
        &mut self,
        key: &str,
        change: impl FnOnce(&mut Pieces<'_>) -> Result<R, SceneError>,
    ) -> Result<R, SceneError> {
        let raw = self.root.get(key).unwrap_or("[]").to_owned();
        let mut array = Pieces::array(&raw)?;
        let result = change(&mut array)?;
        let text = array.to_text();
        if text != raw {
            self.root.set(key, text);
        }
        Ok(result)
    }

    /// Changes one object of a root array.
    pub fn edit_item(
        &mut self,
        key: &str,
        index: usize,
        change: impl FnOnce(&str) -> serde_json::Result<String>,
    ) -> Result<(), SceneError> {
        self.edit(key, |array| {
            let raw = array.values().nth(index).map(str::to_owned);
            let raw = raw.ok_or_else(|| absent(key, index))?;
            array.replace(index, change(&raw)?);
            Ok(())
        })
    }

    /// Adds an element to a root array and says its index.
    pub fn append(&mut self, key: &str, item: String) -> Result<usize, SceneError> {
        self.edit(key, |array| {
            array.push(item);
            Ok(array.len() - 1)
        })
    }

    /// Names extensions in `extensionsUsed`, each once.
    pub fn declare(&mut self, extensions: &[&str]) -> Result<(), SceneError> {
        self.edit("extensionsUsed", |used| {
            for name in extensions {
                let quoted = super::text::quote(name);
                if !used.values().any(|value| value == quoted) {
                    used.push(quoted);
                }
            }
            Ok(())
        })
    }

    /// Puts `bytes` behind the BIN chunk and says the index of the buffer view made for them.
    /// Where the first buffer is a file of its own, a new buffer with a data URI takes them.
    pub fn embed(&mut self, bytes: Bytes) -> Result<usize, SceneError> {
        let (views, buffers) = (self.count("bufferViews")?, self.count("buffers")?);
        if self.bin.is_none() && buffers > 0 {
            self.inline.get_or_insert_default();
        }
        let buffer = if self.inline.is_some() { buffers } else { 0 };
        let store = match &mut self.inline {
            Some(inline) => inline,
            None => self.bin.get_or_insert_default(),
        };
        let end: u64 = store.iter().map(Bytes::len).sum();
        let padding = vec![0; glb::padding(end)];
        let offset = end + padding.len() as u64;
        self.views.push(json!({"buffer": buffer, "byteOffset": offset, "byteLength": bytes.len()}));
        store.extend([padding.into(), bytes]);
        Ok(views + self.views.len() - 1)
    }

    fn count(&self, key: &str) -> Result<usize, SceneError> {
        Ok(Pieces::array(self.root.get(key).unwrap_or("[]"))?.len())
    }

    /// The finished text and the content of the BIN chunk.
    pub fn finish(mut self) -> Result<(String, Option<Vec<Bytes>>), SceneError> {
        if !self.views.is_empty() {
            let views = std::mem::take(&mut self.views);
            self.edit("bufferViews", |array| {
                views.iter().for_each(|view| array.push(view.to_string()));
                Ok(())
            })?;
            self.resize_buffer()?;
        }
        let [before, after] = self.margins;
        Ok((format!("{before}{}{after}", self.root.to_text()), self.bin))
    }

    fn resize_buffer(&mut self) -> Result<(), SceneError> {
        let store = self.inline.as_ref().or(self.bin.as_ref());
        let length: u64 = store.into_iter().flatten().map(Bytes::len).sum();
        if let Some(inline) = &self.inline {
            let uri = data_uri(inline)?;
            self.append("buffers", json!({"byteLength": length, "uri": uri}).to_string())?;
        } else if self.count("buffers")? == 0 {
            self.append("buffers", json!({"byteLength": length}).to_string())?;
        } else {
            self.edit_item("buffers", 0, |raw| {
                let mut buffer = Pieces::object(raw)?;
                buffer.set("byteLength", length.to_string());
                Ok(buffer.to_text())
            })?;
        }
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
