//! Writes docs/fits.md, docs/fits-error.svg and docs/fits-profiles.svg: how far each model's best
//! fit is from every material of the catalogue. The argument is a file with the table that
//! study_fit_objective prints.
//!
//!     cargo run --release --example study_fits_page -- OBJECTIVE.md

use std::error::Error;
use std::fmt::Write as _;
use std::fs;

use plotters::prelude::*;
use rayon::prelude::*;
use sgdbake::brdf::{Distribution, LobesBrdf, Reflectance, SgdBrdf};
use sgdbake::fit::{Metric, Target, gltf, lobes, one_lobe};
use sgdbake::material::{Channel, Material, catalog, find};
use sgdbake::microfacet::SgdNdf;
use sgdbake::microfacet::masking::MaskingKind;
use sgdbake::preview::ball::{KEY_LIGHT, under_sun};

const MODELS: [&str; 6] = ["Beckmann", "GGX", "glTF", "2 lobes", "4 lobes", "8 lobes"];
const COLOURS: [RGBColor; 6] = [
    RGBColor(0x1b, 0x9e, 0x77),
    RGBColor(0xd9, 0x5f, 0x02),
    RGBColor(0x75, 0x70, 0xb3),
    RGBColor(0xe7, 0x29, 0x8a),
    RGBColor(0x66, 0xa6, 0x1e),
    RGBColor(0x66, 0x66, 0x66),
];
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

fn main() -> Result<(), Box<dyn Error>> {
    let objective = std::env::args().nth(1).ok_or("name the file of the objectives' table")?;
    let rows: Vec<Row> = catalog().par_iter().map(|entry| row(&entry.material)).collect();
    fs::write("docs/fits.md", page(&fs::read_to_string(objective)?, &rows)?)?;
    plot_errors(&rows)?;
    plot_profiles()
}

fn row(material: &'static Material) -> Row {
    let target = Target::new(material);
    let one_lobe =
        |distribution| one_lobe::fit_target(&target, distribution, Metric::default()).joint;
    let [beckmann, ggx] = [Distribution::Beckmann, Distribution::Ggx].map(one_lobe);
    let gltf = gltf::fit_target(&target, Metric::default()).material;
    let lobes = [2, 4, 8].map(|count| lobes::fit_target(&target, count));
    let mixtures = lobes.each_ref().map(|fit| LobesBrdf::new(material, &fit.lobes));
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
        ndf_error: lobes.each_ref().map(|fit| fit.ndf_error.into_iter().fold(0.0, f64::max)),
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

/// Relative residual of every material, per model in ascending order.
fn plot_errors(rows: &[Row]) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new("docs/fits-error.svg", (900, 480)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(64)
        .build_cartesian_2d(0..rows.len(), (1e-6..1.0).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("materials, in each model's own order")
        .y_desc("relative residual in lightness")
        .y_label_formatter(&|y| format!("{y:.0e}"))
        .draw()?;
    for (m, (model, colour)) in MODELS.iter().zip(COLOURS).enumerate() {
        let mut values: Vec<f64> = rows.iter().map(|row| row.residual[m].max(1e-6)).collect();
        values.sort_by(f64::total_cmp);
        chart
            .draw_series(LineSeries::new(values.into_iter().enumerate(), colour.stroke_width(2)))?
            .label(*model)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerRight)
        .background_style(WHITE)
        .draw()?;
    Ok(root.present()?)
}

/// A named profile D(tan²θ) and its colour.
type Curve<'a> = (&'a str, &'a dyn Fn(f64) -> f64, RGBColor);

/// D of a few hard channels and of their fits, against θ.
fn plot_profiles() -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new("docs/fits-profiles.svg", (900, 720)).into_drawing_area();
    root.fill(&WHITE)?;
    for (area, (name, channel)) in root.split_evenly((2, 2)).iter().zip(HARD) {
        plot_profile(area, &find(name)?.material, channel)?;
    }
    Ok(root.present()?)
}

fn plot_profile(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    material: &Material,
    channel: usize,
) -> Result<(), Box<dyn Error>> {
    let params = &material.channels[channel];
    let exact = SgdNdf::new(params.alpha, params.p);
    let fit = |distribution| one_lobe::fit(material, distribution).per_channel;
    let ggx = fit(Distribution::Ggx).channels[channel].alpha;
    let beckmann = fit(Distribution::Beckmann).channels[channel].alpha;
    let mixture = |count| lobes::fit(material, count).lobes.channel(channel);
    let (two, eight) = (mixture(2), mixture(8));
    let curves: [Curve<'_>; 5] = [
        ("SGD", &|x| exact.eval(x), BLACK),
        ("Beckmann", &|x| Distribution::Beckmann.ndf(beckmann, x), COLOURS[0]),
        ("GGX", &|x| Distribution::Ggx.ndf(ggx, x), COLOURS[1]),
        ("2 lobes", &|x| two.ndf(x), COLOURS[3]),
        ("8 lobes", &|x| eight.ndf(x), COLOURS[5]),
    ];
    let degrees: Vec<f64> = (0..=160).map(|i| 0.01 * 8000_f64.powf(f64::from(i) / 160.0)).collect();
    let (low, high) = (exact.peak() * 1e-6, exact.peak() * 4.0);
    let mut chart = ChartBuilder::on(area)
        .caption(format!("{} {}", material.name, Channel::ALL[channel].name()), ("sans-serif", 16))
        .margin(8)
        .x_label_area_size(28)
        .y_label_area_size(56)
        .build_cartesian_2d((0.01..80.0).log_scale(), (low..high).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("θh in degrees")
        .y_desc("D")
        .y_label_formatter(&|y| format!("{y:.0e}"))
        .draw()?;
    for (label, d, colour) in curves {
        let point = |theta: &f64| (*theta, d(theta.to_radians().tan().powi(2)).max(low));
        chart
            .draw_series(LineSeries::new(degrees.iter().map(point), colour.stroke_width(2)))?
            .label(label)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerLeft)
        .background_style(WHITE)
        .draw()?;
    Ok(())
}
