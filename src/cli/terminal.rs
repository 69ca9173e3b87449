//! Text from files, made safe for a terminal.

use std::borrow::Cow;
use std::fmt::Write as _;

/// Returns whether a terminal may act on a character instead of showing it: control characters, and
/// those that turn the direction of writing.
fn acts(c: char) -> bool {
    c.is_control()
        // Marks, embeddings, overrides and isolates of the Unicode bidirectional algorithm.
        || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// `text` with such characters as escapes; line breaks and tabs stay.
pub fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, |c| acts(c) && !matches!(c, '\n' | '\t'))
}

/// A name on one line: line breaks and tabs are escapes too.
pub fn name(text: &str) -> Cow<'_, str> {
    escaped(text, acts)
}

fn escaped(text: &str, acts: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&acts) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if acts(c) {
            escaped.extend(c.escape_default());
        } else {
            escaped.push(c);
        }
    }
    Cow::Owned(escaped)
}

/// JSON text with such characters written as escapes.
pub fn printable_json(json: &str) -> Cow<'_, str> {
    if !json.contains(acts) {
        return Cow::Borrowed(json);
    }
    let mut text = String::with_capacity(json.len());
    for c in json.chars() {
        if acts(c) {
            // All of them are in the first plane, so one escape is enough.
            let _ = write!(text, "\\u{:04x}", u32::from(c));
        } else {
            text.push(c);
        }
    }
    Cow::Owned(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terminal_sees_no_escape_sequence() {
        let hostile = "\u{1b}[31mred\u{9b}2J\u{7}\r\u{202e}";
        let shown = r"\u{1b}[31mred\u{9b}2J\u{7}\r\u{202e}";
        assert_eq!(printable(hostile), shown);
        assert_eq!(printable("a\tb\nc é €"), "a\tb\nc é €");
        assert_eq!(name("a\tb\nc"), r"a\tb\nc");
    }

    #[test]
    fn json_means_the_same() {
        let value = serde_json::Value::from("a\u{1b}\u{7f}\u{9b}\u{202e}é");
        let text = value.to_string();
        let shown = printable_json(&text);
        assert!(!shown.contains(acts));
        assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).ok(), Some(value));
    }
}
