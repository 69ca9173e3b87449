//! The audit of measurements as Markdown.

use std::fmt::Write as _;

use crate::report::measured::{Band, MeasuredAudit};

/// A section for each measurement: coverage, noise and reciprocity by elevation, energy.
#[must_use]
pub fn markdown(audits: &[MeasuredAudit]) -> String {
    audits.iter().map(section).collect::<Vec<_>>().join("\n")
}

fn section(audit: &MeasuredAudit) -> String {
    let mut text = format!(
        "## {}\n\n{} measured values, which stand for {:.1} % of all pairs of directions.\n\n\
         | larger of θi, θo | values looked at | noise | f(wi, wo) against f(wo, wi) |\n|---|---|---|---|\n",
        audit.measurement,
        audit.samples,
        100.0 * audit.coverage
    );
    audit.bands.iter().for_each(|band| text.push_str(&row(band)));
    text.push_str(
        "\nNoise is the median relative spread over φd, −φd, φd + π and π − φd, at which an \
         isotropic reciprocal surface has one value.\n\n| θo | albedo r | g | b |\n|---|---|---|---|\n",
    );
    let [r, g, b] = audit.channels.each_ref().map(|channel| &channel.albedo);
    for ((r, g), b) in r.iter().zip(g).zip(b) {
        let mark = |albedo: f64| {
            if albedo > 1.0 { format!("**{albedo:.3}**") } else { format!("{albedo:.3}") }
        };
        let [red, green, blue] = [r, g, b].map(|at| mark(at.albedo));
        let _ = writeln!(text, "| {:.0}° | {red} | {green} | {blue} |", r.theta_deg);
    }
    text
}

fn row(band: &Band) -> String {
    let percent = |share: Option<f64>| {
        share.map_or("–".to_owned(), |share| format!("{:.2} %", 100.0 * share))
    };
    format!(
        "| {:.0}° to {:.0}° | {} | {} | {} |\n",
        band.from_deg,
        band.to_deg,
        band.samples,
        percent(band.noise),
        percent(band.reciprocity)
    )
}
