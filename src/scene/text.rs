//! JSON that is edited as text: what is not touched keeps its characters, so key order, number
//! spelling, escapes and white space survive. A typed or `Value` model would respell them.

use std::{borrow::Cow, fmt};

use serde::{
    Deserialize, Deserializer,
    de::{MapAccess, Visitor},
};
use serde_json::value::RawValue;

/// A JSON object or array cut into its items; [`Pieces::to_text`] of an unedited one is the input.
#[derive(Debug, Clone)]
pub(super) struct Pieces<'t> {
    brackets: [char; 2],
    items: Vec<Item<'t>>,
    /// White space before the closing bracket.
    tail: &'t str,
}

/// One value and the text between the previous value and this one: white space, comma, key, colon.
#[derive(Debug, Clone)]
struct Item<'t> {
    lead: Cow<'t, str>,
    key: Cow<'t, str>,
    value: Cow<'t, str>,
}

impl<'t> Pieces<'t> {
    /// Cuts `text`, a JSON object.
    pub fn object(text: &'t str) -> serde_json::Result<Self> {
        Ok(Self::cut(text, ['{', '}'], serde_json::from_str::<Members<'t>>(text)?.0))
    }

    /// Cuts `text`, a JSON array.
    pub fn array(text: &'t str) -> serde_json::Result<Self> {
        let elements = serde_json::from_str::<Vec<&'t RawValue>>(text)?;
        let members = elements.into_iter().map(|value| (Cow::Borrowed(""), value)).collect();
        Ok(Self::cut(text, ['[', ']'], members))
    }

    fn cut(text: &'t str, brackets: [char; 2], members: Vec<(Cow<'t, str>, &'t RawValue)>) -> Self {
        let text = text.trim();
        // Behind the opening bracket.
        let mut end = 1;
        let items = members
            .into_iter()
            .map(|(key, raw)| {
                // A raw value is a slice of `text`, so its address tells where it stands.
                let start = raw.get().as_ptr() as usize - text.as_ptr() as usize;
                let lead = Cow::Borrowed(&text[end..start]);
                end = start + raw.get().len();
                Item { lead, key, value: Cow::Borrowed(raw.get()) }
            })
            .collect();
        Pieces { brackets, items, tail: &text[end..text.len() - 1] }
    }

    /// The text of a member; of several with one key the last, as JSON readers take it.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.items.iter().rev().find(|item| item.key == key).map(|item| &*item.value)
    }

    /// The text of a member, if it has not been changed; it outlives these pieces.
    pub fn original(&self, key: &str) -> Option<&'t str> {
        let item = self.items.iter().rev().find(|item| item.key == key)?;
        match item.value {
            Cow::Borrowed(text) => Some(text),
            Cow::Owned(_) => None,
        }
    }

    /// The text of the item at `index`.
    pub fn item(&self, index: usize) -> Option<&str> {
        self.items.get(index).map(|item| &*item.value)
    }

    /// The texts of all items in order.
    pub fn values(&self) -> impl Iterator<Item = &str> {
        self.items.iter().map(|item| &*item.value)
    }

    /// The keys and texts of all members in order.
    pub fn members(&self) -> impl Iterator<Item = (&str, &str)> {
        self.items.iter().map(|item| (&*item.key, &*item.value))
    }

    /// How many items there are.
    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// Replaces the value of `key`, or adds the member at the end.
    pub fn set(&mut self, key: &str, value: impl Into<Cow<'t, str>>) {
        // The last of several with one key counts, as in `get`.
        match self.items.iter().rposition(|item| item.key == key) {
            Some(at) => self.items[at].value = value.into(),
            None => self.add(Cow::Owned(key.to_owned()), value.into()),
        }
    }

    /// Adds an element at the end of an array.
    pub fn push(&mut self, value: impl Into<Cow<'t, str>>) {
        self.add(Cow::Borrowed(""), value.into());
    }

    /// Replaces the element at `index`, which must exist.
    pub fn replace(&mut self, index: usize, value: impl Into<Cow<'t, str>>) {
        self.items[index].value = value.into();
    }

