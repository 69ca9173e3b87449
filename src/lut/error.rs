//! Reasons for baking nothing, and for leaving a lobe out.

use serde::{Deserialize, Serialize};

use crate::lut::quantity::Quantity;
use crate::lut::range::{MAX_ROWS, TOLERANCES, VOLUME_WIDTHS, WIDTHS};

/// A lobe that is not stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// The material.
    pub material: String,
    /// The index of the lobe.
    pub lobe: usize,
    /// The reason, with the numbers that decided.
    pub reason: String,
}

/// Why nothing was baked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BakeError {
    /// There is nothing to bake.
    #[error("no material was given")]
    NoMaterial,
    /// The size is outside what textures can have.
    #[error("found a size of {found} texels; a texture has {} to {} along an axis", WIDTHS.start(), WIDTHS.end())]
    Size {
        /// The size asked for.
        found: usize,
    },
    /// The size is outside what a 3D table can have.
    #[error("found a size of {found} texels; a 3D texture has {} to {} along an axis", VOLUME_WIDTHS.start(), VOLUME_WIDTHS.end())]
    Volume {
        /// The size asked for.
        found: usize,
    },
    /// The tolerance is not a number that a bake can aim at.
    #[error("tolerance {found} is out of range; it must be between {} and {}", TOLERANCES.start(), TOLERANCES.end())]
    Tolerance {
        /// The tolerance asked for.
        found: f64,
    },
    /// More distinct materials than a texture has rows.
    #[error(
        "{found} rows do not fit one texture, which has up to {MAX_ROWS}; bake fewer materials at a time"
    )]
    Rows {
        /// The distinct materials.
        found: usize,
    },
    /// 16-bit integers cannot hold a quantity that spans hundreds of decades.
    #[error("`{quantity}` does not fit 16-bit integers; use exr or ktx2, or bake masking, fresnel and albedo only", quantity = .0.name())]
    Range(Quantity),
    /// The machine has too little memory.
    #[error("the bake needs about {} MB of memory{}", .needed.div_ceil(1_000_000), of_free(*.free))]
    Memory {
        /// Bytes needed, estimated.
        needed: usize,
        /// Bytes that are free, where they are known to be fewer.
        free: Option<usize>,
    },
    /// The largest textures do not keep the tolerance.
    #[error("the tolerance {tolerance} cannot be kept: the best error reached is {best:.3e}")]
    NotReached {
        /// The tolerance asked for.
        tolerance: f64,
        /// The smallest error found.
        best: f64,
    },
}

/// The part of a message that names the free memory.
fn of_free(free: Option<usize>) -> String {
    match free {
        Some(bytes) => format!("; {} MB are free", bytes / 1_000_000),
        None => ", more than this process may have".to_owned(),
    }
}
