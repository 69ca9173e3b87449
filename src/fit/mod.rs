//! Best fits of an SGD material in the models that engines have: one Beckmann or GGX lobe, a few
//! Beckmann lobes, a glTF material; each with its residual.

pub mod block;
pub mod gltf;
pub mod lobes;
pub mod metric;
pub mod one_lobe;
pub mod picture;
pub mod reason;
pub mod target;
pub mod valleys;

pub use metric::Metric;
pub use reason::Reason;
pub use target::Target;
