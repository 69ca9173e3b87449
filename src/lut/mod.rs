//! Lookup textures: the meaning of a texel, how it is fetched, and how many of them a stated error
//! needs.

pub mod albedo;
pub mod axis;
pub mod bake;
pub mod cell_error;
pub mod decode;
pub mod error;
pub mod factors;
pub mod probe;
pub mod quantity;
pub mod request;
pub mod row;
pub mod search;
pub mod table;
pub mod term;
pub mod visibility;
pub mod volume;

pub use axis::{Axis, Variable, Warp};
pub use bake::{Baked, bake, bake_with_progress};
pub use error::{BakeError, LeftOut};
pub use quantity::{Encoding, Factor, Quantity};
pub use request::{Depths, Extent, Request};
pub use row::{Placed, Row, Rows};
pub use table::{Depth, ErrorNote, Filter, Table, Texels};
pub use term::Term;
