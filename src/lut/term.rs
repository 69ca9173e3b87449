//! The factors of f that 2D textures store: their axes and their texels.

use rayon::prelude::*;

use crate::lut::axis::{Axis, Variable, Warp};
use crate::lut::quantity::{Encoding, Factor, Quantity};
use crate::lut::row::{Row, Rows};
use crate::lut::table::{Depth, ErrorNote, Table, Texels};
use crate::microfacet::grazing_limit;

/// The texel whose exponential is an exact 0 in every precision: the lowest half float.
pub const ZERO_TEXEL: f64 = -65504.0;

/// tan²θh/α at the end of the `ndf` axis: D has fallen to e^{−80} of its peak there, far below
/// what any pair of directions can make of it.
const NDF_END: f64 = 80.0;

/// The cotθ and coordinate that stand for the limit at grazing.
const GRAZING: f64 = 1e-12;

/// A factor of a lobe (ρs/π) F D G1(wi) G1(wo)/(cosθi cosθo).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Term {
    /// The slope density D·cos⁴θh, relative to its peak and as a logarithm.
    ///
    /// # Derivation
    ///
    /// With x = tan²θh, D·cos⁴θh = D(0) e^{−x/α} (1 + x/α²)^{−p}. D(0) exceeds 1e5 and the tail
    /// spans hundreds of decades; the logarithm of the ratio, t = −x/α − p ln(1 + x/α²), fits a
    /// half float and is the more exact the closer to the peak. Over y = ln(1 + x/s) it bends by
    /// t'' = −(x+s)/α − p(x+s)(α²−s)/(α²+x)²: s near α² keeps the second term straight, and for
    /// small p a larger s saves texels. Texels decode as D = D(0)·eᵗ·(1+x)².
    Ndf,
    /// Masking G1 against cotθ.
    ///
    /// # Derivation
    ///
    /// The reflectance divides by cosθ, so G1 must stay relatively exact where it vanishes. With
    /// s = lim cotθ/G1 at grazing, u = cotθ/(cotθ + s) has the same slope as G1 at grazing and the
    /// same limit at normal incidence; t = ln(G1/u) lies within a few tenths for every Beckmann
    /// mixture. Texels decode as G1 = u·eᵗ, exactly 0 at u = 0.
    Masking,
    /// The Fresnel factor F(cosθd), as it is: it may be negative or above 1.
    Fresnel,
}

impl Term {
    /// Every factor.
    pub const ALL: [Self; 3] = [Self::Ndf, Self::Masking, Self::Fresnel];

    /// The quantity that stores it.
    #[must_use]
    pub fn quantity(self) -> Quantity {
        match self {
            Self::Ndf => Quantity::Ndf,
            Self::Masking => Quantity::Masking,
            Self::Fresnel => Quantity::Fresnel,
        }
    }

    /// How its texels are encoded.
    #[must_use]
    pub fn encoding(self) -> Encoding {
        match self {
            Self::Ndf => Encoding::ExpTimes { factor: Factor::NdfPeak },
            Self::Masking => Encoding::ExpTimes { factor: Factor::U },
            Self::Fresnel => Encoding::Identity,
        }
    }

    /// The axes of a texture that holds `rows`.
    #[must_use]
    pub fn axes(self, rows: &Rows) -> Vec<Axis> {
        vec![Axis { variable: self.variable(), warp: Some(self.warp(rows)) }, Axis::ROW]
    }

    /// The variable along the first axis.
    fn variable(self) -> Variable {
        match self {
            Self::Ndf => Variable::Tan2ThetaH,
            Self::Masking => Variable::CotTheta,
            Self::Fresnel => Variable::CosThetaD,
        }
    }

    /// The warp of the first axis, with the constants of each row.
    #[must_use]
    pub fn warp(self, rows: &Rows) -> Warp {
        let rows = &rows.lobes;
        match self {
            Self::Ndf => Warp::Log1p {
                scale: rows.iter().map(ndf_scale).collect(),
                max: rows.iter().map(ndf_max).collect(),
            },
            Self::Masking => Warp::Rational { scale: rows.iter().map(masking_scale).collect() },
            Self::Fresnel => Warp::Identity,
        }
    }

