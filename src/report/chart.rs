//! Charts as SVG whose colours come from the page's style sheet, so that one drawing serves light
//! and dark.

use std::fmt::Write as _;

use crate::encode::GENERATOR;
use crate::report::axis::{Axis, tick_label};

/// A line through points. `class` names its style, e.g. `r` or `g fit`.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// CSS classes.
    pub class: String,
    /// Points (x, y); what is not finite interrupts the line.
    pub points: Vec<[f64; 2]>,
}

/// A labelled point.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// CSS classes.
    pub class: String,
    /// Its place.
    pub at: [f64; 2],
    /// Its label, drawn next to it where there is room, and always when it is pointed at.
    pub label: String,
    /// True to draw the label even where there is no room.
    pub always_named: bool,
}

/// An entry of a key: a line or a point in its style, and what that stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    /// A line or a point.
    pub shown: Shown,
    /// CSS classes of what is shown.
    pub class: &'static str,
    /// Meaning.
    pub label: &'static str,
}

/// The sample that an entry of a key shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// A piece of a curve.
    Line,
    /// A mark.
    Point,
}

/// A chart with two axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Width and height in user units; the drawing scales to the page.
    pub size: [f64; 2],
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// Lines, the last on top.
    pub curves: Vec<Curve>,
    /// Labelled points.
    pub marks: Vec<Mark>,
    /// The explanation of the styles, drawn under the title.
    pub key: Vec<Key>,
}

/// Several charts in one file, each in its own size.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    size: [f64; 2],
    charts: String,
}

impl Page {
    /// An empty page of the given width and height.
    #[must_use]
    pub fn new(size: [f64; 2]) -> Self {
        Self { size, charts: String::new() }
    }

    /// Puts a chart with its left top corner where told.
    pub fn add(&mut self, [x, y]: [f64; 2], chart: &Chart) {
        let _ = write!(self.charts, "<g transform=\"translate({x} {y})\">{}</g>", chart.drawing());
    }

    /// The page as a complete SVG file with its style.
    #[must_use]
    pub fn file(&self, style: &str) -> String {
        let [width, height] = self.size;
        format!(
            "<!-- {GENERATOR} -->\n<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"chart\" \
             viewBox=\"0 0 {width} {height}\"><style>{}</style>\
             <rect class=\"ground\" width=\"100%\" height=\"100%\"/>{}</svg>\n",
            escape(style),
            self.charts
        )
    }
}

/// Room for labels: left, top, right, bottom.
const MARGIN: [f64; 4] = [52.0, 26.0, 12.0, 38.0];
/// Height of the key's line.
const KEY_HEIGHT: f64 = 18.0;
/// Width of a piece of a curve in a key.
const SAMPLE: f64 = 24.0;
/// Half the width of a point.
const POINT: f64 = 4.0;
/// Width and height of a letter, at most.
const LETTER: [f64; 2] = [7.0, 12.0];

/// A piece of a curve in its style, as the entry of a key.
#[must_use]
pub fn line_sample(class: &str, [x, y]: [f64; 2]) -> String {
    format!("<path class=\"curve {class}\" d=\"M{x:.1} {y:.1}h{SAMPLE}\"/>")
}

/// The entry of a key as an element of a page.
#[must_use]
pub fn line_key(class: &str, label: &str) -> String {
    let line = line_sample(class, [0.0, 3.0]);
    format!("<span><svg viewBox=\"0 0 {SAMPLE} 6\" width=\"{SAMPLE}\">{line}</svg>{label}</span>")
}

impl Chart {
    /// The drawing as an `svg` element.
    #[must_use]
    pub fn svg(&self) -> String {
        let [width, height] = self.size;
        format!(
            "<svg class=\"chart\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">{}</svg>",
            escape(&self.title),
            self.drawing()
        )
    }

    /// Content of the element.
    fn drawing(&self) -> String {
        let mut svg = format!(
            "<text class=\"title\" x=\"{}\" y=\"16\">{}</text>",
            MARGIN[0],
            escape(&self.title)
        );
        self.draw_key(&mut svg);
        self.draw_axes(&mut svg);
        for curve in &self.curves {
            let _ =
                write!(svg, "<path class=\"curve {}\" d=\"{}\"/>", curve.class, self.path(curve));
        }
        self.draw_marks(&mut svg);
        svg
    }

