//! The material sheet as one HTML file that needs no other, and the index of several.

use std::fmt::Write as _;

use base64::{Engine as _, prelude::BASE64_STANDARD};

use crate::asset::Distances;
use crate::brdf::{GltfBrdf, OneLobe, OneLobeChannel};
use crate::encode::GENERATOR;
use crate::material::Channel;
use crate::preview::film::FilmError;
use crate::report::audit_page;
use crate::report::chart::{escape, line_key};
use crate::report::heat;
use crate::report::laws::Check;
use crate::report::number::{four_decimals, or_dash, six_digits};
use crate::report::parameters;
use crate::report::sheet::{Picture, Pictures, Sheet};
use crate::report::sheet_plots::{Plots, plots};
use crate::report::view;

/// The style of every page of the tool.
pub const STYLE: &str = include_str!("sheet.css");

/// A finished page.
pub struct Page {
    /// The material's name.
    pub name: String,
    /// The self-contained HTML.
    pub html: String,
    /// A small picture as PNG bytes.
    pub thumbnail: Vec<u8>,
    /// Mean ΔE2000 of Beckmann, GGX and glTF.
    pub delta_e: [f64; 3],
    /// The smallest angle from which a channel gains energy.
    pub gains_energy_from_deg: Option<f64>,
}

impl Page {
    /// The page of a sheet.
    ///
    /// # Errors
    ///
    /// A picture cannot be encoded.
    pub fn of(sheet: &Sheet<'_>) -> Result<Self, FilmError> {
        Ok(Self {
            name: sheet.material.name.clone(),
            html: html(sheet)?,
            thumbnail: sheet.pictures.reference.halved().to_png()?,
            delta_e: sheet.pictures.of_fits().map(|picture| picture.difference.mean),
            gains_energy_from_deg: sheet
                .audit
                .channels
                .iter()
                .filter_map(|channel| channel.gains_energy_from_deg)
                .reduce(f64::min),
        })
    }
}

fn html(sheet: &Sheet<'_>) -> Result<String, FilmError> {
    let plots = plots(sheet);
    let mut body = format!(
        "<p class=\"soft\"><a href=\"index.html\">All sheets</a> · <a href=\"{}\">Look at it from \
         all sides</a></p><h1>{}</h1>\
         <p>Measured reflectance as a Shifted Gamma Distribution (Bagher, Soler, Holzschuch 2012), \
         and the best fits of the models that engines have. Every number and picture was computed \
         when this page was written.</p>",
        view::address(&sheet.material.name),
        escape(&sheet.material.name)
    );
    body.push_str(&parameters(sheet));
    body.push_str(&errors(sheet));
    body.push_str(&pictures(sheet)?);
    body.push_str(&lobes(sheet, &plots));
    body.push_str(&curves(&plots));
    body.push_str(&fits(sheet));
    body.push_str(&audit(sheet));
    Ok(document(&sheet.material.name, &body))
}

/// A complete HTML document.
#[must_use]
pub fn document(title: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <meta name=\"generator\" content=\"{GENERATOR}\"><title>{}</title>\
         <style>{STYLE}</style></head>\n<body>{body}</body></html>\n",
        escape(title)
    )
}

/// The columns of the paper's table, as a page prints them.
const COLUMNS: [&str; 12] = ["ρd", "ρs", "α", "p", "F0", "F1", "K", "λ", "c", "k", "θ0", "error"];

fn parameters(sheet: &Sheet<'_>) -> String {
    let mut numbers = parameters::rows(sheet.material);
    if let Some(measured) = &sheet.measured {
        // A row for each colour, lobe after lobe.
        let errors = measured.absolute.iter().cycle();
        numbers.iter_mut().zip(errors).for_each(|((_, row), error)| row[11] = Some(*error));
    }
    let rows: Vec<Vec<String>> = numbers
        .into_iter()
        .map(|(name, row)| {
            let numbers = row.map(|number| or_dash(number, six_digits));
            std::iter::once(name).chain(numbers).collect()
        })
        .collect();
    let error = match sheet.measured {
        Some(_) => {
            "the absolute fitting error of the colour, the mean of |f − measured| weighted by \
                    both cosines, in 1/sr"
        }
        None => "the one that the paper states",
    };
    let note = format!(
        "K and θ0 are recomputed from the other columns; the error is {error}. θ0 is in radians."
    );
    format!("<h2>Parameters</h2>{}<p class=\"soft\">{note}</p>", table("", &COLUMNS, &rows))
}

/// A table that scrolls sideways where the screen is narrow.
fn table(corner: &str, columns: &[&str], rows: &[Vec<String>]) -> String {
    let mut html = format!("<div class=\"scroll\"><table><tr><th>{corner}</th>");
    for column in columns {
        let _ = write!(html, "<th>{column}</th>");
    }
    html.push_str("</tr>");
    for row in rows {
        html.push_str("<tr>");
        for cell in row {
            let _ = write!(html, "<td>{cell}</td>");
        }
        html.push_str("</tr>");
    }
    html + "</table></div>"
}

