//! Best fits of an SGD material in the models that engines have: one Beckmann or GGX lobe, a
//! Beckmann mixture, a glTF material; each with its residual.

pub(crate) mod colour;
pub(crate) mod descent;
pub(crate) mod energy;
pub(crate) mod fresnel_curve;
pub mod gltf;
pub mod gltf_measured;
pub(crate) mod gltf_problem;
pub(crate) mod gltf_unknowns;
pub(crate) mod lanes;
pub mod measured_target;
pub mod metric;
pub(crate) mod minima;
pub mod mixture;
pub mod mixture_measured;
pub(crate) mod mixture_problem;
pub mod one_lobe;
pub mod one_lobe_measured;
pub(crate) mod penalty;
pub(crate) mod picture;
pub(crate) mod reason;
pub mod sgd;
pub mod sgd_model;
pub(crate) mod shape;
pub(crate) mod start;
pub mod target;
pub mod uncertainty;
pub(crate) mod unknowns;

pub use metric::Metric;
pub use reason::Reason;
pub use target::Target;
