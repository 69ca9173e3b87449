//! Writes docs/fits.md, docs/fits-error.svg and docs/fits-profiles.svg: how far each model's best
//! fit is from every material of the catalogue. The argument is a file with the table that
//! study_fit_objective prints.
//!
//!     cargo run --release --example study_fits_page -- OBJECTIVE.md

use std::error::Error;
use std::fmt::Write as _;
use std::fs;

use rayon::prelude::*;
use sgdbake::brdf::{Brdf, MaskingKind, Reflectance, SgdBrdf};
use sgdbake::fit::{Metric, Target, gltf, mixture, one_lobe};
use sgdbake::material::{Channel, Material, catalog, find};
use sgdbake::microfacet::{Distribution as _, Family, SgdNdf};
use sgdbake::preview::ball::{KEY_LIGHT, under_sun};
use sgdbake::report::axis::Axis;
use sgdbake::report::chart::{Chart, Curve, Key, Page, Shown};
use sgdbake::report::sheet_page::STYLE;

const MODELS: [&str; 6] = ["Beckmann", "GGX", "glTF", "2 Beckmann", "4 Beckmann", "8 Beckmann"];
/// CSS classes of their curves.
const CLASSES: [&str; 6] = ["beckmann", "ggx", "gltf", "lobes two", "lobes four", "lobes eight"];
/// Residuals below are drawn on the axis.
const LEAST_RESIDUAL: f64 = 1e-6;
/// Materials and channels whose distributions one lobe fits worst.
const HARD: [(&str, usize); 4] =
    [("gold-metallic-paint2", 1), ("white-paint", 0), ("blue-acrylic", 0), ("steel", 0)];
const BALL: usize = 48;

/// A material's errors, `MODELS` in order.
struct Row {
    name: &'static str,
    /// Root mean square over the channels of the relative residual in lightness.
    residual: [f64; 6],
    /// Mean ΔE2000 of a ball under one light.
    delta_e: [f64; 6],
    /// Largest error of D over the channels for 2, 4 and 8 lobes.
    ndf_error: [f64; 3],
}

/// Numbers of lobes whose error of D is listed.
const COUNTS: std::ops::RangeInclusive<usize> = 1..=10;
/// The error of D within which a channel counts as met.
const MET: f64 = 1e-3;

fn main() -> Result<(), Box<dyn Error>> {
    let objective = std::env::args().nth(1).ok_or("name the file of the objectives' table")?;
    let rows: Vec<Row> = catalog().par_iter().map(|entry| row(&entry.material)).collect();
    let page = page(&fs::read_to_string(objective)?, &rows)?;
    fs::write("docs/fits.md", with_counts(page, &ndf_errors()))?;
    plot_errors(&rows)?;
    plot_profiles()
}

fn row(material: &'static Material) -> Row {
    let target = Target::new(material);
    let one_lobe = |family| one_lobe::fit_target(&target, family, Metric::default()).joint.brdf();
    let [beckmann, ggx] = [Family::Beckmann, Family::Ggx].map(one_lobe);
    let gltf = gltf::fit_target(&target, Metric::default()).material;
    let fits =
        [2, 4, 8].map(|count| mixture::fit_target(&target, count, mixture::Objective::default()));
    let mixtures = fits.each_ref().map(|fit| Brdf::of_mixture(material, &fit.mixture));
    let models: [&dyn Reflectance; 6] =
        [&beckmann, &ggx, &gltf, &mixtures[0], &mixtures[1], &mixtures[2]];
    let exact = under_sun(&SgdBrdf::new(material, MaskingKind::Exact), KEY_LIGHT, BALL);
    Row {
        name: &material.name,
        residual: models.map(|model| {
            let [r, g, b] = target.residuals(model).cube_root;
            ((r * r + g * g + b * b) / 3.0).sqrt()
        }),
        delta_e: models.map(|model| under_sun(model, KEY_LIGHT, BALL).delta_e(&exact).mean),
        ndf_error: fits.each_ref().map(|fit| fit.ndf_error.iter().copied().fold(0.0, f64::max)),
    }
}

fn page(objective: &str, rows: &[Row]) -> Result<String, std::fmt::Error> {
    let mut page = include_str!("study_fits_page.md").replace("{objective}", objective.trim_end());
    let summary = |values: &dyn Fn(&Row) -> f64| {
        let mut values: Vec<f64> = rows.iter().map(values).collect();
        values.sort_by(f64::total_cmp);
        (values[values.len() / 2], values[values.len() - 1])
    };
    let mut table = String::new();
    for (m, model) in MODELS.iter().enumerate() {
        let (residual, worst_residual) = summary(&|row| row.residual[m]);
        let (delta_e, worst_delta_e) = summary(&|row| row.delta_e[m]);
        let ndf = m.checked_sub(3).map_or_else(
            || "–".to_owned(),
            |i| {
                let (median, worst) = summary(&|row| row.ndf_error[i]);
                format!("{:.3} % / {:.2} %", 100.0 * median, 100.0 * worst)
            },
        );
        writeln!(
            table,
            "| {model} | {residual:.4} / {worst_residual:.4} | {delta_e:.3} / {worst_delta_e:.2} | {ndf} |"
        )?;
    }
    page = page.replace("{summary}", table.trim_end());
    let mut table = String::new();
    for row in rows {
        let cells = row.delta_e.map(|e| format!("{e:.3}")).join(" | ");
        let [.., eight] = row.ndf_error;
        writeln!(table, "| {} | {cells} | {:.3} % |", row.name, 100.0 * eight)?;
    }
    Ok(page.replace("{materials}", table.trim_end()))
}

/// The errors of D of a material, per number of lobes and channel.
type NdfErrors = Vec<Vec<f64>>;

