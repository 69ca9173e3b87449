//! The audit as Markdown.

use std::fmt::Write as _;

use crate::material::Channel;
use crate::report::audit::{Audit, ChannelAudit, Stored};
use crate::report::laws::Law;
use crate::report::number::or_dash;

/// The audit of any number of materials as one page: the laws, then what the published numbers
/// do beyond them.
#[must_use]
pub fn markdown(audits: &[Audit]) -> String {
    let title = format!(
        "# Audit\n\n{} materials, {} channels.\n\n",
        audits.len(),
        channels(audits).count()
    );
    title + &laws(audits) + &findings(audits) + &half_floats(audits) + &masking(audits)
}

/// A line per law: the worst deviation of all channels.
fn laws(audits: &[Audit]) -> String {
    let mut text = String::from(
        "## Laws\n\nThey hold for any parameters in range; a deviation above the bound is an error \
         of the evaluator, or of the table's digits.\n\n| law | largest deviation | at | bound | kept |\n\
         |---|---|---|---|---|\n",
    );
    for law in Law::ALL {
        let checks = channels(audits).flat_map(|(name, channel)| {
            channel
                .laws
                .iter()
                .filter(move |c| c.law == law)
                .map(move |c| (name, channel.channel, c))
        });
        // A law that no channel was checked for: the printed constants of other materials.
        let Some((name, channel, worst)) =
            checks.max_by(|a, b| a.2.deviation.total_cmp(&b.2.deviation))
        else {
            continue;
        };
        let kept = if worst.holds() { "yes" } else { "**no**" };
        let at = if worst.deviation > 0.0 { at(name, channel) } else { "everywhere".to_owned() };
        let _ = writeln!(
            text,
            "| {} | {:.1e} | {at} | {:.1e} | {kept} |",
            law.describe(),
            worst.deviation,
            worst.bound
        );
    }
    text + "\n"
}

/// The channels that gain energy or whose Fresnel curve leaves [0, 1].
fn findings(audits: &[Audit]) -> String {
    let odd: Vec<_> = channels(audits)
        .filter(|(_, c)| c.gains_energy_from_deg.is_some() || c.fresnel_leaves_unit())
        .collect();
    let gaining = odd.iter().filter(|(_, c)| c.gains_energy_from_deg.is_some()).count();
    let leaving = odd.iter().filter(|(_, c)| c.fresnel_leaves_unit()).count();
    let mut text = format!(
        "## Energy and Fresnel range\n\nProperties of the published fits, not of the evaluator: \
         {gaining} channels reflect more than they receive at some angle up to 89.9°, {leaving} have a \
         Fresnel curve that leaves [0, 1].\n\n"
    );
    if odd.is_empty() {
        return text;
    }
    text.push_str(
        "| material | channel | albedo > 1 from | largest albedo | F smallest | F largest |\n\
         |---|---|---|---|---|---|\n",
    );
    for (name, channel) in odd {
        let from = or_dash(channel.gains_energy_from_deg, |angle| format!("{angle:.1}°"));
        let [low, high] = channel.fresnel;
        let _ = writeln!(
            text,
            "| {name} | {} | {from} | {} | {} | {} |",
            channel.channel.name(),
            mark(channel.largest_albedo() > 1.0, channel.largest_albedo()),
            mark(low < -1e-6, low),
            mark(high > 1.0 + 1e-6, high),
        );
    }
    text + "\n"
}

/// A number, in bold if it is one that should not be.
fn mark(outside: bool, value: f64) -> String {
    if outside { format!("**{value:.3}**") } else { format!("{value:.3}") }
}

/// The limits that a material's numbers break, a sentence each, or one that says that none is broken.
#[must_use]
pub fn findings_of(audit: &Audit) -> Vec<String> {
    let mut found: Vec<String> = audit.channels.iter().flat_map(channel_findings).collect();
    if found.is_empty() {
        found.push(
            "Energy is conserved at every angle, F stays in [0, 1], all fits half floats.".into(),
        );
    }
    found
}

fn channel_findings(channel: &ChannelAudit) -> Vec<String> {
    let name = channel.channel.name();
    let energy = channel.gains_energy_from_deg.map(|angle| {
        let most = channel.largest_albedo();
        format!("{name}: reflects more than it receives from {angle:.1}°, up to {most:.2} times")
    });
    let [low, high] = channel.fresnel;
    let fresnel = channel
        .fresnel_leaves_unit()
        .then(|| format!("{name}: F leaves [0, 1]: from {low:.3} to {high:.3}"));
    let half = channel.half.iter().filter(|range| range.overflows).map(|range| {
        let what = range.quantity.describe();
        format!("{name}: {what} reaches {:.2e}, more than a half float holds", range.largest)
    });
    energy.into_iter().chain(fresnel).chain(half).collect()
}

