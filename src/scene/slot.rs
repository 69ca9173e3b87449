//! Material slots, and which material goes to which.

use std::fmt;

use globset::{Glob, GlobMatcher};

use crate::scene::{SceneError, outline::Outline};

/// Where a material is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SlotId {
    /// The material at this index.
    Material(usize),
    /// The primitives without a material.
    Unassigned,
}

impl SlotId {
    /// The material's index.
    pub fn index(self) -> Option<usize> {
        match self {
            SlotId::Material(index) => Some(index),
            SlotId::Unassigned => None,
        }
    }
}

/// One material of a scene and what shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Slot {
    /// Its place.
    pub id: SlotId,
    /// Its name, where it has one.
    pub name: Option<String>,
    /// Names of the meshes that use it; `mesh 3` for one without a name.
    pub meshes: Vec<String>,
    /// Primitives that use it.
    pub primitives: usize,
    /// Triangles that use it.
    pub triangles: u64,
    /// True if a primitive or a variant of one uses it.
    pub used: bool,
}

impl Slot {
    /// A slot that nothing uses yet.
    fn unused(id: SlotId, name: Option<String>) -> Self {
        Self { id, name, meshes: Vec::new(), primitives: 0, triangles: 0, used: false }
    }

    /// The name, `#index` without one, `(none)` for primitives without a material.
    pub fn label(&self) -> String {
        match (self.id, &self.name) {
            (SlotId::Unassigned, _) => "(none)".into(),
            (_, Some(name)) => name.clone(),
            (SlotId::Material(index), None) => format!("#{index}"),
        }
    }
}

/// The label, and before it the `#index` that tells slots of one name apart: `#0 Body`.
impl fmt::Display for Slot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.id, &self.name) {
            (SlotId::Material(index), Some(name)) => write!(f, "#{index} {name}"),
            _ => f.write_str(&self.label()),
        }
    }
}

/// The slots of a document, in the order of its materials, `(none)` last.
pub(super) fn slots(outline: &Outline) -> Vec<Slot> {
    let materials = outline.materials.iter().enumerate();
    let mut slots: Vec<_> =
        materials.map(|(i, m)| Slot::unused(SlotId::Material(i), m.name.clone())).collect();
    let mut none = Slot::unused(SlotId::Unassigned, None);
    for (index, mesh) in outline.meshes.iter().enumerate() {
        let name = mesh.name.clone().unwrap_or_else(|| format!("mesh {index}"));
        for primitive in &mesh.primitives {
            // A variant uses its material, but its triangles are drawn with it only when it is
            // chosen.
            let mappings = primitive.extensions.variants.iter().flat_map(|v| &v.mappings);
            for mapping in mappings {
                if let Some(slot) = slots.get_mut(mapping.material.0 as usize) {
                    slot.used = true;
                }
            }
            let slot = match primitive.material {
                Some(material) => slots.get_mut(material.0 as usize),
                None => Some(&mut none),
            };
            let Some(slot) = slot else { continue };
            slot.used = true;
            slot.primitives += 1;
            slot.triangles = slot.triangles.saturating_add(outline.triangles(primitive));
            // Primitives come mesh by mesh, so the last name is the only one to compare with.
            if slot.meshes.last() != Some(&name) {
                slot.meshes.push(name.clone());
            }
        }
    }
    slots.extend(none.used.then_some(none));
    slots
}

/// A pattern that picks slots, as an assignment gives it.
#[derive(Debug, Clone)]
pub struct Pattern(Kind);

#[derive(Debug, Clone)]
enum Kind {
    /// `*`: every slot.
    All,
    /// `(none)`: the primitives without a material.
    Unassigned,
    /// `#3`: the material at an index.
    Index(usize),
    /// A material name, or a glob over names where it is one.
    Name(String, Option<GlobMatcher>),
}

impl Pattern {
    /// The pattern that `text` spells; text without wildcards is a name.
    pub fn new(text: &str) -> Self {
        let index = text.strip_prefix('#').and_then(|digits| digits.parse().ok());
        Pattern(match (text, index) {
            ("*", _) => Kind::All,
            ("(none)", _) => Kind::Unassigned,
            (_, Some(index)) => Kind::Index(index),
            _ => {
                // Text that is not a glob, such as a lone `[`, can still be a name.
                let glob = Glob::new(text).ok().map(|glob| glob.compile_matcher());
                Kind::Name(text.to_owned(), glob)
            }
        })
    }

