//! What a material's parameters keep and what they break: the model's laws, and the limits that
//! a fit to measurements is free to leave.

use std::f64::consts::{FRAC_PI_2, PI};

use serde::Serialize;

use crate::brdf::albedo::{FresnelMoments, specular_albedo};
use crate::brdf::{Lobe, MaskingKind, SgdBrdf};
use crate::material::{CatalogEntry, Channel, LobeParams, Material, find};
use crate::math::direction::{cos_sin_degrees, cot_theta, spherical};
use crate::math::quadrature::gauss_legendre;
use crate::microfacet::{Accuracy, Distribution as _, FittedMasking, Sgd, SgdNdf};

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
    /// Which channel.
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

/// A law and how far the evaluator is from it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Check {
    /// Which.
    pub law: Law,
    /// The largest deviation measured.
    pub deviation: f64,
    /// The deviation that rounding, or the precision of the printed table, explains.
    pub bound: f64,
}

/// What holds for any parameters in range, if the evaluator is right.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// f(wi, wo) = f(wo, wi).
    Reciprocity,
    /// ∫ D cosθ dω = 1.
    Normalisation,
    /// ∫ D G1(wo) ⟨wo,h⟩ dω = cosθo.
    WeakFurnace,
    /// The albedo with F ≡ 1 and 4ρs/π ≡ 1 is at most 1.
    NoGain,
    /// G1 is in [0, 1] and falls with θ.
    FallingMasking,
    /// K follows from α and p as printed; of catalogue materials only.
    PrintedK,
    /// θ0 follows from λ, c and k as printed; of catalogue materials only.
    PrintedTheta0,
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
    /// Which quantity, stored as it is.
    pub quantity: Stored,
    /// Its largest magnitude.
    pub largest: f64,
    /// Whether that is above 65504, the largest half float.
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

impl Check {
    /// Returns whether the law is kept.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.deviation <= self.bound
    }
}

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
    let printed = find(&material.name).ok().filter(|entry| entry.material == *material);
    let evaluators = Evaluators::new(material);
    let lobes: Vec<LobeAudit> =
        (0..material.lobes().len()).map(|j| LobeAudit::new(&evaluators, j)).collect();
    let channel = |c: usize| audit_channel(&evaluators, &lobes, Channel::ALL[c], printed);
    Audit { material: material.name.clone(), channels: std::array::from_fn(channel) }
}

/// A material to rounding, with the published masking, and to the six digits of albedo integrals.
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
    for j in &of_channel {
        for check in &lobes[*j].laws {
            match laws.iter_mut().find(|known| known.law == check.law) {
                Some(known) => known.deviation = worst([known.deviation, check.deviation]),
                None => laws.push(*check),
            }
        }
    }
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
    let peak = of_channel
        .iter()
        .map(|j| evaluators.exact.lobes[*j].distribution.peak())
        .fold(0.0, f64::max);
    ChannelAudit {
        channel,
        laws,
        gains_energy_from_deg: gain_angle(evaluators, c, &albedo),
        half: half_ranges(evaluators, c, peak, fresnel, &albedo),
        albedo: albedo.to_vec(),
        fresnel,
        masking_difference: differences
            .reduce(|a, b| if b.largest > a.largest { b } else { a })
            .unwrap_or(MaskingDifference { largest: 0.0, theta_deg: 0.0 }),
    }
}

/// The first angle of the curve above 1, refined to 0.1°.
fn gain_angle(evaluators: &Evaluators<'_>, c: usize, curve: &[AlbedoAt]) -> Option<f64> {
    let first = curve.iter().position(|at| at.albedo > 1.0)?;
    let Some(before) = first.checked_sub(1) else { return Some(0.0) };
    let (mut low, mut high) = (curve[before].theta_deg, curve[first].theta_deg);
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
    let range = |(quantity, largest): (Stored, f64)| HalfRange {
        quantity,
        largest,
        overflows: largest > half::f16::MAX.to_f64(),
    };
    largest.map(range).to_vec()
}

fn masking_difference(exact: &Lobe<Sgd>, fitted: &Lobe<Sgd>) -> MaskingDifference {
    let at = |step: i32| {
        let theta_deg = f64::from(step) * 0.1;
        let (cos, sin) = cos_sin_degrees(theta_deg);
        let largest = (fitted.g1(cos / sin) - exact.g1(cos / sin)).abs();
        MaskingDifference { largest, theta_deg }
    };
    let angles = (1..900).map(at);
    angles.reduce(|a, b| if b.largest > a.largest { b } else { a }).unwrap_or_else(|| at(1))
}

/// |f(wi, wo) − f(wo, wi)|/f over pairs of every elevation.
fn reciprocity(brdf: &SgdBrdf, c: usize) -> Check {
    let pair = |i: u32| {
        let theta = |step: u32| FRAC_PI_2 * (f64::from(step % 17) + 0.5) / 17.0;
        (spherical(theta(i), 0.3 * f64::from(i)), spherical(theta(i * 5 + 3), 1.1))
    };
    let deviation = worst((0..17 * 17).map(pair).map(|(wi, wo)| {
        let (there, back): (f64, f64) = (brdf.eval(wi, wo)[c], brdf.eval(wo, wi)[c]);
        if there == back { 0.0 } else { (there - back).abs() / there.abs().max(back.abs()) }
    }));
    Check { law: Law::Reciprocity, deviation, bound: 2.0 * f64::EPSILON }
}

