//! The sheet's plots: lobes in the plane of incidence, D, G1, F and the albedo.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::brdf::{Lobe as MicrofacetLobe, Reflectance};
use crate::material::Channel;
use crate::math::direction::{cos_sin_degrees, spherical};
use crate::microfacet::{Distribution as _, FittedMasking, Sgd};
use crate::report::axis::Axis;
use crate::report::chart::{Chart, Curve};
use crate::report::polar::{Lobe, Polar};
use crate::report::sheet::Sheet;

/// The plots of a sheet as `svg` elements.
pub struct Plots {
    /// Per angle of incidence, one per channel.
    pub lobes: Vec<(f64, [String; 3])>,
    /// F against θd.
    pub fresnel: String,
    /// D against θh, per lobe.
    pub ndf: Vec<String>,
    /// G1 against θ, exact and as published.
    pub masking: String,
    /// The difference of the two.
    pub masking_difference: String,
    /// The directional albedo against θo.
    pub albedo: String,
}

/// Angles of incidence of the lobes \[degrees\].
const INCIDENCES: [f64; 4] = [10.0, 30.0, 50.0, 70.0];

/// CSS classes of the fits, in the sheet's order.
const FIT_CLASSES: [&str; 3] = ["beckmann", "ggx", "gltf"];

/// Angles on each side of the normal of a curve, a third of a degree apart: the mirror direction of
/// every incidence is among them. And of the points of a measurement.
const STEPS: i32 = 269;
const POINTS: i32 = 35;

const CHART_SIZE: [f64; 2] = [340.0, 240.0];

/// Every plot of a sheet.
#[must_use]
pub fn plots(sheet: &Sheet<'_>) -> Plots {
    Plots {
        lobes: INCIDENCES.map(|theta| (theta, lobes(sheet, theta))).to_vec(),
        fresnel: fresnel(sheet),
        ndf: (0..sheet.sgd.lobes.len()).map(|j| ndf(sheet, j)).collect(),
        masking: masking(sheet),
        masking_difference: masking_difference(sheet),
        albedo: albedo(sheet),
    }
}

/// ∛f in the plane of incidence, SGD over the fits, per channel.
fn lobes(sheet: &Sheet<'_>, theta_deg: f64) -> [String; 3] {
    let theta_i = theta_deg.to_radians();
    let models = sheet.fits.reflectances().into_iter().zip(FIT_CLASSES);
    let curves: Vec<(&str, Vec<[f64; 4]>)> = models
        .chain([(&sheet.sgd as &dyn Reflectance, "sgd")])
        .map(|(model, class)| (class, plane_of_incidence(model, theta_i, STEPS)))
        .collect();
    let measured = sheet.measured.as_ref();
    let measured: Vec<[f64; 4]> =
        measured.map(|of| plane_of_incidence(of.reflectance, theta_i, POINTS)).unwrap_or_default();
    std::array::from_fn(|c| {
        let lobes = curves.iter().map(|(class, values)| Lobe {
            class: (*class).to_owned(),
            points: values.iter().map(|values| radius(values, c)).collect(),
        });
        let title = format!("{} · θi = {theta_deg}°", Channel::ALL[c].name());
        let points = measured.iter().filter(|values| !values[c + 1].is_nan());
        let points = points.map(|values| radius(values, c)).collect();
        Polar { title, theta_i, lobes: lobes.collect(), points }.svg()
    })
}

/// θo and ∛f of a channel, of θo and f of r, g, b.
fn radius(values: &[f64; 4], channel: usize) -> [f64; 2] {
    // f is negative where a published F is.
    [values[0], values[channel + 1].max(0.0).cbrt()]
}

/// (θo, f of r, g, b) through the plane of incidence; negative θo on the light's side.
fn plane_of_incidence(model: &dyn Reflectance, theta_i: f64, steps: i32) -> Vec<[f64; 4]> {
    let wi = spherical(theta_i, PI);
    // The ends stay one step short of the horizon, where f is 0.
    let angles = (-steps..=steps).map(|step| FRAC_PI_2 * f64::from(step) / f64::from(steps + 1));
    angles
        .map(|theta_o| {
            let phi_o = if theta_o < 0.0 { PI } else { 0.0 };
            let [r, g, b] = model.eval(wi, spherical(theta_o.abs(), phi_o));
            [theta_o, r, g, b]
        })
        .collect()
}

/// F of each lobe and colour that it reflects.
fn fresnel(sheet: &Sheet<'_>) -> String {
    let mut curves = Vec::new();
    for lobe in &sheet.sgd.lobes {
        curves.extend(colours(lobe).map(|c| Curve {
            class: c.name().to_owned(),
            points: angles(|cos, _| lobe.fresnel[c as usize].eval(cos)),
        }));
    }
    let values = curves.iter().flat_map(|curve| &curve.points).map(|p| p[1]);
    // At least [0, 1], so that leaving it is seen.
    let (low, high) = values.fold((0.0, 1.0), |(low, high), f| (f.min(low), f.max(high)));
    chart("Fresnel factor", "θd [°]", "F", Axis::linear("", low, high), curves)
}

/// The colours that a lobe reflects.
fn colours(lobe: &MicrofacetLobe<Sgd>) -> impl Iterator<Item = Channel> {
    Channel::ALL.into_iter().filter(|c| lobe.rho_s[*c as usize] > 0.0)
}

