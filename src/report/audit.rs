//! The audit of a material: the model's laws, and the limits that a fit to measurements is free to
//! leave.

use std::f64::consts::PI;

use serde::Serialize;

use crate::brdf::albedo::specular_albedo;
use crate::brdf::{Lobe, MaskingKind, SgdBrdf};
use crate::material::{CatalogEntry, Channel, Material, find};
use crate::math::direction::{cos_sin_degrees, spherical};
use crate::microfacet::{Accuracy, Sgd};
use crate::report::laws::{
    Check, falling_masking, no_gain, normalisation, printed_k, printed_theta0, reciprocity,
    weak_furnace, worst,
};

/// A material's audit.
#[derive(Clone, Debug, Serialize)]
pub struct Audit {
    /// The material.
    pub material: String,
    /// Its channels in the order r, g, b.
    pub channels: [ChannelAudit; 3],
}

/// The findings about one channel.
#[derive(Clone, Debug, Serialize)]
pub struct ChannelAudit {
    /// The channel.
    pub channel: Channel,
    /// The laws that hold for any parameters, of the lobes that colour the channel.
    pub laws: Vec<Check>,
    /// ∫ f cosθi dωi against θo.
    pub albedo: Vec<AlbedoAt>,
    /// The smallest angle, to 0.1°, from which the albedo exceeds 1.
    pub gains_energy_from_deg: Option<f64>,
    /// Smallest and largest F(cosθd) over all angles, of the lobes that colour the channel.
    pub fresnel: [f64; 2],
    /// Largest magnitude of each quantity, against what a half float holds.
    pub half: Vec<HalfRange>,
    /// Largest |G1 fitted − G1 exact|, and where.
    pub masking_difference: MaskingDifference,
}

/// The albedo at one angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AlbedoAt {
    /// θo \[degrees\].
    pub theta_deg: f64,
    /// Diffuse and specular together.
    pub albedo: f64,
}

/// A quantity's largest magnitude.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HalfRange {
    /// The quantity, stored as it is.
    pub quantity: Stored,
    /// Its largest magnitude.
    pub largest: f64,
    /// True if that is above 65504, the largest half float.
    pub overflows: bool,
}

/// A factor that a texture could store.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stored {
    /// D(h).
    Ndf,
    /// F.
    Fresnel,
    /// The directional albedo.
    Albedo,
    /// f of the mirror direction at 89.9°.
    GrazingBrdf,
}

/// Where the published masking fit is worst.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MaskingDifference {
    /// |G1 fitted − G1 exact|.
    pub largest: f64,
    /// θ of it \[degrees\].
    pub theta_deg: f64,
}

/// Angles of the albedo curve \[degrees\].
const ALBEDO_ANGLES: [f64; 14] =
    [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 75.0, 80.0, 85.0, 87.0, 89.0, 89.9];

impl ChannelAudit {
    /// The largest albedo of the curve.
    #[must_use]
    pub fn largest_albedo(&self) -> f64 {
        self.albedo.iter().map(|at| at.albedo).fold(0.0, f64::max)
    }

    /// Returns whether F leaves [0, 1], beyond the digits of the printed parameters.
    #[must_use]
    pub fn fresnel_leaves_unit(&self) -> bool {
        self.fresnel[0] < -1e-6 || self.fresnel[1] > 1.0 + 1e-6
    }
}

/// Audits a material.
#[must_use]
pub fn audit(material: &Material) -> Audit {
    // A file may change the numbers and keep the name: then the printed ones are not its own.
    let printed = find(&material.name).ok().filter(|entry| entry.material == *material);
    let evaluators = Evaluators::new(material);
    // Once per lobe: a refitted one colours three channels.
    let lobes: Vec<LobeAudit> =
        (0..material.lobes().len()).map(|j| LobeAudit::new(&evaluators, j)).collect();
    let channels = Channel::ALL.map(|channel| audit_channel(&evaluators, &lobes, channel, printed));
    Audit { material: material.name.clone(), channels }
}

/// A material exact to rounding, with the published masking, and to the six digits that albedo
/// integrals need.
struct Evaluators<'a> {
    material: &'a Material,
    exact: SgdBrdf,
    fitted: SgdBrdf,
    quick: SgdBrdf,
}

