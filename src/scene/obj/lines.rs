//! The lines of an OBJ, put into the form that tobj reads without loss: names become
//! numbers, groups are split where shading or attributes change, lines it would refuse or misread
//! (continuations, tabs, partial colours, curves) are joined, completed or left out.

use std::{
    collections::HashMap,
    io::{self, BufRead, Read},
};

/// Faces that belong together: same name, same shading, same attributes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Group {
    pub name: String,
    pub shading: Shading,
    layout: Layout,
}

/// The smoothing statement of a file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub(super) enum Shading {
    /// No statement: smooth.
    #[default]
    Unstated,
    /// `s off`.
    Flat,
    /// `s N`.
    Smooth(u32),
}

/// The presence of texture coordinates and normals in a face.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Layout {
    texcoords: bool,
    normals: bool,
}

/// A reader that rewrites an OBJ line by line and notes what the rewritten lines no longer say.
pub(super) struct Lines<'p, R> {
    inner: R,
    progress: &'p mut dyn FnMut(u64),
    raw: Vec<u8>,
    out: Vec<u8>,
    at: usize,
    bytes: u64,
    /// Numbers of positions, texture coordinates and normals so far.
    counts: [i64; 3],
    colored: Option<bool>,
    current: Group,
    /// The material of the faces to come, until there is one.
    pending: Option<String>,
    material_index: HashMap<String, usize>,
    /// Group names in the rewritten text are indices into this.
    pub groups: Vec<Group>,
    /// Material names in the rewritten text are indices into this.
    pub materials: Vec<String>,
    /// The arguments of `mtllib`.
    pub libraries: Vec<String>,
    pub warnings: Vec<String>,
    /// Why reading stopped.
    pub error: Option<String>,
    /// The last line read, from 1.
    number: usize,
    /// Where the rewritten form of a line ends in `out`, and its number.
    ends: Vec<(usize, usize)>,
    ignored: usize,
}

/// Bytes between two reports of progress.
const PROGRESS_STEP: u64 = 1 << 20;

/// Bytes that a line may have with its continuations: a polygon of half a million corners.
const MAX_LINE: usize = 1 << 24;

/// Bytes of rewritten lines after which a batch ends.
const BATCH: usize = 1 << 15;

impl<'p, R: BufRead> Lines<'p, R> {
    pub fn new(inner: R, progress: &'p mut dyn FnMut(u64)) -> Self {
        Lines {
            inner,
            progress,
            raw: Vec::new(),
            out: Vec::new(),
            at: 0,
            bytes: 0,
            counts: [0; 3],
            colored: None,
            current: Group::default(),
            pending: None,
            material_index: HashMap::new(),
            groups: Vec::new(),
            materials: Vec::new(),
            libraries: Vec::new(),
            warnings: Vec::new(),
            error: None,
            number: 0,
            ends: Vec::new(),
            ignored: 0,
        }
    }

    /// Reads one line with its continuations; returns whether there was one.
    fn next_line(&mut self) -> io::Result<bool> {
        self.raw.clear();
        loop {
            let room = MAX_LINE.saturating_sub(self.raw.len()) as u64;
            let read = (&mut self.inner).take(room).read_until(b'\n', &mut self.raw)?;
            if self.raw.len() >= MAX_LINE {
                self.number += 1;
                let reason = format!("the line has more than {MAX_LINE} bytes");
                return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
            }
            if read == 0 {
                return Ok(!self.raw.is_empty());
            }
            self.number += 1;
            let before = self.bytes / PROGRESS_STEP;
            self.bytes += read as u64;
            if self.bytes / PROGRESS_STEP != before {
                (self.progress)(self.bytes);
            }
            while self.raw.last().is_some_and(u8::is_ascii_whitespace) {
                self.raw.pop();
            }
            // A comment ends with its line, even behind a backslash, as in a Windows path.
            if self.raw.last() != Some(&b'\\') || self.raw.trim_ascii_start().starts_with(b"#") {
                return Ok(true);
            }
            self.raw.pop();
            self.raw.push(b' ');
        }
    }

