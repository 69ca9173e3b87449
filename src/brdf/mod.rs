//! The reflectance itself: evaluation for one pair of directions and for many, its albedo, and
//! the simpler models that stand in for it.

pub mod albedo;
pub mod batch;
pub mod engine;
mod engine_albedos;
pub(crate) mod gltf;
pub(crate) mod model;
pub(crate) mod one_lobe;
#[doc(hidden)]
pub mod reflectance;
#[doc(hidden)]
pub mod sampler;

pub use albedo::{FresnelMoments, directional_albedo};
pub use batch::{SamplerBatch, SgdBatch};
pub use gltf::GltfBrdf;
pub use model::{Brdf, Lobe, LobeCurves, LobeTerms, MaskingKind, SgdBrdf, Terms};
pub use one_lobe::{OneLobe, OneLobeChannel};
pub use reflectance::{Reflectance, Sample};
pub use sampler::{Sampler, Strategy};
