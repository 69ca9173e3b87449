//! A walk over JSON text that visits every scalar member, however deep it is.
//!
//! The text is followed without recursion, as scenes may nest deeper than a parser of values
//! follows.

use std::borrow::Cow;

/// A member of an object, with a string, number, boolean or null as its value.
#[derive(Debug)]
pub(super) struct Member<'a> {
    /// The key of the object itself, where it is a member of another one.
    pub parent: Option<&'a str>,
    /// The member's key.
    pub key: &'a str,
    value: &'a str,
}

impl Member<'_> {
    /// The value, where it is a string.
    pub fn text(&self) -> Option<String> {
        serde_json::from_str(self.value).ok()
    }

    /// The value, where it is a whole number ≥ 0.
    pub fn index(&self) -> Option<u64> {
        self.value.parse().ok()
    }
}

/// Calls `found` with every scalar member of `text`, which must be valid JSON.
pub(super) fn visit(text: &str, found: &mut impl FnMut(&Member<'_>)) {
    // Keys of the open objects and arrays; an element of an array has none.
    let mut open: Vec<Option<Cow<'_, str>>> = Vec::new();
    let mut key = None;
    let mut rest = text;
    while let Some(start) = rest.find(|c: char| !c.is_ascii_whitespace() && !",:".contains(c)) {
        rest = &rest[start..];
        match rest.as_bytes()[0] {
            b'{' | b'[' => {
                open.push(key.take());
                rest = &rest[1..];
            }
            b'}' | b']' => {
                open.pop();
                rest = &rest[1..];
            }
            _ => {
                let (token, after) = rest.split_at(token_length(rest));
                rest = after;
                // A string before a colon is a key, any other token a value.
                if after.trim_start().starts_with(':') {
                    key = Some(string(token));
                } else if let Some(key) = key.take() {
                    let parent = open.last().and_then(Option::as_deref);
                    found(&Member { parent, key: &key, value: token });
                }
            }
        }
    }
}

/// The bytes of the string, number or word that `text` starts with.
fn token_length(text: &str) -> usize {
    if !text.starts_with('"') {
        return text
            .find(|c: char| c.is_ascii_whitespace() || ",:]}".contains(c))
            .unwrap_or(text.len());
    }
    let mut escaped = false;
    let closing = text.bytes().skip(1).position(|byte| {
        let closes = byte == b'"' && !escaped;
        escaped = byte == b'\\' && !escaped;
        closes
    });
    // `before` counts from behind the opening quote: both quotes are added.
    closing.map_or(text.len(), |before| before + 2)
}

fn string(token: &str) -> Cow<'_, str> {
    // A key with half a surrogate pair cannot be decoded and stays as it is spelled.
    serde_json::from_str(token).map_or(Cow::Borrowed(token), Cow::Owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scalar_member_is_visited_with_its_keys() {
        let text =
            r#"{"a": 1, "b" :{"uri":"x\"}y","c":[{"d":2},3,"e",[{"\u0066":null}]]}, "g":{}}"#;
        let mut members = Vec::new();
        visit(text, &mut |member| {
            members.push(format!("{:?} {} {}", member.parent, member.key, member.value));
        });
        let expected = ["None a 1", r#"Some("b") uri "x\"}y""#, "None d 2", "None f null"];
        assert_eq!(members, expected);
    }

    #[test]
    fn depth_costs_no_stack() {
        let depth = 1_000_000;
        let text = "{\"a\":[".repeat(depth) + "{\"uri\":\"deep\"}" + &"]}".repeat(depth);
        let mut found = Vec::new();
        visit(&text, &mut |member| found.extend(member.text()));
        assert_eq!(found, ["deep"]);
    }
}