    /// Puts what the line becomes into `out`, nothing for a line that is left out.
    fn rewrite(&mut self) -> Result<(), String> {
        // Taken so that the methods can borrow `self`, and put back to keep its memory.
        let raw = std::mem::take(&mut self.raw);
        let line = raw.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&raw).trim_ascii_start();
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (keyword, rest) = line.split_at(end);
        let result = match keyword {
            b"v" => self.position(rest),
            b"vt" => self.texcoord(rest),
            b"vn" => self.normal(rest),
            b"f" => self.face(rest),
            b"" => Ok(()),
            _ if keyword.starts_with(b"#") => Ok(()),
            _ => self.statement(keyword, String::from_utf8_lossy(rest).trim()),
        };
        self.raw = raw;
        result
    }

    fn statement(&mut self, keyword: &[u8], rest: &str) -> Result<(), String> {
        match keyword {
            b"o" | b"g" => self.current.name = rest.to_owned(),
            b"s" => {
                self.current.shading = match rest.parse() {
                    // `s off` and `s 0`.
                    Ok(0) | Err(_) => Shading::Flat,
                    Ok(group) => Shading::Smooth(group),
                }
            }
            b"mtllib" => self.libraries.push(rest.to_owned()),
            b"usemtl" if !rest.is_empty() => self.pending = Some(rest.to_owned()),
            b"usemtl" => {}
            _ => self.ignored += 1,
        }
        Ok(())
    }

    fn use_material(&mut self, name: &str) {
        let next = self.materials.len();
        let index = *self.material_index.entry(name.to_owned()).or_insert(next);
        if index == next {
            self.materials.push(name.to_owned());
            // tobj numbers materials in the order in which it loads them.
            self.emit(&["mtllib ", &index.to_string(), "\n"]);
        }
        self.emit(&["usemtl ", &index.to_string(), "\n"]);
    }

    /// `x y z [w]` or `x y z r g b`; the first position decides whether all have colours.
    fn position(&mut self, rest: &[u8]) -> Result<(), String> {
        self.counts[0] += 1;
        let words = words(rest).count();
        let colored = *self.colored.get_or_insert(words >= 6);
        self.out.extend_from_slice(b"v ");
        // tobj takes 3, 4 or 6 numbers, and colours of all positions or of none.
        match (colored, words) {
            (false, 0..=4) | (true, 6) => self.out.extend_from_slice(rest),
            (false, _) => self.emit_words(rest, 3),
            (true, 7..) => self.emit_words(rest, 6),
            (true, _) => {
                self.emit_words(rest, 3);
                // White leaves the base colour as it is.
                self.emit(&[" 1 1 1"]);
            }
        }
        self.out.push(b'\n');
        Ok(())
    }

    fn texcoord(&mut self, rest: &[u8]) -> Result<(), String> {
        self.counts[1] += 1;
        self.out.extend_from_slice(b"vt ");
        self.out.extend_from_slice(rest);
        // tobj wants two coordinates; `vt u` is valid.
        self.emit(&[if words(rest).count() < 2 { " 0\n" } else { "\n" }]);
        Ok(())
    }

    fn normal(&mut self, rest: &[u8]) -> Result<(), String> {
        self.counts[2] += 1;
        self.out.extend_from_slice(b"vn ");
        self.out.extend_from_slice(rest);
        self.out.push(b'\n');
        Ok(())
    }

    fn face(&mut self, rest: &[u8]) -> Result<(), String> {
        let mut corners = words(rest);
        let first = corners.next().ok_or("a face without corners")?;
        let layout = self.corner(first)?;
        let mut count = 1;
        for corner in corners {
            count += 1;
            // Else the arrays of a mesh would not line up: each vertex needs every attribute.
            if self.corner(corner)? != layout {
                return Err("the corners of a face differ in what they have".into());
            }
        }
        if count < 3 {
            self.ignored += 1;
            return Ok(());
        }
        // Not before: a material that no face uses is left out.
        if let Some(material) = self.pending.take() {
            self.use_material(&material);
        }
        self.current.layout = layout;
        // A group that comes back is a new one here; `meshes` joins those of one name.
        if self.groups.last() != Some(&self.current) {
            let index = self.groups.len().to_string();
            self.groups.push(self.current.clone());
            self.emit(&["g ", &index, "\n"]);
        }
        self.out.extend_from_slice(b"f ");
        self.out.extend_from_slice(rest);
        self.out.push(b'\n');
        Ok(())
    }

    /// The parts of a corner `v/vt/vn`. Indices are at least 1, or count back from the last one.
    fn corner(&self, corner: &[u8]) -> Result<Layout, String> {
        let mut present = [false; 3];
        for (kind, digits) in corner.split(|byte| *byte == b'/').enumerate() {
            let present = present.get_mut(kind).ok_or_else(|| not_a_corner(corner))?;
            *present = !digits.is_empty();
            if *present && !self.in_range(kind, digits).ok_or_else(|| not_a_corner(corner))? {
                return Err(format!(
                    "index {} is out of range, there are {} so far",
                    String::from_utf8_lossy(digits),
                    self.counts[kind],
                ));
            }
        }
        match present[0] {
            true => Ok(Layout { texcoords: present[1], normals: present[2] }),
            false => Err(not_a_corner(corner)),
        }
    }

    /// Returns whether an index exists; `None` if it is not a number. Positive indices may run
    /// ahead of the definitions, and are checked where they are used.
    fn in_range(&self, kind: usize, digits: &[u8]) -> Option<bool> {
        let (negative, digits) = match digits {
            [b'-', digits @ ..] => (true, digits),
            _ => (false, digits),
        };
        if digits.is_empty() || !digits.iter().all(u8::is_ascii_digit) {
            return None;
        }
        if !negative && digits.len() < 10 {
            // Nine digits fit 32 bits. tobj would take index 0 for one that is absent.
            return Some(digits.iter().any(|digit| *digit != b'0'));
        }
        // There may be any number of digits.
        let value = digits.iter().fold(0, |value: i64, digit| {
            value.saturating_mul(10).saturating_add((digit - b'0').into())
        });
        let limit = if negative { self.counts[kind] } else { i64::from(u32::MAX) };
        Some((1..=limit).contains(&value))
    }

    /// Rewrites lines until there is a batch, an error, or no more of them.
    fn rewrite_batch(&mut self) {
        self.out.clear();
        self.ends.clear();
        self.at = 0;
        while self.error.is_none() && self.out.len() < BATCH {
            match self.next_line() {
                Ok(true) => self.error = self.rewrite().err(),
                Ok(false) => return self.end(),
                Err(error) => self.error = Some(error.to_string()),
            }
            // tobj does not say where it fails; `line` finds the place from this.
            self.ends.push((self.out.len(), self.number));
        }
    }

    /// The line that was handed out last, from 1.
    pub fn line(&self) -> usize {
        let last = self.ends.iter().find(|(end, _)| self.at > 0 && *end >= self.at);
        last.map_or(self.number, |(_, number)| *number)
    }

    fn emit(&mut self, texts: &[&str]) {
        texts.iter().for_each(|text| self.out.extend_from_slice(text.as_bytes()));
    }

    fn emit_words(&mut self, rest: &[u8], count: usize) {
        for word in words(rest).take(count) {
            self.out.push(b' ');
            self.out.extend_from_slice(word);
        }
    }

    fn end(&mut self) {
        (self.progress)(self.bytes);
        if self.ignored > 0 {
            let ignored = std::mem::take(&mut self.ignored);
            self.warnings
                .push(format!("{ignored} lines are neither faces nor known, and left out"));
        }
    }
}

fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

impl<R: BufRead> BufRead for Lines<'_, R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.at == self.out.len() {
            self.rewrite_batch();
            // What was rewritten before the error goes out first: tobj may fail over an earlier
            // line.
            if self.out.is_empty() && self.error.is_some() {
                return Err(io::ErrorKind::InvalidData.into());
            }
        }
        Ok(&self.out[self.at..])
    }

    fn consume(&mut self, amount: usize) {
        self.at += amount;
    }
}

impl<R: BufRead> Read for Lines<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.fill_buf()?.read(buffer)?;
        self.consume(read);
        Ok(read)
    }
}

/// Why a line with such a corner is refused.
fn not_a_corner(corner: &[u8]) -> String {
    format!("{:?} is not a face corner", String::from_utf8_lossy(corner))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::*;

    fn rewritten(text: &str) -> Result<String, String> {
        let mut progress = |_| ();
        let mut lines = Lines::new(text.as_bytes(), &mut progress);
        let mut out = String::new();
        let read = lines.read_to_string(&mut out);
        read.map(|_| out).map_err(|_| lines.error.unwrap_or_default())
    }

    #[test]
    fn groups_split_where_shading_or_attributes_change() {
        let text = "o a\ns 1\nf 1 2 3\nf 1 2 4\ns off\nf 1 2 3\nf 1//1 2//2 3//3\n";
        let expected = "g 0\nf  1 2 3\nf  1 2 4\ng 1\nf  1 2 3\ng 2\nf  1//1 2//2 3//3\n";
        assert_eq!(rewritten(text).unwrap(), expected);
    }

    #[test]
    fn odd_lines_are_completed() {
        assert_eq!(
            rewritten("v 1 2 3 .1 .2 .3\r\nv 1 2 3").unwrap(),
            "v  1 2 3 .1 .2 .3\nv  1 2 3 1 1 1\n"
        );
        assert_eq!(rewritten("v 1 2 3\nv 1 2 3 4 5 6").unwrap(), "v  1 2 3\nv  1 2 3\n");
        assert_eq!(rewritten("vt .5\n# C:\\\nvt 0 \\\n1").unwrap(), "vt  .5 0\nvt  0  1\n");
        let named = rewritten("usemtl\tmy paint \nf 1 2 3\nusemtl x\nusemtl y\nf 1 2 3\nusemtl my paint\nf 1 2 3\nusemtl z").unwrap();
        let expected =
            "mtllib 0\nusemtl 0\ng 0\nf  1 2 3\nmtllib 1\nusemtl 1\nf  1 2 3\nusemtl 0\nf  1 2 3\n";
        assert_eq!(named, expected, "the unused x and z are left out");
    }

    #[test]
    fn corners_that_cannot_be_are_refused() {
        for face in [
            "f 0 1 2",
            "f -1 -2 -3",
            "f 1/1 2 3",
            "f a b c",
            "f",
            "f 1/2/3/4 1 1",
            "f 99999999999 1 1",
        ] {
            assert!(rewritten(face).is_err(), "{face}");
        }
        assert!(rewritten("v 0 0 0\nf -1 -1 -1").is_ok());
    }
}