fn pictures(sheet: &Sheet<'_>) -> Result<String, FilmError> {
    let Pictures { reference, of, models, noise } = &sheet.pictures;
    let columns = models.len() + 1;
    let mut html =
        format!("<h2>Pictures</h2><div class=\"pictures\" style=\"--columns:{columns}\">");
    html.push_str(&figure(&reference.to_png()?, of));
    for Picture { name, film, .. } in models {
        html.push_str(&figure(&film.to_png()?, name));
    }
    html.push_str(&scale());
    for Picture { name, film, difference } in models {
        let caption =
            format!("{name}: ΔE2000 mean {:.2}, largest {:.1}", difference.mean, difference.max);
        html.push_str(&figure(&heat::png(difference, film.width)?, &caption));
    }
    let _ = write!(
        html,
        "</div><p class=\"soft\">Differences of CIE Lab colours as displayed, after the tone curve; \
         about 1 is just visible side by side. A pixel's noise is at most {:.1} % of the mean \
         luminance, and nearly the same in all pictures.</p>",
        100.0 * noise
    );
    Ok(html)
}

/// How far each model is from the measured surface.
fn errors(sheet: &Sheet<'_>) -> String {
    if sheet.distances.is_empty() {
        return String::new();
    }
    let rows: Vec<Vec<String>> =
        sheet.distances.iter().map(|(name, distances)| error_row(name, distances)).collect();
    let columns = ["ΔE2000 suns", "ΔE2000 highlights", "absolute [1/sr]", "relative", "lightness"];
    let source = if sheet.measured.is_some() {
        "Each model but a published one is fitted to the measurement."
    } else {
        "The surface is the MERL measurement as a neural network reproduces it (Sztrajman et al. \
         2021); the fits of a refitted material are made to it, those of a published one to the \
         published material."
    };
    format!(
        "<h2>Errors against the measurement</h2>{}<p class=\"soft\">{source} ΔE2000 is the mean \
         over a ball under five suns, and over its highlights under small lights; absolute is the \
         mean of |f − measured| weighted by both cosines, relative the same over the mean of f.</p>",
        table("", &columns, &rows)
    )
}

/// A row of the table of errors.
fn error_row(model: &str, distances: &Distances) -> Vec<String> {
    let Distances { suns, highlights, absolute, relative, lightness } = distances;
    vec![
        model.to_owned(),
        format!("{suns:.2}"),
        format!("{highlights:.2}"),
        format!("{absolute:.5}"),
        four_decimals(*relative),
        four_decimals(*lightness),
    ]
}

/// What the colours of the difference maps mean.
fn scale() -> String {
    format!(
        "<div class=\"scale\">ΔE2000 against the first<div class=\"bar\" style=\"background:{}\"></div>\
         <div class=\"ends\"><span>0</span><span>{} and above</span></div></div>",
        heat::gradient(),
        heat::SCALE_END
    )
}

fn figure(png: &[u8], caption: &str) -> String {
    format!(
        "<figure><img alt=\"{0}\" src=\"{1}\"><figcaption>{0}</figcaption></figure>",
        escape(caption),
        data_uri(png)
    )
}

fn data_uri(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", BASE64_STANDARD.encode(png))
}

const SGD: (&str, &str) = ("sgd", "SGD");
const DISTRIBUTIONS: [(&str, &str); 3] = [SGD, ("beckmann", "Beckmann"), ("ggx", "GGX")];
const MODELS: [(&str, &str); 4] = [SGD, DISTRIBUTIONS[1], DISTRIBUTIONS[2], ("gltf", "glTF")];
const CHANNELS: [(&str, &str); 3] = [("r", "red"), ("g", "green"), ("b", "blue")];

/// What the curves of the charts below it stand for, (CSS class, name) each.
fn key(entries: &[(&str, &str)]) -> String {
    let entries: String = entries.iter().map(|(class, name)| line_key(class, name)).collect();
    format!("<div class=\"key\">{entries}</div>")
}

fn lobes(sheet: &Sheet<'_>, plots: &Plots) -> String {
    let mut html = format!(
        "<h2>Lobes in the plane of incidence</h2><p class=\"soft\">The radius is ∛f; the dotted line is \
         the direction to the light, and the half circle the largest value of its drawing.{}</p>{}",
        if sheet.measured.is_some() {
            " The points are the measurement; those beyond the drawing stand on its edge."
        } else {
            ""
        },
        key(&MODELS)
    );
    for (_, channels) in &plots.lobes {
        let _ = write!(html, "<div class=\"grid3\">{}</div>", channels.concat());
    }
    html
}

