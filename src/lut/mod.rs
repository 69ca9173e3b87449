//! Lookup textures: what a texel means, how it is fetched, and how many of them a stated error
//! needs.

pub mod axis;
pub mod bake;
pub mod quantity;
pub mod row;
pub mod table;

pub use axis::{Axis, Variable, Warp};
pub use bake::{BakeError, Baked, Extent, LeftOut, Request, bake};
pub use quantity::{Encoding, Factor, Quantity};
pub use row::{Placed, Row};
pub use table::{Depth, ErrorNote, Table, Texels};