    /// The drawing as a file of its own with its style.
    #[must_use]
    pub fn file(&self, style: &str) -> String {
        let mut page = Page::new(self.size);
        page.add([0.0, 0.0], self);
        page.file(style)
    }

    /// Where a point of the data lies in the drawing.
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [left, mut top, right, bottom] = MARGIN;
        if !self.key.is_empty() {
            top += KEY_HEIGHT;
        }
        let across = self.size[0] - left - right;
        let down = self.size[1] - top - bottom;
        [left + across * self.x.position(x), top + down * (1.0 - self.y.position(y))]
    }

    fn draw_axes(&self, svg: &mut String) {
        let [left, bottom] = self.place([self.x.low, self.y.low]);
        let [right, top] = self.place([self.x.high, self.y.high]);
        for tick in self.x.ticks() {
            let [x, _] = self.place([tick, self.y.low]);
            let _ = write!(
                svg,
                "<path class=\"grid\" d=\"M{x:.1} {top:.1}V{bottom:.1}\"/>\
                 <text class=\"tick middle\" x=\"{x:.1}\" y=\"{:.1}\">{}</text>",
                bottom + 14.0,
                tick_label(tick)
            );
        }
        for tick in self.y.ticks() {
            let [_, y] = self.place([self.x.low, tick]);
            let _ = write!(
                svg,
                "<path class=\"grid\" d=\"M{left:.1} {y:.1}H{right:.1}\"/>\
                 <text class=\"tick end\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                left - 5.0,
                y + 3.5,
                tick_label(tick)
            );
        }
        let _ = write!(
            svg,
            "<text class=\"label middle\" x=\"{:.1}\" y=\"{:.1}\">{}</text>\
             <text class=\"label middle\" transform=\"translate(12 {:.1}) rotate(-90)\">{}</text>",
            0.5 * (left + right),
            bottom + 31.0,
            escape(&self.x.label),
            0.5 * (top + bottom),
            escape(&self.y.label)
        );
    }

    /// The path of a curve, clipped to the frame's height by lifting the pen.
    fn path(&self, curve: &Curve) -> String {
        let mut path = String::new();
        let mut drawing = false;
        for point in &curve.points {
            // NaN is in no range: it lifts the pen like a point outside.
            let inside = (-1e-9..=1.0 + 1e-9).contains(&self.y.position(point[1]));
            if inside {
                let [x, y] = self.place(*point);
                let _ = write!(path, "{}{x:.1} {y:.1}", if drawing { "L" } else { "M" });
            }
            drawing = inside;
        }
        path
    }

    fn draw_key(&self, svg: &mut String) {
        let [mut x, y] = [MARGIN[0], MARGIN[1] + 3.0];
        for Key { shown, class, label } in &self.key {
            let (sample, width) = match shown {
                Shown::Line => (line_sample(class, [x, y]), SAMPLE),
                Shown::Point => (point(class, [x + POINT, y], ""), 2.0 * POINT),
            };
            x += width + 5.0;
            let _ = write!(svg, "{sample}<text x=\"{x:.1}\" y=\"{:.1}\">{label}</text>", y + 4.0);
            x += LETTER[0] * label.chars().count() as f64 + 14.0;
        }
    }

    /// Points, each named when pointed at, and the labels that have room.
    fn draw_marks(&self, svg: &mut String) {
        let places: Vec<[f64; 2]> = self.marks.iter().map(|mark| self.place(mark.at)).collect();
        let points = places.iter().map(|[x, y]| [x - POINT, y - POINT, x + POINT, y + POINT]);
        // Labels keep clear of all points and level lines; the first marks choose first.
        let mut taken: Vec<[f64; 4]> = points.chain(self.level_lines()).collect();
        for (mark, place) in self.marks.iter().zip(&places) {
            let name = escape(&mark.label);
            svg.push_str(&point(&mark.class, *place, &format!("<title>{name}</title>")));
            let boxes = self.beside(*place, mark.label.chars().count());
            let free = boxes.iter().find(|own| !taken.iter().any(|other| overlap(own, other)));
            // The first box is the one to the right, where a reader looks.
            let Some(own) = free.or(mark.always_named.then_some(&boxes[0])) else { continue };
            taken.push(*own);
            let [left, _, right, bottom] = own;
            // A box to the left is anchored at its right end: letters may be narrower than LETTER.
            let (x, anchor) = if *right < place[0] { (right, " end") } else { (left, "") };
            let _ = write!(
                svg,
                "<text class=\"name {}{anchor}\" x=\"{x:.1}\" y=\"{:.1}\">{name}</text>",
                mark.class,
                bottom - 3.0
            );
        }
    }

    /// Where a label of so many letters may stand: right of its point, left, above and below; inside
    /// the drawing.
    fn beside(&self, [x, y]: [f64; 2], letters: usize) -> Vec<[f64; 4]> {
        let [width, height] = [LETTER[0] * letters as f64, LETTER[1]];
        let gap = POINT + 3.0;
        let corners = [
            [x + gap, y - 0.5 * height],
            [x - gap - width, y - 0.5 * height],
            [x, y - gap - height],
            [x, y + gap],
            [x - width, y - gap - height],
            [x - width, y + gap],
        ];
        let inside = corners
            .into_iter()
            .filter(|[left, _]| *left > MARGIN[0] && left + width < self.size[0]);
        inside.map(|[left, top]| [left, top, left + width, top + height]).collect()
    }

    /// The pieces of curves that run along an axis, which labels keep clear of.
    fn level_lines(&self) -> impl Iterator<Item = [f64; 4]> {
        let pieces = self.curves.iter().flat_map(|curve| curve.points.windows(2));
        let ends = pieces.map(|piece| [self.place(piece[0]), self.place(piece[1])]);
        ends.filter(|[a, b]| a[0] == b[0] || a[1] == b[1]).map(|[a, b]| {
            [a[0].min(b[0]) - 1.0, a[1].min(b[1]) - 1.0, a[0].max(b[0]) + 1.0, a[1].max(b[1]) + 1.0]
        })
    }
}

