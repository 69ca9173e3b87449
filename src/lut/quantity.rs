//! The quantities that textures store, and how a texel becomes a value.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A quantity that a texture stores.
///
/// # Example
///
/// ```
/// use sgdbake::Quantity;
///
/// assert_eq!("ndf".parse(), Ok(Quantity::Ndf));
/// assert_eq!(Quantity::Brdf3d.name(), "brdf3d");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// The slope density D·cos⁴θh: [`Term::Ndf`](crate::lut::Term::Ndf).
    Ndf,
    /// Masking G1 against cotθ: [`Term::Masking`](crate::lut::Term::Masking).
    Masking,
    /// The Fresnel factor F(cosθd): [`Term::Fresnel`](crate::lut::Term::Fresnel).
    Fresnel,
    /// The directional albedo of the specular term in three Fresnel terms: [`crate::lut::albedo`].
    Albedo,
    /// The whole specular term in three dimensions: [`crate::lut::volume`].
    Brdf3d,
}

/// How a texel t becomes a value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Encoding {
    /// value = t.
    Identity,
    /// value = factor · eᵗ.
    ExpTimes {
        /// Factor of the exponential.
        factor: Factor,
    },
    /// value = factor · t, per channel.
    Times {
        /// Value of a texel of 1.
        factor: [f64; 3],
    },
}

/// A factor of a decoded texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Factor {
    /// The coordinate on the first axis.
    U,
    /// The material's D(0) of the channel.
    NdfPeak,
}

/// No quantity of that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is not a quantity; use ndf, masking, fresnel, albedo or brdf3d")]
pub struct UnknownQuantity(String);

impl FromStr for Quantity {
    type Err = UnknownQuantity;

    fn from_str(name: &str) -> Result<Self, UnknownQuantity> {
        Self::ALL
            .into_iter()
            .find(|quantity| quantity.name() == name)
            .ok_or_else(|| UnknownQuantity(name.to_owned()))
    }
}

impl Quantity {
    /// Returns whether its texels span a range that 16-bit integers resolve.
    #[must_use]
    pub fn fits_a_range(self) -> bool {
        match self {
            Self::Ndf | Self::Brdf3d => false,
            Self::Masking | Self::Fresnel | Self::Albedo => true,
        }
    }

    /// Every quantity.
    pub const ALL: [Self; 5] =
        [Self::Ndf, Self::Masking, Self::Fresnel, Self::Albedo, Self::Brdf3d];

    /// The name in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ndf => "ndf",
            Self::Masking => "masking",
            Self::Fresnel => "fresnel",
            Self::Albedo => "albedo",
            Self::Brdf3d => "brdf3d",
        }
    }
}
