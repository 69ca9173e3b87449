//! The ranges that a bake accepts.

use std::ops::RangeInclusive;

/// Texels along the first axis that a texture may have: what GPUs take.
pub const WIDTHS: RangeInclusive<usize> = 2..=16384;

/// Rows that a texture may have.
pub const MAX_ROWS: usize = 16384;

/// Tolerances that a bake accepts.
pub const TOLERANCES: RangeInclusive<f64> = 1e-6..=0.5;

/// Texels along an axis of a 3D texture.
pub const VOLUME_WIDTHS: RangeInclusive<usize> = 2..=512;