impl<'a> Evaluators<'a> {
    fn new(material: &'a Material) -> Self {
        Self {
            material,
            exact: SgdBrdf::new(material, MaskingKind::Exact),
            fitted: SgdBrdf::new(material, MaskingKind::Fitted),
            quick: SgdBrdf::with_accuracy(material, MaskingKind::Exact, Accuracy::Picture),
        }
    }

    /// ρd + the specular albedo at θo, of one colour.
    fn albedo(&self, c: usize, theta_deg: f64) -> f64 {
        let cos_theta_o = cos_sin_degrees(theta_deg).0;
        let colouring = self.quick.lobes.iter().filter(|lobe| lobe.rho_s[c] > 0.0);
        colouring.fold(self.quick.rho_d[c], |sum, lobe| sum + specular_albedo(lobe, cos_theta_o)[c])
    }

    /// The lobes that colour a channel; of a channel without, the one of its index.
    fn lobes_of(&self, c: usize) -> Vec<usize> {
        let lobes = self.material.lobes();
        let colouring: Vec<usize> =
            (0..lobes.len()).filter(|j| lobes[*j].rho_s()[c] > 0.0).collect();
        match lobes.len() {
            0 => colouring,
            count if colouring.is_empty() => vec![c.min(count - 1)],
            _ => colouring,
        }
    }
}

/// The findings about one lobe.
struct LobeAudit {
    laws: Vec<Check>,
    masking_difference: MaskingDifference,
}

impl LobeAudit {
    fn new(evaluators: &Evaluators<'_>, j: usize) -> Self {
        let exact = &evaluators.exact.lobes[j];
        Self {
            laws: vec![
                normalisation(exact.distribution.closed_form()),
                weak_furnace(exact),
                no_gain(&evaluators.quick.lobes[j]),
                falling_masking(exact),
            ],
            masking_difference: masking_difference(exact, &evaluators.fitted.lobes[j]),
        }
    }
}

fn audit_channel(
    evaluators: &Evaluators<'_>,
    lobes: &[LobeAudit],
    channel: Channel,
    printed: Option<&CatalogEntry>,
) -> ChannelAudit {
    let c = channel as usize;
    let of_channel = evaluators.lobes_of(c);
    let mut laws = vec![reciprocity(&evaluators.exact, c)];
    for check in of_channel.iter().flat_map(|j| &lobes[*j].laws) {
        // Of several lobes the worst deviation stands for the channel.
        match laws.iter_mut().find(|known| known.law == check.law) {
            Some(known) => known.deviation = worst([known.deviation, check.deviation]),
            None => laws.push(*check),
        }
    }
    // The table prints a row for each channel, whose lobe it is.
    if let (Some(entry), Some(j)) = (printed, of_channel.first()) {
        let lobe = &evaluators.material.lobes()[*j];
        laws.push(printed_k(lobe, entry.printed[c].k));
        laws.extend(printed_theta0(lobe, entry.printed[c].theta0));
    }
    let albedo = ALBEDO_ANGLES
        .map(|theta_deg| AlbedoAt { theta_deg, albedo: evaluators.albedo(c, theta_deg) });
    let fresnel = of_channel
        .iter()
        .map(|j| evaluators.exact.lobes[*j].fresnel[c].range())
        .reduce(|[a, b], [low, high]| [a.min(low), b.max(high)])
        .unwrap_or([0.0, 0.0]);
    let differences = of_channel.iter().map(|j| lobes[*j].masking_difference);
    let difference = differences.reduce(|a, b| if b.largest > a.largest { b } else { a });
    let peaks = of_channel.iter().map(|j| evaluators.exact.lobes[*j].distribution.peak());
    let peak = peaks.fold(0.0, f64::max);
    ChannelAudit {
        channel,
        laws,
        gains_energy_from_deg: gain_angle(evaluators, c, &albedo),
        half: half_ranges(evaluators, c, peak, fresnel, &albedo),
        albedo: albedo.to_vec(),
        fresnel,
        masking_difference: difference
            .unwrap_or(MaskingDifference { largest: 0.0, theta_deg: 0.0 }),
    }
}

