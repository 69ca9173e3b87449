//! The members of a JSON value, at every depth.

use serde_json::Value;

/// Calls `found` with the key and value of every member.
pub(super) fn visit(value: &Value, found: &mut impl FnMut(&str, &Value)) {
    match value {
        Value::Object(members) => members.iter().for_each(|(key, value)| {
            found(key, value);
            visit(value, found);
        }),
        Value::Array(elements) => elements.iter().for_each(|element| visit(element, found)),
        _ => {}
    }
}