fn curves(plots: &Plots) -> String {
    format!(
        "<h2>Distribution of normals</h2><p class=\"soft\">D against the angle from the normal, per \
         channel, with the best single lobe of each kind.</p>{}<div class=\"grid3\">{}</div>\
         <h2>Fresnel, masking, albedo</h2>{}<div class=\"grid4 wide\">{}{}{}{}</div>",
        key(&DISTRIBUTIONS),
        plots.ndf.concat(),
        key(&CHANNELS),
        plots.fresnel,
        plots.masking,
        plots.masking_difference,
        plots.albedo
    )
}

fn fits(sheet: &Sheet<'_>) -> String {
    let [beckmann, ggx, gltf] = &sheet.fits.residuals;
    let lobes = [
        one_lobe_rows("Beckmann", &sheet.fits.beckmann, beckmann),
        one_lobe_rows("GGX", &sheet.fits.ggx, ggx),
    ];
    let columns = ["ρd", "α", "f0", "f90", "f1", "residual"];
    let gltf_columns = [
        "base colour",
        "metallic",
        "roughness",
        "specular",
        "specular colour",
        "clearcoat",
        "its roughness",
        "residual r g b",
    ];
    format!(
        "<h2>Best fits</h2>{}<br>{}",
        table("", &columns, &lobes.concat()),
        table("", &gltf_columns, &[gltf_row(&sheet.fits.gltf, gltf)])
    )
}

/// A row for each channel of a fit.
fn one_lobe_rows(name: &str, fit: &OneLobe, residuals: &[f64; 3]) -> Vec<Vec<String>> {
    let channels = Channel::ALL.into_iter().zip(&fit.channels).zip(residuals);
    let rows = channels.map(|((channel, of), residual)| {
        let OneLobeChannel { rho_d, alpha, fresnel } = of;
        let numbers = [*rho_d, *alpha, fresnel.f0, fresnel.f90, fresnel.f1, *residual];
        let name = format!("{name} {}", channel.name());
        std::iter::once(name).chain(numbers.map(four_decimals)).collect()
    });
    rows.collect()
}

/// The row of the factors of a glTF material.
fn gltf_row(gltf: &GltfBrdf, residuals: &[f64; 3]) -> Vec<String> {
    vec![
        "glTF".to_owned(),
        gltf.base_color.map(four_decimals).join(" "),
        four_decimals(gltf.metallic),
        four_decimals(gltf.roughness),
        four_decimals(gltf.specular_factor),
        gltf.specular_color.map(four_decimals).join(" "),
        or_dash(gltf.clearcoat, four_decimals),
        or_dash(gltf.clearcoat_roughness, four_decimals),
        residuals.map(four_decimals).join(" "),
    ]
}

fn audit(sheet: &Sheet<'_>) -> String {
    let laws: Vec<Vec<String>> = sheet.audit.channels[0]
        .laws
        .iter()
        .map(|check| {
            let [r, g, b] = sheet.audit.channels.each_ref().map(|channel| {
                or_dash(channel.laws.iter().find(|other| other.law == check.law), deviation)
            });
            vec![escape(check.law.describe()), r, g, b, format!("{:.1e}", check.bound)]
        })
        .collect();
    let findings: String = audit_page::findings_of(&sheet.audit)
        .iter()
        .map(|f| format!("<li>{}</li>", escape(f)))
        .collect();
    format!("<h2>Audit</h2><ul>{findings}</ul>{}", table("law", &["r", "g", "b", "bound"], &laws))
}

/// How far a channel is from a law, and whether that breaks it.
fn deviation(check: &Check) -> String {
    format!("{:.1e}{}", check.deviation, if check.holds() { "" } else { " broken" })
}

/// The index of several sheets.
#[must_use]
pub fn index<'p>(pages: impl IntoIterator<Item = (&'p str, &'p Page)>) -> String {
    let mut body = format!(
        "<h1>Material sheets</h1><p><a href=\"{}\">Look at the materials from all sides</a></p><p>Mean ΔE2000 of the best Beckmann, GGX and glTF material against \
         the measured one, on a ball under the same lights.</p><div class=\"scroll\"><table>\
         <tr><th>material</th><th></th><th>Beckmann</th><th>GGX</th><th>glTF</th><th>albedo &gt; 1 from</th></tr>",
        view::FILE
    );
    for (file, page) in pages {
        let name = escape(&page.name);
        let [beckmann, ggx, gltf] = page.delta_e;
        let gain = or_dash(page.gains_energy_from_deg, |angle| format!("{angle:.1}°"));
        let _ = write!(
            body,
            "<tr><td><a href=\"{}\">{name}</a></td><td><img alt=\"\" width=\"40\" height=\"40\" \
             src=\"{}\"></td><td>{beckmann:.2}</td><td>{ggx:.2}</td><td>{gltf:.2}</td><td>{gain}</td></tr>",
            escape(file),
            data_uri(&page.thumbnail)
        );
    }
    document("Material sheets", &(body + "</table></div>"))
}
