//! A material's parameters in the columns of the paper's table.

use crate::material::{Channel, LobeParams, MaskingParams, Material, find};
use crate::microfacet::{FittedMasking, SgdNdf};

/// The columns in the paper's order and spelling.
pub const COLUMNS: [&str; 12] =
    ["rho_d", "rho_s", "alpha", "p", "F0", "F1", "K", "lambda", "c", "k", "theta0", "error"];

/// A number per column; `error` only for published parameters.
pub type Row = [Option<f64>; 12];

/// A row for each channel of a material in the paper's form, named `r`, `g` and `b`; else a row for
/// each lobe and colour, named `1 r`, `1 g` and so on.
///
/// The printed error belongs to the published numbers, not to a file of the same name.
#[must_use]
pub fn rows(material: &Material) -> Vec<(String, Row)> {
    let published = find(&material.name).ok().filter(|entry| entry.material == *material);
    let (rho_d, lobes) = (material.rho_d(), material.lobes());
    let colours = Channel::ALL.into_iter().enumerate();
    let mut rows = Vec::new();
    if let Some(of_channel) = material.channel_lobes() {
        for (c, name) in colours {
            let error = published.map(|entry| entry.printed[c].error);
            rows.push((name.name().to_owned(), row(rho_d[c], &lobes[of_channel[c]], c, error)));
        }
        return rows;
    }
    for (j, lobe) in lobes.iter().enumerate() {
        for (c, name) in colours.clone() {
            rows.push((format!("{} {}", j + 1, name.name()), row(rho_d[c], lobe, c, None)));
        }
    }
    rows
}

/// The row of one colour of a lobe.
fn row(rho_d: f64, lobe: &LobeParams, colour: usize, error: Option<f64>) -> Row {
    let (alpha, p) = (lobe.alpha(), lobe.p());
    let masking = lobe.masking().unwrap_or_else(|| FittedMasking::of(lobe).params());
    let MaskingParams { lambda, c, k } = masking;
    let [rho_s, f0, f1] = [lobe.rho_s(), lobe.f0(), lobe.f1()].map(|values| values[colour]);
    let ndf_k = SgdNdf::new(alpha, p).k();
    let theta0 = FittedMasking::new(masking).theta0();
    let [rho_d, rho_s, alpha, p, f0, f1, ndf_k, lambda, c, k, theta0] =
        [rho_d, rho_s, alpha, p, f0, f1, ndf_k, lambda, c, k, theta0].map(Some);
    [rho_d, rho_s, alpha, p, f0, f1, ndf_k, lambda, c, k, theta0, error]
}
