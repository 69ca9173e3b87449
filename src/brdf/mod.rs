//! The reflectance itself: evaluation for one pair of directions.

pub mod eval;
pub mod reflectance;

pub use eval::{ChannelBrdf, SgdBrdf, Terms};
pub use reflectance::Reflectance;
