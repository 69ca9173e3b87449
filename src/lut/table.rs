//! Tables: texels with the axes and the encoding that give them meaning.

use std::str::FromStr;

use half::f16;
use serde::Serialize;

use crate::lut::axis::Axis;
use crate::lut::quantity::{Encoding, Quantity};

/// The number format of a texel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Depth {
    /// 16-bit floating point.
    #[default]
    Half,
    /// 32-bit floating point.
    Float,
}

/// No depth of that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is not a depth; accepted are half, float")]
pub struct UnknownDepth(String);

impl FromStr for Depth {
    type Err = UnknownDepth;

    fn from_str(name: &str) -> Result<Self, UnknownDepth> {
        match name {
            "half" => Ok(Self::Half),
            "float" => Ok(Self::Float),
            other => Err(UnknownDepth(other.to_owned())),
        }
    }
}

impl Depth {
    /// Bytes of one channel of one texel.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::Half => 2,
            Self::Float => 4,
        }
    }
}

/// RGB texels as they are stored, the first axis fastest.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// Half floats.
    Half(Vec<[f16; 3]>),
    /// Single floats.
    Float(Vec<[f32; 3]>),
}

impl Texels {
    /// The texels rounded to `depth`.
    #[must_use]
    pub fn rounded(depth: Depth, texels: impl Iterator<Item = [f64; 3]>) -> Self {
        match depth {
            Depth::Half => Self::Half(texels.map(|rgb| rgb.map(f16::from_f64)).collect()),
            Depth::Float => Self::Float(texels.map(|rgb| rgb.map(|t| t as f32)).collect()),
        }
    }

    /// How many texels there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Half(texels) => texels.len(),
            Self::Float(texels) => texels.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The texel at a position in storage order.
    #[must_use]
    pub fn get(&self, index: usize) -> [f32; 3] {
        match self {
            Self::Half(texels) => texels[index].map(f16::to_f32),
            Self::Float(texels) => texels[index],
        }
    }

    /// Their number format.
    #[must_use]
    pub fn depth(&self) -> Depth {
        match self {
            Self::Half(_) => Depth::Half,
            Self::Float(_) => Depth::Float,
        }
    }
}

/// The error of what a table decodes to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ErrorNote {
    /// The error that was promised; none for a size that was asked for.
    pub tolerance: Option<f64>,
    /// The largest error found off the texel centres.
    pub measured: Option<f64>,
}

/// A baked lookup texture.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// What it stores.
    pub quantity: Quantity,
    /// Its axes, the fastest first.
    pub axes: Vec<Axis>,
    /// Texels along each axis.
    pub size: Vec<usize>,
    /// How a texel becomes a value.
    pub encoding: Encoding,
    /// The texels.
    pub texels: Texels,
    /// The first material of each row.
    pub rows: Vec<String>,
    /// Its error.
    pub error: ErrorNote,
}

impl Table {
    /// The texel of a row between the centres around coordinate `u` of the first axis, mixed in
    /// f32: position u·(n−1), clamped to the edge.
    #[must_use]
    pub fn fetch(&self, row: usize, u: f32) -> [f32; 3] {
        let width = self.size[0];
        let position = u.clamp(0.0, 1.0) * (width - 1) as f32;
        let left = (position as usize).min(width - 2);
        let weight = position - left as f32;
        let [a, b] = [0, 1].map(|step| self.texels.get(row * width + left + step));
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * weight)
    }
}