/// ∫ D cosθ dω = π ∫ D cos⁴θ dx over x = tan²θ.
fn normalisation(ndf: &SgdNdf) -> Check {
    let rule = slope_rule(ndf, f64::INFINITY);
    let integral: f64 = rule.iter().map(|(x, dx)| PI * ndf.slope_density(*x) * dx).sum();
    Check { law: Law::Normalisation, deviation: (integral - 1.0).abs(), bound: 1e-10 }
}

/// ∫ D G1(wo) ⟨wo,h⟩ dω/cosθo at five angles.
fn weak_furnace(lobe: &Lobe<Sgd>) -> Check {
    let deviation = worst([5.0, 45.0, 75.0, 85.0, 89.0].map(|theta_deg: f64| {
        let wo = spherical(theta_deg.to_radians(), 0.0);
        // A facet begins to be turned away where its slope exceeds cotθo.
        let rule = slope_rule(lobe.distribution.closed_form(), cot_theta(wo).powi(2));
        let facing: f64 = rule
            .iter()
            .map(|(x, dx)| {
                PI * lobe.distribution.slope_density(*x) * facing_mean(wo.z, wo.x * x.sqrt()) * dx
            })
            .sum();
        (facing * lobe.g1(cot_theta(wo)) / wo.z - 1.0).abs()
    }));
    Check { law: Law::WeakFurnace, deviation, bound: 1e-9 }
}

/// The mean over azimuth of max(0, a + b cosφ), a > 0, b ≥ 0.
fn facing_mean(a: f64, b: f64) -> f64 {
    if b <= a {
        return a;
    }
    let limit = (-a / b).acos();
    (a * limit + b * limit.sin()) / PI
}

/// How far above 1 the albedo with F ≡ 1 comes.
fn no_gain(lobe: &Lobe<Sgd>) -> Check {
    let gain = |theta_deg: f64| FresnelMoments::new(lobe, cos_sin_degrees(theta_deg).0).one - 1.0;
    let deviation = worst([0.0, 40.0, 70.0, 85.0, 89.0].map(gain));
    Check { law: Law::NoGain, deviation, bound: 1e-5 }
}

/// How far G1 leaves [0, 1] or rises with θ.
fn falling_masking(lobe: &Lobe<Sgd>) -> Check {
    let g1 = |step: i32| {
        let (cos, sin) = cos_sin_degrees(f64::from(step) * 0.25);
        lobe.g1(cos / sin)
    };
    let values: Vec<f64> = (0..=360).map(g1).collect();
    let outside = values.iter().map(|g1| (g1 - 1.0).max(-g1));
    let rise = values.windows(2).map(|pair| pair[1] - pair[0]);
    let deviation = worst(outside.chain(rise));
    Check { law: Law::FallingMasking, deviation, bound: 1e-12 }
}

/// The largest excess, 0 where there is none; NaN where one is NaN, which keeps no law.
fn worst(excesses: impl IntoIterator<Item = f64>) -> f64 {
    let excesses = excesses.into_iter().map(|excess| excess.clamp(0.0, f64::INFINITY).abs());
    excesses.max_by(f64::total_cmp).unwrap_or(0.0)
}

fn printed_k(lobe: &LobeParams, printed: f64) -> Check {
    let deviation = (SgdNdf::new(lobe.alpha(), lobe.p()).k() / printed - 1.0).abs();
    Check { law: Law::PrintedK, deviation, bound: PRINT_PRECISION }
}

fn printed_theta0(lobe: &LobeParams, printed: f64) -> Option<Check> {
    let theta0 = FittedMasking::new(lobe.masking()?).theta0();
    Some(Check {
        law: Law::PrintedTheta0,
        deviation: (theta0 - printed).abs(),
        bound: PRINT_PRECISION,
    })
}

/// What the table's six digits leave open, relative for K, in radians for θ0.
const PRINT_PRECISION: f64 = 6e-6;

/// Nodes (x, dx) over x = tan²θ, dense on every logarithmic scale from far below the lobe's core to
/// where it has vanished; beyond `kink` in powers of √(x − kink).
fn slope_rule(ndf: &SgdNdf, kink: f64) -> Vec<(f64, f64)> {
    const TINY: f64 = 1e-14;
    let core = ndf.alpha().min(ndf.alpha() * ndf.alpha());
    let (low, high) = (TINY * core, 800.0 * ndf.alpha());
    if kink >= high {
        return log_rule(low, high);
    }
    let end = (high - kink).sqrt();
    let beyond = log_rule(1e-9 * end, end).into_iter().map(|(t, dt)| (kink + t * t, 2.0 * t * dt));
    let below = if kink > low { log_rule(low, kink) } else { Vec::new() };
    below.into_iter().chain(beyond).collect()
}

/// Gauss–Legendre in ln x, a piece for every factor e².
fn log_rule(low: f64, high: f64) -> Vec<(f64, f64)> {
    let length = (high / low).ln();
    let pieces = (length / 2.0).ceil().max(1.0);
    let width = length / pieces;
    let nodes = gauss_legendre(24);
    let piece = |i: u32| {
        let start = low.ln() + f64::from(i) * width;
        nodes.iter().map(move |node| {
            let x = (start + node.x * width).exp();
            (x, node.weight * width * x)
        })
    };
    (0..pieces as u32).flat_map(piece).collect()
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
    fn what_is_no_number_keeps_no_law() {
        assert_eq!(worst([-2.0, 0.5, 0.25]), 0.5);
        assert_eq!(worst([-2.0, -1.0]), 0.0);
        let check = |deviation| Check { law: Law::NoGain, deviation, bound: 1.0 };
        for nan in [f64::NAN, -f64::NAN] {
            assert!(!check(worst([0.5, nan, 0.25])).holds());
        }
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