    /// How many rows its texture has.
    #[must_use]
    pub fn row_count(self, rows: &Rows) -> usize {
        match self {
            Self::Ndf | Self::Masking => rows.lobes.len(),
            Self::Fresnel => rows.fresnel.len(),
        }
    }

    /// The first material of each row.
    fn row_names(self, rows: &Rows) -> Vec<String> {
        match self {
            Self::Ndf | Self::Masking => rows.lobes.iter().map(|row| row.name.clone()).collect(),
            Self::Fresnel => rows.fresnel.iter().map(|row| row.name.clone()).collect(),
        }
    }

    /// The exact texel channels of a row at coordinate `u` of the first axis, warped by `warp`;
    /// `None` where nothing is stored.
    #[must_use]
    pub fn texel(self, rows: &Rows, row: usize, warp: &Warp, u: f64) -> [Option<f64>; 3] {
        match self {
            // The last texel closes the table with an exact 0.
            Self::Ndf if u >= 1.0 => rows.lobes[row].each(|_| ZERO_TEXEL),
            Self::Ndf => {
                let x = warp.variable(row, u);
                rows.lobes[row]
                    // In the row of a wider lobe a sharp one falls below what half floats hold.
                    .each(|lobe| lobe.distribution.closed_form().log_decay(x).max(ZERO_TEXEL))
            }
            Self::Masking => {
                // G1/u is 0/0 at u = 0; its limit is what neighbours are mixed with.
                let u = u.max(GRAZING);
                let cot = warp.variable(row, u);
                rows.lobes[row].each(|lobe| (lobe.g1(cot) / u).ln())
            }
            Self::Fresnel => {
                let cos = warp.variable(row, u);
                rows.fresnel[row].curves.map(|curve| curve.map(|curve| curve.eval(cos)))
            }
        }
    }

    /// The texture of all rows, `width` texels each.
    #[must_use]
    pub fn tabulate(self, rows: &Rows, width: usize, depth: Depth) -> Table {
        let (axes, count) = (self.axes(rows), self.row_count(rows));
        let warp = self.warp(rows);
        let exact = (0..count * width).into_par_iter().map(|i| {
            let u = (i % width) as f64 / (width - 1) as f64;
            self.texel(rows, i / width, &warp, u)
        });
        let texels: Vec<[f64; 3]> =
            exact.map(|texel| texel.map(|t| t.unwrap_or(self.absent_texel()))).collect();
        Table {
            quantity: self.quantity(),
            size: vec![width, count],
            encoding: self.encoding(),
            texels: Texels::rounded(depth, &texels),
            rows: self.row_names(rows),
            row: None,
            error: ErrorNote::default(),
            axes,
        }
    }

    /// The texel of a lobe that is left out: it decodes to a vanishing reflectance.
    #[must_use]
    fn absent_texel(self) -> f64 {
        match self {
            // D = 0 takes the whole lobe away; the others may then be anything finite.
            Self::Ndf => ZERO_TEXEL,
            Self::Masking | Self::Fresnel => 0.0,
        }
    }
}

/// The scale s of the `ndf` axis: near α² where the power factor matters, at most 0.3 α where it
/// does not.
#[must_use]
pub fn ndf_scale(row: &Row) -> f64 {
    // One axis serves all lobes of the row: the sharpest decides where texels are dense.
    let scales = row.visible().map(|lobe| {
        let (alpha, p) = (lobe.distribution.alpha(), lobe.distribution.p());
        (alpha * alpha * (1.0 + (0.4 / p).sqrt())).min(0.3 * alpha)
    });
    scales.fold(f64::INFINITY, f64::min)
}

/// The end m of the `ndf` axis: where the widest lobe has vanished.
fn ndf_max(row: &Row) -> f64 {
    row.visible().map(|lobe| NDF_END * lobe.distribution.alpha()).fold(0.0, f64::max)
}

/// The scale s of the `masking` axis: lim cotθ/G1 at grazing, the lobes' geometric mean.
#[must_use]
pub fn masking_scale(row: &Row) -> f64 {
    // One s for all lobes of the row: the geometric mean is off by the same factor both ways.
    let logs: Vec<f64> = row.visible().map(|lobe| grazing_limit(|cot| lobe.g1(cot)).ln()).collect();
    (logs.iter().sum::<f64>() / logs.len() as f64).exp()
}
