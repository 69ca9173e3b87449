//! Best fits of an SGD material in the models that engines have: one Beckmann or GGX lobe, a
//! Beckmann mixture, a glTF material; each with its residual.

pub mod gltf;
pub mod lanes;
pub mod metric;
pub mod minima;
pub mod mixture;
pub mod one_lobe;
pub mod picture;
pub mod reason;
pub mod target;

pub use metric::Metric;
pub use reason::Reason;
pub use target::Target;
