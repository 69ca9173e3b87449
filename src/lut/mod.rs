//! Lookup textures: the meaning of a texel, how it is fetched, and how many of them a stated error
//! needs.

#[doc(hidden)]
pub mod albedo;
#[doc(hidden)]
pub mod attack;
pub(crate) mod axis;
pub(crate) mod bake;
pub(crate) mod bend;
pub(crate) mod cell_error;
#[doc(hidden)]
pub mod covering;
pub mod decode;
pub(crate) mod error;
#[doc(hidden)]
pub(crate) mod extremes;
#[doc(hidden)]
pub mod factors;
pub(crate) mod interval;
pub(crate) mod memory;
#[doc(hidden)]
pub mod probe;
pub(crate) mod promise;
pub(crate) mod quantity;
pub(crate) mod range;
pub(crate) mod ranges;
pub(crate) mod request;
#[doc(hidden)]
pub mod row;
pub(crate) mod sampled;
pub(crate) mod search;
pub(crate) mod slope;
pub(crate) mod table;
pub(crate) mod term;
#[doc(hidden)]
pub mod visibility;
#[doc(hidden)]
pub mod volume;
mod volume_lines;

pub use axis::{Axis, Variable, Warp};
pub use bake::{Baked, bake, bake_with_progress};
pub use error::{BakeError, LeftOut};
pub use quantity::{Encoding, Factor, Quantity};
pub use request::{Depths, Extent, Request};
pub use row::{Placed, Row, Rows};
pub use table::{Depth, ErrorNote, Filter, Proof, Table, Texels};
pub use term::Term;
