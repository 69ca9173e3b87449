//! Best fits of an SGD material in the models that engines have: one Beckmann or GGX lobe, a
//! Beckmann mixture, a glTF material; each with its residual.

pub mod colour;
pub mod descent;
pub mod energy;
pub mod gltf;
pub mod gltf_measured;
pub mod lanes;
pub mod measured_target;
pub mod metric;
pub mod minima;
pub mod mixture;
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

pub use metric::Metric;
pub use reason::Reason;
pub use target::Target;
