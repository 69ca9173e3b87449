//! Lookup textures: what a texel means, how it is fetched, and how many of them a stated error
//! needs.

pub mod albedo;
pub mod axis;
pub mod bake;
pub mod budget;
pub mod decode;
pub mod envelope;
pub mod probe;
pub mod quantity;
pub mod row;
pub mod table;
pub mod term;
pub mod visibility;
pub mod volume;

pub use axis::{Axis, Variable, Warp};
pub use bake::{BakeError, Baked, Depths, Extent, LeftOut, Request, bake, bake_with_progress};
pub use quantity::{Encoding, Factor, Quantity};
pub use row::{Placed, Row};
pub use table::{Depth, ErrorNote, Filter, Table, Texels};
pub use term::Term;
