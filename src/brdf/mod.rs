//! The reflectance itself: evaluation for one pair of directions.

pub mod eval;

pub use eval::{ChannelBrdf, SgdBrdf, Terms};
