//! The factors of f that 2D textures store: their axes and their texels.

use crate::brdf::ChannelBrdf;
use crate::lut::axis::{Axis, Variable, Warp};
use crate::lut::quantity::{Encoding, Factor, Quantity};
use crate::lut::row::Row;

/// The texel whose exponential is an exact 0 in every precision: the lowest half float.
pub const ZERO_TEXEL: f64 = -65504.0;

/// tan²θh/α at the end of the `ndf` axis: D has fallen to e^{−80} of its peak there, far below
/// what any pair of directions can make of it.
const NDF_END: f64 = 80.0;

/// The cotθ and coordinate that stand for the limit at grazing.
const GRAZING: f64 = 1e-12;

/// A factor of f = ρd/π + ρs/π · F D G1(wi) G1(wo)/(cosθi cosθo).
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
    pub fn axes(self, rows: &[Row]) -> Vec<Axis> {
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
    pub fn warp(self, rows: &[Row]) -> Warp {
        let per_row = |constant: fn(&Row) -> f64| rows.iter().map(constant).collect();
        match self {
            Self::Ndf => Warp::Log1p { scale: per_row(ndf_scale), max: per_row(ndf_max) },
            Self::Masking => Warp::Rational { scale: per_row(masking_scale) },
            Self::Fresnel => Warp::Identity,
        }
    }

    /// The texel of one channel at coordinate `u` of the first axis, warped by `warp` for `row`.
    #[must_use]
    pub fn texel(self, lobe: &ChannelBrdf, warp: &Warp, row: usize, u: f64) -> f64 {
        match self {
            // The last texel closes the table with an exact 0.
            Self::Ndf if u >= 1.0 => ZERO_TEXEL,
            Self::Ndf => lobe.ndf.log_decay(warp.variable(row, u)).max(ZERO_TEXEL),
            Self::Masking => {
                let u = u.max(GRAZING);
                (lobe.masking.g1(warp.variable(row, u)) / u).ln()
            }
            Self::Fresnel => lobe.fresnel.eval(warp.variable(row, u)),
        }
    }

    /// The texel of a channel whose lobe is left out: it decodes to a vanishing reflectance.
    #[must_use]
    pub fn absent_texel(self) -> f64 {
        match self {
            Self::Ndf => ZERO_TEXEL,
            Self::Masking | Self::Fresnel => 0.0,
        }
    }
}

/// The scale s of the `ndf` axis: near α² where the power factor matters, at most 0.3 α where it
/// does not.
#[must_use]
pub fn ndf_scale(row: &Row) -> f64 {
    let of_lobe = |lobe: &ChannelBrdf| {
        let (alpha, p) = (lobe.ndf.alpha(), lobe.ndf.p());
        (alpha * alpha * (1.0 + (0.4 / p).sqrt())).min(0.3 * alpha)
    };
    row.visible().map(of_lobe).fold(f64::INFINITY, f64::min)
}

/// The end m of the `ndf` axis: where the widest lobe has vanished.
fn ndf_max(row: &Row) -> f64 {
    row.visible().map(|lobe| NDF_END * lobe.ndf.alpha()).fold(0.0, f64::max)
}

/// The scale s of the `masking` axis: lim cotθ/G1 at grazing, the channels' geometric mean.
#[must_use]
pub fn masking_scale(row: &Row) -> f64 {
    let logs: Vec<f64> =
        row.visible().map(|lobe| (GRAZING / lobe.masking.g1(GRAZING)).ln()).collect();
    (logs.iter().sum::<f64>() / logs.len() as f64).exp()
}