    /// How closely the pattern names the slot: 3 its place, 2 its name, 1 a glob, 0 `*`.
    fn closeness(&self, slot: &Slot) -> Option<u8> {
        match (&self.0, slot.id, &slot.name) {
            (Kind::All, ..) => Some(0),
            (Kind::Unassigned, SlotId::Unassigned, _) => Some(3),
            (Kind::Index(index), SlotId::Material(i), _) if *index == i => Some(3),
            // Before the glob, as a name may hold wildcards: `[x]` means itself first.
            (Kind::Name(name, _), _, Some(slot)) if name == slot => Some(2),
            (Kind::Name(_, Some(glob)), _, Some(slot)) if glob.is_match(slot) => Some(1),
            _ => None,
        }
    }

    fn text(&self) -> String {
        match &self.0 {
            Kind::All => "*".into(),
            Kind::Unassigned => "(none)".into(),
            Kind::Index(index) => format!("#{index}"),
            Kind::Name(name, _) => name.clone(),
        }
    }
}

/// For each slot the value assigned to it: the closest pattern wins (place, then name, then glob,
/// then `*`), of equally close ones the last.
///
/// # Errors
/// [`SceneError::NoSlot`] for a pattern that matches no slot.
pub fn resolve<'a, T>(
    slots: &[Slot],
    assignments: &'a [(Pattern, T)],
) -> Result<Vec<Option<&'a T>>, SceneError> {
    for (pattern, _) in assignments {
        if !slots.iter().any(|slot| pattern.closeness(slot).is_some()) {
            return Err(SceneError::NoSlot {
                pattern: pattern.text(),
                slots: slots.iter().map(Slot::label).collect(),
            });
        }
    }
    Ok(slots.iter().map(|slot| closest(assignments, slot)).collect())
}

/// The value of the pattern that names a slot most closely.
fn closest<'a, T>(assignments: &'a [(Pattern, T)], slot: &Slot) -> Option<&'a T> {
    let matches = assignments
        .iter()
        .filter_map(|(pattern, value)| pattern.closeness(slot).map(|closeness| (closeness, value)));
    // Of equal maxima `max_by_key` gives the last.
    matches.max_by_key(|(closeness, _)| *closeness).map(|(_, value)| value)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::*;

    fn slot(index: usize, name: Option<&str>) -> Slot {
        Slot {
            id: SlotId::Material(index),
            name: name.map(Into::into),
            meshes: vec![],
            primitives: 1,
            triangles: 1,
            used: true,
        }
    }

    fn assigned(patterns: &[&str]) -> Result<Vec<Option<usize>>, SceneError> {
        let none = Slot { id: SlotId::Unassigned, ..slot(0, None) };
        let slots = [
            slot(0, Some("Body")),
            slot(1, Some("Body red")),
            slot(2, None),
            slot(3, Some("[x]")),
            none,
        ];
        let assignments: Vec<_> =
            patterns.iter().enumerate().map(|(i, text)| (Pattern::new(text), i)).collect();
        Ok(resolve(&slots, &assignments)?.into_iter().map(Option::<&usize>::copied).collect())
    }

    #[test]
    fn the_closest_pattern_wins_then_the_last() {
        assert_eq!(assigned(&["*"]).unwrap(), [Some(0); 5]);
        let mixed = assigned(&["#0", "Body", "Body*", "*", "Body red", "(none)", "[x]"]).unwrap();
        assert_eq!(mixed, [Some(0), Some(4), Some(3), Some(6), Some(5)]);
        assert_eq!(assigned(&["Body", "Body"]).unwrap(), [Some(1), None, None, None, None]);
    }

    #[test]
    fn a_pattern_without_a_slot_is_an_error_that_lists_them() {
        let message = assigned(&["Bodi"]).unwrap_err().to_string();
        assert_eq!(
            message,
            r#"no material slot matches "Bodi"; the scene has Body, Body red, #2, [x], (none)"#
        );
        assert!(assigned(&["#7"]).is_err());
    }
}