fn ndf_errors() -> Vec<NdfErrors> {
    let of_material = |material: &Material| -> NdfErrors {
        COUNTS.map(|count| mixture::fit(material, count).ndf_error).collect()
    };
    catalog().par_iter().map(|entry| of_material(&entry.material)).collect()
}

fn largest(errors: &[f64]) -> f64 {
    errors.iter().copied().fold(0.0, f64::max)
}

/// The page with the table of the error of D by the number of lobes, and the materials that eight do
/// not meet.
fn with_counts(page: String, errors: &[NdfErrors]) -> String {
    let line = |i: usize| {
        let mut worst: Vec<f64> = errors.iter().map(|of| largest(&of[i])).collect();
        worst.sort_by(f64::total_cmp);
        let falls = |of: &&NdfErrors| i > 0 && largest(&of[i]) < largest(&of[i - 1]);
        let falls = errors.iter().filter(falls).count();
        let falls = if i > 0 { falls.to_string() } else { "–".to_owned() };
        let met = errors.iter().flat_map(|of| &of[i]).filter(|error| **error <= MET).count();
        let [median, largest] = [worst[worst.len() / 2], worst[worst.len() - 1]].map(|e| 100.0 * e);
        format!("| {} | {median:.4} % | {largest:.3} % | {falls} | {met} |", i + COUNTS.start())
    };
    let lines: Vec<String> = (0..COUNTS.count()).map(line).collect();
    let eight = 8 - COUNTS.start();
    let beyond = catalog().iter().zip(errors).filter(|(_, of)| largest(&of[eight]) > MET);
    let mut beyond: Vec<(f64, &str)> =
        beyond.map(|(entry, of)| (100.0 * largest(&of[eight]), &*entry.material.name)).collect();
    beyond.sort_by(|a, b| b.0.total_cmp(&a.0));
    let beyond: Vec<String> =
        beyond.iter().map(|(error, name)| format!("{name} ({error:.3} %)")).collect();
    page.replace("{counts}", &lines.join("\n")).replace("{beyond}", &beyond.join(", "))
}

/// Relative residual of every material, per model in ascending order.
fn plot_errors(rows: &[Row]) -> std::io::Result<()> {
    let curve = |m: usize| {
        let mut values: Vec<f64> = rows.iter().map(|row| row.residual[m]).collect();
        values.sort_by(f64::total_cmp);
        let place = |(i, value): (usize, f64)| [i as f64 + 1.0, value.max(LEAST_RESIDUAL)];
        Curve {
            class: CLASSES[m].to_owned(),
            points: values.into_iter().enumerate().map(place).collect(),
        }
    };
    let chart = Chart {
        title: "Best fits of the catalogue".to_owned(),
        size: [800.0, 460.0],
        x: Axis::linear("materials, in each model's own order", 0.0, rows.len() as f64),
        y: Axis::decades("relative residual in lightness", LEAST_RESIDUAL, 1.0),
        curves: (0..MODELS.len()).map(curve).collect(),
        marks: vec![],
        key: (0..MODELS.len()).map(|m| line(CLASSES[m], MODELS[m])).collect(),
    };
    fs::write("docs/fits-error.svg", chart.file(STYLE))
}

fn line(class: &'static str, label: &'static str) -> Key {
    Key { shown: Shown::Line, class, label }
}

/// D of a few hard channels and of their fits, against θ.
fn plot_profiles() -> Result<(), Box<dyn Error>> {
    let mut page = Page::new([900.0, 720.0]);
    for (i, (name, channel)) in HARD.into_iter().enumerate() {
        let corner = [450.0 * (i % 2) as f64, 360.0 * (i / 2) as f64];
        page.add(corner, &profile(&find(name)?.material, channel));
    }
    Ok(fs::write("docs/fits-profiles.svg", page.file(STYLE))?)
}

/// A CSS class, a name and D(tan²θ).
type Profile<'a> = (&'static str, &'static str, &'a dyn Fn(f64) -> f64);

fn profile(material: &Material, channel: usize) -> Chart {
    let lobe = &material.lobes()[channel];
    let exact = SgdNdf::new(lobe.alpha(), lobe.p());
    let fit = |family: Family| {
        family.of_width(one_lobe::fit(material, family).per_channel.channels[channel].alpha)
    };
    let ggx = fit(Family::Ggx);
    let beckmann = fit(Family::Beckmann);
    let mixture = |count| mixture::fit(material, count).mixture.of_lobe(channel);
    let (two, eight) = (mixture(2), mixture(8));
    let profiles: [Profile<'_>; 5] = [
        ("sgd", "SGD", &|x| exact.ndf(x)),
        ("beckmann", "Beckmann", &|x| beckmann.ndf(x)),
        ("ggx", "GGX", &|x| ggx.ndf(x)),
        ("lobes two", "2 Beckmann", &|x| two.ndf(x)),
        ("lobes eight", "8 Beckmann", &|x| eight.ndf(x)),
    ];
    let degrees: Vec<f64> = (0..=160).map(|i| 0.01 * 8000_f64.powf(f64::from(i) / 160.0)).collect();
    let curve = |(class, _, d): &Profile<'_>| Curve {
        class: (*class).to_owned(),
        points: degrees.iter().map(|theta| [*theta, d(theta.to_radians().tan().powi(2))]).collect(),
    };
    Chart {
        title: format!("{}, {}", material.name, Channel::ALL[channel].name()),
        size: [450.0, 360.0],
        x: Axis::decades("θh [°]", 0.01, 100.0),
        y: Axis::decades("D [1/sr]", exact.peak() * 1e-6, exact.peak()),
        curves: profiles.iter().map(curve).collect(),
        marks: vec![],
        key: profiles.iter().map(|(class, name, _)| line(class, name)).collect(),
    }
}
