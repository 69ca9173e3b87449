//! Tables: texels with the axes and the encoding that give them meaning.

use std::str::FromStr;

use half::f16;
use serde::{Deserialize, Serialize};

use crate::lut::axis::Axis;
use crate::lut::quantity::{Encoding, Factor, Quantity};

/// The number format of a texel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Depth {
    /// 16-bit floating point.
    #[default]
    Half,
    /// 32-bit floating point.
    Float,
    /// 16-bit integers over a range.
    Unorm16,
}

/// No depth of that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is not a depth; use half or float")]
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
    /// The name in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Half => "half",
            Self::Float => "float",
            Self::Unorm16 => "unorm16",
        }
    }

    /// Bytes of one channel of one texel.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::Half | Self::Unorm16 => 2,
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
    /// Codes from 0 to 65535 over a range.
    Unorm16 {
        /// The texels that the lowest and the highest code stand for.
        range: [f32; 2],
        /// The codes.
        codes: Vec<[u16; 3]>,
    },
}

impl Texels {
    /// The texels rounded to `depth`.
    #[must_use]
    pub fn rounded(depth: Depth, texels: &[[f64; 3]]) -> Self {
        match depth {
            Depth::Half => Self::Half(texels.iter().map(|rgb| rgb.map(f16::from_f64)).collect()),
            Depth::Float => Self::Float(texels.iter().map(|rgb| rgb.map(|t| t as f32)).collect()),
            Depth::Unorm16 => Self::quantised(texels),
        }
    }

    /// The texels as codes over the range that they span.
    fn quantised(texels: &[[f64; 3]]) -> Self {
        // In f32, as the entry of the file holds the range.
        let all = texels.as_flattened().iter().map(|t| *t as f32);
        let lowest = all.clone().fold(f32::INFINITY, f32::min);
        // Texels that are all equal would span nothing, and their codes be 0/0.
        let highest = all.fold(f32::NEG_INFINITY, f32::max).max(lowest + f32::EPSILON);
        let span = f64::from(highest) - f64::from(lowest);
        let codes = texels
            .iter()
            .map(|rgb| rgb.map(|t| (65535.0 * (t - f64::from(lowest)) / span).round() as u16))
            .collect();
        Self::Unorm16 { range: [lowest, highest], codes }
    }

    /// The range of 16-bit integer texels.
    #[must_use]
    pub fn range(&self) -> Option<[f32; 2]> {
        match self {
            Self::Unorm16 { range, .. } => Some(*range),
            Self::Half(_) | Self::Float(_) => None,
        }
    }

    /// How many texels there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Half(texels) => texels.len(),
            Self::Float(texels) => texels.len(),
            Self::Unorm16 { codes, .. } => codes.len(),
        }
    }

    /// Returns whether there are none.
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
            Self::Unorm16 { range: [lowest, highest], codes } => {
                codes[index].map(|code| lowest + (highest - lowest) * (f32::from(code) / 65535.0))
            }
        }
    }

    /// Their number format.
    #[must_use]
    pub fn depth(&self) -> Depth {
        match self {
            Self::Half(_) => Depth::Half,
            Self::Float(_) => Depth::Float,
            Self::Unorm16 { .. } => Depth::Unorm16,
        }
    }
}

/// The error of what a table decodes to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorNote {
    /// The error that was promised; none for a size that was asked for.
    pub tolerance: Option<f64>,
    /// The largest error found by a search.
    pub measured: Option<f64>,
    /// The largest error found of texture units that cut weights down to multiples of 1/256, which
    /// the promise does not cover.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured_truncated: Option<f64>,
    /// Basis of the tolerance.
    pub proof: Option<Proof>,
}

/// The basis of a promised error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Proof {
    /// A bound over every pair of directions, for texels mixed in f32 and by texture units that
    /// round weights to multiples of 1/256.
    Bounded,
    /// A search for the largest error over pairs of directions, with texels mixed in both ways.
    Sampled,
}

