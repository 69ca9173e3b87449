//! The reflectance itself: evaluation for one pair of directions and for many, its albedo, and
//! the simpler models that stand in for it.

pub mod albedo;
pub mod batch;
pub mod engine;
pub mod eval;
pub mod gltf;
pub mod lobes;
pub mod one_lobe;
pub mod reflectance;
pub mod sampler;

pub use albedo::{FresnelMoments, directional_albedo};
pub use batch::SgdBatch;
pub use eval::{ChannelBrdf, Factors, SgdBrdf, Terms};
pub use gltf::GltfBrdf;
pub use lobes::LobesBrdf;
pub use one_lobe::{Distribution, OneLobeBrdf};
pub use reflectance::Reflectance;
pub use sampler::{Sampler, Strategy};