    /// Removes every member named `key`; returns whether there was one.
    pub fn remove(&mut self, key: &str) -> bool {
        let before = self.items.len();
        self.retain(|_, item| item != key);
        self.items.len() != before
    }

    /// Keeps the items for which `keep(index, key)` holds.
    pub fn retain(&mut self, mut keep: impl FnMut(usize, &str) -> bool) {
        let mut index = 0;
        self.items.retain(|item| {
            index += 1;
            keep(index - 1, &item.key)
        });
        // What comes first has no comma. A key may hold one, so only white space may stand before.
        if let Some(first) = self.items.first_mut()
            && let Some((before, after)) = first.lead.split_once(',')
            && before.trim().is_empty()
        {
            first.lead = Cow::Owned(after.to_owned());
        }
    }

    /// The text: what was not edited is as it was.
    pub fn to_text(&self) -> String {
        let mut text = String::from(self.brackets[0]);
        for item in &self.items {
            text.push_str(&item.lead);
            text.push_str(&item.value);
        }
        text.push_str(self.tail);
        text.push(self.brackets[1]);
        text
    }

    /// A new item takes the white space of its neighbours.
    fn add(&mut self, key: Cow<'t, str>, value: Cow<'t, str>) {
        let neighbour = self.items.last().map_or("", |item| &*item.lead);
        let gap: String =
            neighbour.trim_start_matches(',').chars().take_while(|c| c.is_whitespace()).collect();
        let comma = if self.items.is_empty() { "" } else { "," };
        let lead = match self.brackets[0] {
            '{' => {
                // The lead of a member ends behind its colon.
                let space = if neighbour.ends_with(' ') { " " } else { "" };
                format!("{comma}{gap}{}:{space}", quote(&key))
            }
            _ => format!("{comma}{gap}"),
        };
        self.items.push(Item { lead: Cow::Owned(lead), key, value });
    }
}

/// `text` as a JSON string.
pub(super) fn quote(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// An object's members in the order and number in which they stand.
struct Members<'t>(Vec<(Cow<'t, str>, &'t RawValue)>);

impl<'de> Deserialize<'de> for Members<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(MembersVisitor)
    }
}

struct MembersVisitor;

impl<'de> Visitor<'de> for MembersVisitor {
    type Value = Members<'de>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a JSON object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut members = Vec::new();
        while let Some((key, value)) = map.next_entry::<Cow<'de, str>, &'de RawValue>()? {
            members.push((key, value));
        }
        Ok(Members(members))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn untouched_text_keeps_every_character() {
        let text = "{ \"a\" : 1.0E+05 ,\n\t\"b\":[ 1 , 2.50 ],\"\\u0061\": \"\\/\" , \"a\":{}  }";
        assert_eq!(Pieces::object(text).unwrap().to_text(), text);
        let array = "[ 1e5,\n -0.0 , {\"x\" :1} ]";
        assert_eq!(Pieces::array(array).unwrap().to_text(), array);
    }

    #[test]
    fn edits_follow_the_style_around_them() {
        let mut pieces = Pieces::object("{\n  \"a\": 1,\n  \"b\": 2\n}").unwrap();
        pieces.set("c", "3");
        pieces.remove("a");
        pieces.set("b", "4");
        assert_eq!(pieces.to_text(), "{\n  \"b\": 4,\n  \"c\": 3\n}");
        let mut compact = Pieces::array("[]").unwrap();
        compact.push("1");
        compact.push("2");
        assert_eq!(compact.to_text(), "[1,2]");
    }

    proptest! {
        #[test]
        fn edited_text_is_json(keys in prop::collection::vec("[a-c,\"\\\\]{1,2}", 0..6), removed: prop::sample::Index) {
            let mut pieces = Pieces::object("{}").unwrap();
            for key in &keys { pieces.set(key, "[1, 2]"); }
            if !keys.is_empty() { pieces.remove(&keys[removed.index(keys.len())]); }
            let text = pieces.to_text();
            prop_assert_eq!(serde_json::from_str::<serde_json::Map<_, _>>(&text).unwrap().len(), pieces.len());
        }
    }
}