/// A baked lookup texture.
///
/// # Example
///
/// ```
/// use sgdbake::{Depths, Extent, MaskingKind, Quantity, Request, bake, named};
///
/// let request = Request {
///     quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
///     masking: MaskingKind::Exact,
///     extent: Extent::Size(32),
///     depths: Depths::Smallest,
/// };
/// let baked = bake(&[named("gold-paint")?], &request)?;
/// let fresnel = baked.table(Quantity::Fresnel).expect("as requested");
/// let u = fresnel.coordinate(0, 0, 1.0);
/// let f0 = fresnel.fetch(0, u, sgdbake::lut::Filter::Fetched);
/// println!("{:?} texels, F at normal incidence {f0:.3?}", fresnel.size);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The quantity.
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
    /// The row that a table without a row axis holds.
    pub row: Option<usize>,
    /// Its error.
    pub error: ErrorNote,
}

impl Table {
    /// The texel of a row between the centres around coordinate `u` of the first axis: position
    /// u·(n−1), clamped to the edge, mixed in f32.
    #[must_use]
    pub fn fetch(&self, row: usize, u: f32, filter: Filter) -> [f32; 3] {
        let width = self.size[0];
        let (left, weight) = filter.position(u, width);
        let [a, b] = [0, 1].map(|step| self.texels.get(row * width + left + step));
        mix(a, b, weight)
    }

    /// The value at coordinate `u` of a row, per channel; `factor` is the material's array that
    /// the encoding names, if it names one.
    #[must_use]
    pub fn value(&self, row: usize, u: f32, factor: [f64; 3], filter: Filter) -> [f64; 3] {
        let texel = self.fetch(row, u, filter);
        std::array::from_fn(|c| match self.encoding {
            Encoding::Identity => f64::from(texel[c]),
            // exp in f32, as a shader computes it.
            Encoding::ExpTimes { factor: Factor::U } => f64::from(u * texel[c].exp()),
            Encoding::Times { factor } => factor[c] * f64::from(texel[c]),
            Encoding::ExpTimes { factor: Factor::NdfPeak } => factor[c] * f64::from(texel[c].exp()),
        })
    }

    /// The texel of a 3D table at coordinates `u`, mixed in f32 along each axis in turn.
    #[must_use]
    pub fn fetch_3d(&self, u: [f32; 3], filter: Filter) -> [f32; 3] {
        let [i, j, k] = [0, 1, 2].map(|axis| filter.position(u[axis], self.size[axis]));
        // Four lines along the first axis: bit 0 steps along the second, bit 1 along the third.
        let rows = [0, 1, 2, 3].map(|line| {
            let start = ((k.0 + line / 2) * self.size[1] + j.0 + line % 2) * self.size[0] + i.0;
            mix(self.texels.get(start), self.texels.get(start + 1), i.1)
        });
        mix(mix(rows[0], rows[1], j.1), mix(rows[2], rows[3], j.1), k.1)
    }

    /// The same texels as single floats, for many fetches.
    #[must_use]
    pub fn widened(&self) -> Self {
        let texels = (0..self.texels.len()).map(|i| self.texels.get(i)).collect();
        Self { texels: Texels::Float(texels), ..self.clone() }
    }

    /// The coordinate of `x` on an axis.
    #[must_use]
    pub fn coordinate(&self, axis: usize, row: usize, x: f64) -> f32 {
        self.axes[axis].warp.as_ref().map_or(0.0, |warp| warp.coordinate(row, x) as f32)
    }

    /// Bytes of its texels.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.texels.len() * 3 * self.texels.depth().bytes()
    }
}

fn mix(a: [f32; 3], b: [f32; 3], weight: f32) -> [f32; 3] {
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * weight)
}

/// How texels are mixed between their centres.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// Fetched one by one and mixed in f32, as the decoders written with the textures do.
    Fetched,
    /// By a texture unit whose weights are rounded to multiples of 1/256.
    Hardware,
    /// By a texture unit whose weights are cut down to multiples of 1/256.
    Truncating,
}

impl Filter {
    /// The ways that a promised error covers.
    pub const COVERED: [Self; 2] = [Self::Fetched, Self::Hardware];

    /// The texel to the left of coordinate `u` among `width`, and the weight of the right one.
    fn position(self, u: f32, width: usize) -> (usize, f32) {
        let position = u.clamp(0.0, 1.0) * (width - 1) as f32;
        let position = match self {
            Self::Fetched => position,
            // Texture units hold the weight as eight bits behind the point.
            Self::Hardware => (position * 256.0).round() / 256.0,
            Self::Truncating => (position * 256.0).floor() / 256.0,
        };
        // u = 1 lies in the last cell, with a weight of 1.
        let left = (position as usize).min(width - 2);
        (left, position - left as f32)
    }
}
