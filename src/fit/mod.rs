//! Best fits of an SGD material in the models that engines have: one Beckmann or GGX lobe, a few
//! Beckmann lobes, a glTF material; each with its residual.

pub mod block;
pub mod colour;
pub mod descent;
pub mod energy;
pub mod gltf;
pub mod gltf_measured;
pub mod lobes;
pub mod measured_target;
pub mod metric;
pub mod one_lobe;
pub mod one_lobe_measured;
pub mod picture;
pub mod reason;
pub mod sgd;
pub mod sgd_model;
pub mod shape;
pub mod start;
pub mod target;
pub mod uncertainty;
pub mod valleys;

pub use metric::Metric;
pub use reason::Reason;
pub use target::Target;
