//! The audit of measurements as Markdown.

use std::fmt::Write as _;

use crate::report::measured::{Band, MeasuredAudit};
use crate::report::number::or_dash;

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
        let [red, green, blue] = [r, g, b].map(|at| marked(at.albedo));
        let _ = writeln!(text, "| {:.0}° | {red} | {green} | {blue} |", r.theta_deg);
    }
    text
}

fn row(band: &Band) -> String {
    format!(
        "| {:.0}° to {:.0}° | {} | {} | {} |\n",
        band.from_deg,
        band.to_deg,
        band.samples,
        or_dash(band.noise, percent),
        or_dash(band.reciprocity, percent)
    )
}

/// A share in percent.
fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

/// An albedo, bold where it exceeds 1.
fn marked(albedo: f64) -> String {
    if albedo > 1.0 { format!("**{albedo:.3}**") } else { format!("{albedo:.3}") }
}