/// The quantities that a half float cannot hold as they are.
fn half_floats(audits: &[Audit]) -> String {
    let mut text = String::from(
        "## Half floats\n\nA half float ends at 65504. The largest value of each quantity:\n\n\
         | quantity | largest | at | channels that overflow |\n|---|---|---|---|\n",
    );
    for quantity in Stored::ALL {
        let ranges = channels(audits).flat_map(|(name, channel)| {
            channel
                .half
                .iter()
                .filter(move |r| r.quantity == quantity)
                .map(move |r| (name, channel.channel, r))
        });
        let overflowing: Vec<String> =
            ranges.clone().filter(|(.., r)| r.overflows).map(|(name, c, _)| at(name, c)).collect();
        let Some((name, channel, most)) = ranges.max_by(|a, b| a.2.largest.total_cmp(&b.2.largest))
        else {
            continue;
        };
        let overflowing = match overflowing.len() {
            0 => "none".to_owned(),
            // More names than this would not fit a cell of the table.
            1..=8 => overflowing.join(", "),
            many => format!("{many} channels"),
        };
        let _ = writeln!(
            text,
            "| {} | {:.3e} | {} | {overflowing} |",
            quantity.describe(),
            most.largest,
            at(name, channel)
        );
    }
    text + "\n"
}

/// The errors of the published masking fits.
fn masking(audits: &[Audit]) -> String {
    let mut differences: Vec<_> = channels(audits)
        .map(|(name, channel)| (name, channel.channel, channel.masking_difference))
        .collect();
    differences.sort_by(|a, b| b.2.largest.total_cmp(&a.2.largest));
    let mut text = String::from("## Masking: the published fit against Smith's integral\n\n");
    if let Some((_, _, median)) = differences.get(differences.len() / 2) {
        let _ = writeln!(
            text,
            "The median of the channels' largest |ΔG1| is {:.1e}. The worst:\n",
            median.largest
        );
    }
    text.push_str("| material | channel | largest abs. ΔG1 | at |\n|---|---|---|---|\n");
    for (name, channel, difference) in differences.iter().take(10) {
        let _ = writeln!(
            text,
            "| {name} | {} | {:.4} | {:.1}° |",
            channel.name(),
            difference.largest,
            difference.theta_deg
        );
    }
    text
}

fn channels(audits: &[Audit]) -> impl Iterator<Item = (&str, &ChannelAudit)> + Clone {
    audits.iter().flat_map(|audit| {
        audit.channels.iter().map(move |channel| (audit.material.as_str(), channel))
    })
}

fn at(name: &str, channel: Channel) -> String {
    format!("{name} {}", channel.name())
}

impl Law {
    /// Every law, in the order of the page.
    pub const ALL: [Self; 7] = [
        Self::Reciprocity,
        Self::Normalisation,
        Self::WeakFurnace,
        Self::NoGain,
        Self::FallingMasking,
        Self::PrintedK,
        Self::PrintedTheta0,
    ];

    /// The law in words.
    #[must_use]
    pub fn describe(self) -> &'static str {
        match self {
            Self::Reciprocity => "reciprocity f(wi, wo) = f(wo, wi)",
            Self::Normalisation => "∫ D cosθ dω = 1",
            Self::WeakFurnace => "weak furnace ∫ D G1(wo)⟨wo,h⟩ dω = cosθo",
            Self::NoGain => "albedo with F ≡ 1 at most 1",
            Self::FallingMasking => "G1 in [0, 1], falling with θ",
            Self::PrintedK => "K as printed",
            Self::PrintedTheta0 => "θ0 as printed",
        }
    }
}

impl Stored {
    /// Every quantity, in the order of the page.
    pub const ALL: [Self; 4] = [Self::Ndf, Self::Fresnel, Self::Albedo, Self::GrazingBrdf];

    /// The quantity in words.
    #[must_use]
    pub fn describe(self) -> &'static str {
        match self {
            Self::Ndf => "D",
            Self::Fresnel => "F",
            Self::Albedo => "directional albedo",
            Self::GrazingBrdf => "f at the mirror direction of 89.9°",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::find;
    use crate::report::audit::audit;

    #[test]
    fn the_page_names_what_it_found() {
        let audits = ["white-paint", "gold-paint"]
            .map(|name| audit(&find(name).expect("in the catalogue").material));
        let page = markdown(&audits);
        assert!(page.contains("2 materials, 6 channels."));
        assert!(page.contains("| white-paint | r | "), "{page}");
        assert!(!page.contains("| gold-paint | g | 8"), "it gains nothing");
        assert!(!page.contains("**no**"), "{page}");
    }
}