fn point(class: &str, [x, y]: [f64; 2], title: &str) -> String {
    format!(
        "<circle class=\"mark {class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{POINT}\">{title}</circle>"
    )
}

/// Returns whether two boxes (left, top, right, bottom) share an area.
fn overlap(a: &[f64; 4], b: &[f64; 4]) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// Text that is safe inside an element or an attribute.
#[must_use]
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_land_in_the_frame_and_text_is_escaped() {
        let chart = Chart {
            title: "a < b".into(),
            size: [300.0, 200.0],
            x: Axis::linear("x", 0.0, 1.0),
            y: Axis::decades("y", 1e-3, 1e2),
            curves: vec![Curve {
                class: "r".into(),
                points: vec![[0.0, 1e-3], [1.0, 1e2], [1.0, 1e9]],
            }],
            marks: vec![],
            key: vec![],
        };
        let svg = chart.svg();
        assert!(svg.contains("a &lt; b") && !svg.contains("a < b"));
        assert!(svg.contains("d=\"M52.0 162.0L288.0 26.0\""), "{svg}");
    }

    /// The places of the labels of a drawing.
    fn labels(chart: &Chart) -> Vec<[f64; 2]> {
        chart.svg().split("class=\"name m").skip(1).filter_map(place).collect()
    }

    /// The left end of a label, its attributes' text given.
    fn place(label: &str) -> Option<[f64; 2]> {
        let left = if label.starts_with(" end") { -35.0 } else { 0.0 };
        Some([attribute(label, "x=\"")? + left, attribute(label, "y=\"")?])
    }

    fn attribute(text: &str, key: &str) -> Option<f64> {
        text.split(key).nth(1)?.split('"').next()?.parse().ok()
    }

    #[test]
    fn labels_stand_clear_or_not_at_all() {
        let mark =
            Mark { class: "m".into(), at: [0.5, 0.5], label: "label".into(), always_named: false };
        let mut chart = Chart {
            title: String::new(),
            size: [300.0, 200.0],
            x: Axis::linear("x", 0.0, 1.0),
            y: Axis::linear("y", 0.0, 1.0),
            curves: vec![],
            marks: vec![mark; 9],
            key: vec![],
        };
        let places = labels(&chart);
        assert_eq!(places.len(), 6, "six boxes around one place, nine points");
        for (i, [x, y]) in places.iter().enumerate() {
            for [u, v] in &places[..i] {
                assert!((x - u).abs() >= 35.0 || (y - v).abs() >= 12.0, "{places:?}");
            }
        }
        chart.marks[8].always_named = true;
        assert_eq!(labels(&chart).len(), 7);
    }
}
