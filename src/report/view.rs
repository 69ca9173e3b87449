//! The page that shows a scene or balls, exactly and as glTF: the template that web/build-view.mjs
//! makes of web/view, filled. It needs no other file and no network.

use std::io::{self, Write};

use base64::{prelude::BASE64_STANDARD, write::EncoderWriter};
use serde::Serialize;

use crate::encode::GENERATOR;
use crate::report::chart::escape;
use crate::report::measured_table::{MeasuredTable, SIZE};
use crate::scene::Bytes;

/// The file name of the page beside sheets.
pub const FILE: &str = "view.html";

/// The address of a material on the page beside its sheet.
#[must_use]
pub fn address(name: &str) -> String {
    let encoded = name.bytes().map(|byte| match byte {
        b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' | b'@' => {
            char::from(byte).to_string()
        }
        byte => format!("%{byte:02X}"),
    });
    format!("{FILE}#{}", encoded.collect::<String>())
}

/// The page, with the marks of [`Mark`] where its contents go.
const TEMPLATE: &str = include_str!("view.html");

/// A page.
pub struct View {
    /// The title.
    pub title: String,
    /// A line under the title.
    pub note: String,
    /// The balls, one a root node of the scene, in its order; none for any other scene.
    pub balls: Vec<Caption>,
    /// A measurement as a further ball.
    pub measurement: Option<(Caption, MeasuredTable)>,
    /// The pieces of the GLB.
    pub glb: Vec<Bytes>,
}

/// The caption of a ball.
#[derive(Clone, Debug, Serialize)]
pub struct Caption {
    /// Its name.
    pub title: String,
    /// A line under it.
    pub note: String,
    /// Mean ΔE2000 from the measured surface, where that is known.
    pub surface: Option<f64>,
}

/// The data that the page's script reads.
#[derive(Serialize)]
struct Contents<'a> {
    schema: &'static str,
    title: &'a str,
    note: &'a str,
    about: String,
    balls: &'a [Caption],
    measurement: Option<MeasurementContents<'a>>,
}

#[derive(Serialize)]
struct MeasurementContents<'a> {
    #[serde(flatten)]
    caption: &'a Caption,
    size: [usize; 3],
}

/// A place of the template, in the order in which they come.
#[derive(Clone, Copy, Debug)]
enum Mark {
    Generator,
    Title,
    Contents,
    Scene,
    Measurement,
}

const MARKS: [(&str, Mark); 5] = [
    ("%GENERATOR%", Mark::Generator),
    ("%TITLE%", Mark::Title),
    ("%CONTENTS%", Mark::Contents),
    ("%SCENE%", Mark::Scene),
    ("%MEASUREMENT%", Mark::Measurement),
];

impl View {
    /// Writes the page. Only what the template says can become markup: text is escaped, bytes are
    /// base64.
    ///
    /// # Errors
    ///
    /// Those of `out`, and of the files that the GLB's bytes are still in.
    pub fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        // The encoder writes in small pieces.
        let mut out = io::BufWriter::new(out);
        let mut rest = TEMPLATE;
        for (text, mark) in MARKS {
            // Only the template is searched for marks, never the text that is filled in.
            let (before, after) = rest.split_once(text).unwrap_or((rest, ""));
            out.write_all(before.as_bytes())?;
            self.fill(mark, &mut out)?;
            rest = after;
        }
        out.write_all(rest.as_bytes())?;
        out.flush()
    }

    fn fill(&self, mark: Mark, out: &mut impl Write) -> io::Result<()> {
        match mark {
            Mark::Generator => out.write_all(GENERATOR.as_bytes()),
            Mark::Title => out.write_all(escape(&self.title).as_bytes()),
            Mark::Contents => out.write_all(self.contents()?.as_bytes()),
            Mark::Scene => {
                base64(out, |out| self.glb.iter().try_for_each(|piece| piece.write_to(out)))
            }
            Mark::Measurement => match &self.measurement {
                Some((_, table)) => base64(out, |out| out.write_all(&table.bytes())),
                None => Ok(()),
            },
        }
    }

    /// JSON that no script element ends in: `<` is written by its number.
    fn contents(&self) -> io::Result<String> {
        let measurement = self.measurement.as_ref();
        let json = serde_json::to_string(&Contents {
            schema: "sgdbake/view/1",
            title: &self.title,
            note: &self.note,
            about: format!(
                "Written by {GENERATOR}. Everything is in this file; nothing is loaded from elsewhere."
            ),
            balls: &self.balls,
            measurement: measurement
                .map(|(caption, _)| MeasurementContents { caption, size: SIZE }),
        })?;
        Ok(json.replace('<', "\\u003c"))
    }
}

/// Writes the base64 of what `write` writes.
fn base64<W: Write>(
    out: &mut W,
    write: impl FnOnce(&mut EncoderWriter<'_, base64::engine::GeneralPurpose, &mut W>) -> io::Result<()>,
) -> io::Result<()> {
    let mut encoder = EncoderWriter::new(out, &BASE64_STANDARD);
    write(&mut encoder)?;
    encoder.finish().map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_template_has_each_mark_once_in_order() {
        let places = MARKS
            .map(|(text, _)| TEMPLATE.match_indices(text).map(|(at, _)| at).collect::<Vec<_>>());
        assert!(places.iter().all(|places| places.len() == 1), "{places:?}");
        assert!(places.is_sorted(), "{places:?}");
    }

    #[test]
    fn names_cannot_leave_their_place() {
        let hostile = "</script></title><script>alert(1)</script><!--%SCENE%";
        let caption = Caption { title: hostile.into(), note: hostile.into(), surface: None };
        let view = View {
            title: hostile.into(),
            note: hostile.into(),
            balls: vec![caption],
            measurement: None,
            glb: vec![Bytes::from(hostile.as_bytes().to_vec())],
        };
        let mut page = Vec::new();
        view.write_to(&mut page).expect("memory");
        let page = String::from_utf8(page).expect("text");
        for tag in ["<script", "</script", "<title", "</title", "<!--"] {
            assert_eq!(page.matches(tag).count(), TEMPLATE.matches(tag).count(), "{tag}");
        }
        let (_, contents) = page.split_once("id=\"contents\">").expect("its place");
        let (contents, _) = contents.split_once("</script>").expect("its end");
        let contents: serde_json::Value = serde_json::from_str(contents).expect("JSON");
        assert_eq!(contents["balls"][0]["title"], hostile);
    }

    #[test]
    fn the_page_without_a_scene_is_small() {
        assert!(
            TEMPLATE.len() + SIZE.iter().product::<usize>() * 8 < 1_500_000,
            "{}",
            TEMPLATE.len()
        );
    }
}
