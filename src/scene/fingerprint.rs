//! A mark by which an exported scene is told from one that was edited since: a hash of the
//! document, kept in the extension of one of its materials.

use crate::asset::{EXTENSION, fingerprint};
use crate::scene::walk;

/// The mark before the hash is known, and in its place while it is computed: as long as a hash.
pub(super) const PLACEHOLDER: &str = "0000000000000000";

/// The document, which an export has put the placeholder into, with its hash in that place.
pub(super) fn mark(text: String) -> String {
    let placeholder = member(PLACEHOLDER);
    // Where the scene itself holds the placeholder too, no mark is set, or its text would change.
    if text.matches(&placeholder).count() != 1 {
        return text;
    }
    let hash = fingerprint(&text);
    text.replace(&placeholder, &member(&hash))
}

/// The mark as it is written, without spaces.
fn member(mark: &str) -> String {
    format!(r#""document":"{mark}""#)
}

/// Returns whether a glTF document is an export of sgdbake that nobody edited since; `None` where
/// it carries no mark. `text` must be valid JSON. Marks of earlier exports may stand in it too.
#[must_use]
pub fn is_unedited(text: &str) -> Option<bool> {
    let marks = marks(text);
    (!marks.is_empty()).then(|| marks.iter().any(|mark| is_mark_of(mark, text)))
}

/// Returns whether a mark is the fingerprint of the document that it stands in.
fn is_mark_of(mark: &str, text: &str) -> bool {
    // A document that was spaced anew does not hold this spelling, and counts as edited.
    fingerprint(&text.replace(&member(mark), &member(PLACEHOLDER))) == mark
}

/// The marks of all materials.
fn marks(text: &str) -> Vec<String> {
    let mut marks = Vec::new();
    walk::visit(text, &mut |member| {
        if member.parent == Some(EXTENSION) && member.key == "document" {
            marks.extend(member.text().filter(|mark| !mark.is_empty()));
        }
    });
    marks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edit_shows() {
        let text = format!(
            r#"{{"materials":[{{"extensions":{{"{EXTENSION}":{{"document":"{PLACEHOLDER}"}}}}}}],"x":1.{PLACEHOLDER}}}"#
        );
        let marked = mark(text.clone());
        assert_ne!(marked, text);
        assert_eq!(is_unedited(&format!("{marked}  ")), Some(true));
        assert_eq!(is_unedited(&marked.replace("],", "], \"nodes\": [],")), Some(false));
        assert_eq!(is_unedited(&text), Some(false));
        assert_eq!(is_unedited("{}"), None);
    }
}
