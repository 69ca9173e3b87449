//! Speed against error as Markdown and as a picture.

use std::fmt::Write as _;

use crate::encode::GENERATOR;
use crate::report::axis::Axis;
use crate::report::chart::{Chart, Curve, Key, Mark, Shown};
use crate::report::machine::Machine;
use crate::report::pareto_front::RULE;
use crate::report::sheet_page::STYLE;
use crate::report::speed_error::{Measured, MethodFamily, SpeedError};

/// The report of several materials; `picture` names the file of a material's picture.
#[must_use]
pub fn markdown(reports: &[SpeedError], machine: &Machine, pictures: &[String]) -> String {
    let mut page = format!(
        "# Speed against error\n\nMeasured by {GENERATOR} on {}. Times are medians of rounds taken in \
         turns, of pairs of directions spread over the hemisphere; the spread is half the distance \
         between the quartiles. Errors are against the exact f64 reflectance: |Δf|cosθi over the \
         largest f·cosθi of the same wo, over lights drawn from the surface's own lobe, and ΔE2000 on \
         a ball under one light. **Bold** methods are on the Pareto front of time and largest error. \
         {RULE}.\n",
        machine.describe()
    );
    for (report, picture) in reports.iter().zip(pictures) {
        let _ = write!(
            page,
            "\n## {0}\n\n![{0}]({1})\n\n{2}",
            report.material,
            picture,
            table(&report.methods)
        );
    }
    page
}

fn table(methods: &[Measured]) -> String {
    let mut text = String::from(
        "| method | ns per RGB | ± | repeats | bytes | preparation, ms | largest error | RMS error | ΔE mean | ΔE largest | margin |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for m in methods {
        let name = if m.front { format!("**{}**", m.method) } else { m.method.clone() };
        let _ = writeln!(
            text,
            "| {name} | {:.1} | {:.1} | {} | {} | {:.3} | {:.1e} | {:.1e} | {:.3} | {:.2} | {} |",
            m.time.median_ns,
            m.time.spread_ns,
            m.time.repeats,
            m.bytes,
            m.preparation_ms,
            m.error.max,
            m.error.rms,
            m.error.delta_e_mean,
            m.error.delta_e_max,
            margin(m.margin),
        );
    }
    text
}

/// A margin, or a dash where it is infinite: no method is as near or as fast.
fn margin(margin: f64) -> String {
    if margin.is_finite() { format!("{margin:.2}") } else { "–".to_owned() }
}

/// Errors below this are drawn on the axis: what rounding in f64 leaves.
const SMALLEST_ERROR: f64 = 1e-14;

/// Time against largest error of a material's methods, the front drawn: a complete SVG file.
#[must_use]
pub fn picture(report: &SpeedError) -> String {
    let mut front: Vec<[f64; 2]> = report.methods.iter().filter(|m| m.front).map(place).collect();
    front.sort_by(|a, b| a[0].total_cmp(&b[0]));
    // The front's labels are placed first, beside their points.
    let (first, rest): (Vec<&Measured>, Vec<&Measured>) =
        report.methods.iter().partition(|m| m.front);
    let places: Vec<[f64; 2]> = report.methods.iter().map(place).collect();
    let step =
        Key { shown: Shown::Line, class: "front", label: "front: the least error in the time" };
    let chart = Chart {
        title: format!("{}: largest error against time", report.material),
        size: [800.0, 580.0],
        x: Axis::decades(
            "ns per RGB evaluation",
            places.iter().map(|[time, _]| *time).fold(f64::INFINITY, f64::min),
            places.iter().map(|[time, _]| *time).fold(0.0, f64::max),
        ),
        y: Axis::decades(
            "largest error, relative to the largest f·cosθi of the same wo",
            SMALLEST_ERROR,
            places.iter().map(|[_, error]| *error).fold(1.0, f64::max),
        ),
        curves: vec![Curve { class: "front".to_owned(), points: stairs(&front) }],
        marks: first.into_iter().chain(rest).map(mark).collect(),
        key: MethodFamily::ALL
            .map(|family| Key { shown: Shown::Point, class: family.name(), label: family.name() })
            .into_iter()
            .chain([step])
            .collect(),
    };
    chart.file(STYLE)
}

/// A method's place in the chart.
fn place(m: &Measured) -> [f64; 2] {
    [m.time.median_ns, m.error.max.max(SMALLEST_ERROR)]
}

/// A method's point in the chart.
fn mark(m: &Measured) -> Mark {
    Mark {
        class: format!("{}{}", m.family.name(), if m.front { " front" } else { "" }),
        at: place(m),
        label: m.method.clone(),
        always_named: m.front,
    }
}

/// From each point level to the next one's time, then down to its error.
fn stairs(front: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let next = front.iter().skip(1).chain(front.last());
    front.iter().zip(next).flat_map(|(own, next)| [*own, [next[0], own[1]]]).collect()
}
