//! A material's parameters in the columns of the paper's table.

use crate::brdf::ChannelBrdf;
use crate::material::{ChannelParams, MaskingParams, Material, find};
use crate::microfacet::masking::{FittedMasking, MaskingKind};
use crate::microfacet::{Masking, SgdNdf};

/// The columns in the paper's order and spelling.
pub const COLUMNS: [&str; 12] =
    ["rho_d", "rho_s", "alpha", "p", "F0", "F1", "K", "lambda", "c", "k", "theta0", "error"];

/// A channel's row: a number per column; `error` only for published parameters.
pub type Row = [Option<f64>; 12];

/// The rows of the three channels. The printed error belongs to the published numbers, not to a
/// file of the same name.
#[must_use]
pub fn rows(material: &Material) -> [Row; 3] {
    let published = find(&material.name).ok().filter(|entry| entry.material == *material);
    std::array::from_fn(|c| {
        row(&material.channels[c], published.map(|entry| entry.printed[c].error))
    })
}

fn row(channel: &ChannelParams, error: Option<f64>) -> Row {
    let ChannelParams { rho_d, rho_s, alpha, p, f0, f1, .. } = *channel;
    let masking = channel.masking.unwrap_or_else(|| fitted_masking(channel));
    let MaskingParams { lambda, c, k } = masking;
    let ndf_k = SgdNdf::new(alpha, p).k();
    let theta0 = FittedMasking::new(masking).theta0();
    let [rho_d, rho_s, alpha, p, f0, f1, ndf_k, lambda, c, k, theta0] =
        [rho_d, rho_s, alpha, p, f0, f1, ndf_k, lambda, c, k, theta0].map(Some);
    [rho_d, rho_s, alpha, p, f0, f1, ndf_k, lambda, c, k, theta0, error]
}

fn fitted_masking(channel: &ChannelParams) -> MaskingParams {
    match ChannelBrdf::new(channel, MaskingKind::Exact).masking {
        Masking::Exact(smith) => FittedMasking::fit(&smith).params(),
        Masking::Fitted(fitted) => fitted.params(),
    }
}
