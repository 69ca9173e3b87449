//! The reflectance itself: evaluation for one pair of directions.

pub mod eval;
pub mod gltf;
pub mod lobes;
pub mod one_lobe;
pub mod reflectance;

pub use eval::{ChannelBrdf, SgdBrdf, Terms};
pub use gltf::GltfBrdf;
pub use lobes::LobesBrdf;
pub use one_lobe::{Distribution, OneLobeBrdf};
pub use reflectance::Reflectance;