/// D of a lobe with the widths of the fits, in decades down from the peak.
fn ndf(sheet: &Sheet<'_>, j: usize) -> String {
    const DECADES: f64 = 1e-5;
    let lobe = &sheet.sgd.lobes[j];
    let sgd = &lobe.distribution;
    let end = shown_angle(|tan2| sgd.ndf(tan2) > sgd.peak() * DECADES);
    // The fits' width in the first colour of the lobe.
    let c = colours(lobe).next().unwrap_or(Channel::R) as usize;
    let one_lobe = [sheet.fits.beckmann, sheet.fits.ggx].map(|fit| {
        let fitted = fit.family.of_width(fit.channels[c].alpha);
        angles_to(end, |cos, sin| fitted.ndf((sin / cos).powi(2)))
    });
    let exact = angles_to(end, |cos, sin| sgd.ndf((sin / cos).powi(2)));
    let fits = one_lobe.into_iter().zip(FIT_CLASSES);
    let curves = fits.chain([(exact, "sgd")]);
    let curves = curves.map(|(points, class)| Curve { class: class.to_owned(), points }).collect();
    let y = Axis::decades("", sgd.peak() * DECADES, sgd.peak());
    let y = Axis { label: "D [1/sr]".to_owned(), ..y };
    let title = format!("D, {}", colours(lobe).map(Channel::name).collect::<Vec<_>>().join(" "));
    let x = Axis::linear("θh [°]", 0.0, end);
    Chart { title, size: CHART_SIZE, x, y, curves, marks: vec![], key: vec![] }.svg()
}

/// The first round angle \[degrees\] at which the lobe is no longer `visible` at tan²θh.
fn shown_angle(visible: impl Fn(f64) -> bool) -> f64 {
    let ends = [1.0, 2.0, 5.0, 10.0, 20.0, 45.0_f64];
    ends.into_iter().find(|end| !visible(end.to_radians().tan().powi(2))).unwrap_or(90.0)
}

/// The masking of each lobe as published, or as fitted where a material file gives none.
fn published_masking(sheet: &Sheet<'_>) -> Vec<FittedMasking> {
    sheet.material.lobes().iter().map(FittedMasking::of).collect()
}

/// A curve of each lobe, in the class of the first colour that it reflects.
fn by_lobe(sheet: &Sheet<'_>, class: &str, curve: impl Fn(usize) -> Vec<[f64; 2]>) -> Vec<Curve> {
    let lobes = sheet.sgd.lobes.iter().enumerate();
    let curves = lobes.map(|(j, lobe)| {
        let colour = colours(lobe).next().unwrap_or(Channel::ALL[j.min(2)]);
        Curve { class: format!("{}{class}", colour.name()), points: curve(j) }
    });
    curves.collect()
}

fn masking(sheet: &Sheet<'_>) -> String {
    let fitted = published_masking(sheet);
    let mut curves = by_lobe(sheet, " dashed", |j| angles(|c, s| fitted[j].g1(c / s)));
    // Exact over fitted: the later curve lies on top.
    curves.extend(by_lobe(sheet, "", |j| angles(|c, s| sheet.sgd.lobes[j].g1(c / s))));
    chart("G1 · exact and, dashed, as fitted", "θ [°]", "G1", Axis::linear("", 0.0, 1.0), curves)
}

fn masking_difference(sheet: &Sheet<'_>) -> String {
    let fitted = published_masking(sheet);
    let curves = by_lobe(sheet, "", |j| {
        angles(|cos, sin| fitted[j].g1(cos / sin) - sheet.sgd.lobes[j].g1(cos / sin))
    });
    let values = curves.iter().flat_map(|curve| &curve.points).map(|p| p[1].abs());
    // An axis even where the two do not differ.
    let largest = values.fold(1e-4, f64::max);
    let y = Axis::linear("", -largest, largest);
    chart("G1 · fitted − exact", "θ [°]", "ΔG1", y, curves)
}

fn albedo(sheet: &Sheet<'_>) -> String {
    let mut curves = vec![Curve { class: "limit".into(), points: vec![[0.0, 1.0], [90.0, 1.0]] }];
    curves.extend(sheet.audit.channels.iter().zip(Channel::ALL).map(|(audit, channel)| Curve {
        class: channel.name().to_owned(),
        points: audit.albedo.iter().map(|at| [at.theta_deg, at.albedo]).collect(),
    }));
    let highest = curves.iter().flat_map(|curve| &curve.points).map(|p| p[1]).fold(1.0, f64::max);
    let y = Axis::linear("", 0.0, highest * 1.05);
    chart("Directional albedo", "θo [°]", "∫ f cosθi dωi", y, curves)
}

/// (θ in degrees, value of its cosine and sine) in even steps from 0 to 90°.
fn angles(value: impl Fn(f64, f64) -> f64) -> Vec<[f64; 2]> {
    angles_to(90.0, value)
}

/// The same up to `end` degrees, 90° itself just missed.
fn angles_to(end: f64, value: impl Fn(f64, f64) -> f64) -> Vec<[f64; 2]> {
    const STEPS: u32 = 180;
    // 90° just missed: tanθ stays finite.
    let angles = (0..=STEPS).map(|step| end * f64::from(step) / f64::from(STEPS) * (1.0 - 1e-9));
    angles
        .map(|theta_deg| {
            let (cos, sin) = cos_sin_degrees(theta_deg);
            [theta_deg, value(cos, sin)]
        })
        .collect()
}

fn chart(title: &str, x: &str, y_label: &str, y: Axis, curves: Vec<Curve>) -> String {
    let y = Axis { label: y_label.to_owned(), ..y };
    let x = Axis::linear(x, 0.0, 90.0);
    Chart { title: title.to_owned(), size: CHART_SIZE, x, y, curves, marks: vec![], key: vec![] }
        .svg()
}