/// The first angle of the curve above 1, refined to 0.1°.
fn gain_angle(evaluators: &Evaluators<'_>, c: usize, curve: &[AlbedoAt]) -> Option<f64> {
    let first = curve.iter().position(|at| at.albedo > 1.0)?;
    // Already at normal incidence.
    let Some(before) = first.checked_sub(1) else { return Some(0.0) };
    let (mut low, mut high) = (curve[before].theta_deg, curve[first].theta_deg);
    // The albedo is taken to cross 1 once between two angles of the curve.
    while high - low > 0.1 {
        let middle = 0.5 * (low + high);
        if evaluators.albedo(c, middle) > 1.0 { high = middle } else { low = middle }
    }
    Some((high * 10.0).round() / 10.0)
}

fn half_ranges(
    evaluators: &Evaluators<'_>,
    c: usize,
    peak: f64,
    fresnel: [f64; 2],
    albedo: &[AlbedoAt],
) -> Vec<HalfRange> {
    let (theta, opposite) = (89.9_f64.to_radians(), PI);
    let grazing = evaluators.exact.eval(spherical(theta, 0.0), spherical(theta, opposite))[c].abs();
    let largest = [
        (Stored::Ndf, peak),
        (Stored::Fresnel, fresnel[0].abs().max(fresnel[1].abs())),
        (Stored::Albedo, albedo.iter().map(|at| at.albedo.abs()).fold(0.0, f64::max)),
        (Stored::GrazingBrdf, grazing),
    ];
    let ranges = largest.map(|(quantity, largest)| HalfRange {
        quantity,
        largest,
        overflows: largest > half::f16::MAX.to_f64(),
    });
    ranges.to_vec()
}

fn masking_difference(exact: &Lobe<Sgd>, fitted: &Lobe<Sgd>) -> MaskingDifference {
    let mut worst = MaskingDifference { largest: 0.0, theta_deg: 0.1 };
    // Neither 0° nor 90°, where the cotangent is infinite or G1 is 0 both ways.
    for step in 1..900 {
        let theta_deg = f64::from(step) * 0.1;
        let (cos, sin) = cos_sin_degrees(theta_deg);
        let largest = (fitted.g1(cos / sin) - exact.g1(cos / sin)).abs();
        if largest > worst.largest {
            worst = MaskingDifference { largest, theta_deg };
        }
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: &str) -> Audit {
        audit(&find(name).expect("in the catalogue").material)
    }

    #[test]
    fn published_materials_keep_the_laws() {
        for name in ["gold-paint", "chrome", "pink-fabric"] {
            for channel in of(name).channels {
                assert_eq!(channel.laws.len(), 7);
                for check in channel.laws {
                    assert!(check.holds(), "{name}: {check:?}");
                }
            }
        }
    }

    #[test]
    fn energy_gained_by_published_fits_is_found() {
        let [red, ..] = of("white-paint").channels;
        let at_80 = red.albedo.iter().find(|at| at.theta_deg == 80.0).expect("on the curve");
        assert!((at_80.albedo - 1.82).abs() < 0.01, "{at_80:?}");
        assert!(red.gains_energy_from_deg.is_some_and(|angle| angle < 80.0));
        let [_, green, _] = of("gold-metallic-paint2").channels;
        assert!(green.gains_energy_from_deg.is_some_and(|angle| (80.0..85.0).contains(&angle)));
        assert_eq!(of("gold-paint").channels[1].gains_energy_from_deg, None);
    }

    #[test]
    fn fresnel_outside_the_unit_interval_is_found() {
        let [.., blue] = of("beige-fabric").channels;
        assert!(blue.fresnel_leaves_unit() && blue.fresnel[1] > 4.9, "{:?}", blue.fresnel);
    }

    #[test]
    fn a_broken_law_is_seen() {
        let entry = find("gold-paint").expect("in the catalogue");
        let mut channels = entry.channels;
        channels[0].alpha *= 1.001;
        let material = Material::of_channels("gold-paint", &channels).expect("in range");
        assert!(!printed_k(&material.lobes()[0], entry.printed[0].k).holds());
        assert_eq!(
            audit(&material).channels[0].laws.len(),
            5,
            "another material is not held to the table"
        );
    }
}
