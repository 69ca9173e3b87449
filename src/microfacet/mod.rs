//! The three factors of a microfacet reflectance: distributions of normals, each with its masking
//! and its visible normals; Fresnel; and the paper's masking fit.

pub mod beckmann;
pub mod distribution;
pub mod fitted_masking;
pub mod fresnel;
pub mod g1_table;
pub mod ggx;
pub mod mixture;
pub mod one_width;
pub mod sgd;

pub use beckmann::Beckmann;
pub use distribution::{Distribution, grazing_limit};
pub use fitted_masking::FittedMasking;
pub use fresnel::Fresnel;
pub use g1_table::G1Table;
pub use ggx::Ggx;
pub use mixture::{BeckmannMixture, Component, SharedMixture};
pub use one_width::{Family, OneWidth};
pub use sgd::{Accuracy, Sgd, SgdNdf, tuned_ggx_width};
