//! The three factors of a microfacet reflectance: distributions of normals, each with its masking
//! and its visible normals; Fresnel; and the paper's masking fit.

pub(crate) mod beckmann;
pub(crate) mod distribution;
pub(crate) mod fitted_masking;
pub(crate) mod fresnel;
pub(crate) mod g1_polynomial;
pub(crate) mod g1_table;
pub(crate) mod ggx;
pub(crate) mod mixture;
pub(crate) mod one_width;
pub(crate) mod sgd;
pub(crate) mod visible_normals;

pub use beckmann::Beckmann;
pub use distribution::{Distribution, from_slope_density, grazing_limit};
pub use fitted_masking::FittedMasking;
pub use fresnel::Fresnel;
pub use g1_polynomial::G1Polynomial;
pub use g1_table::{G1Table, SingleG1Table};
pub use ggx::Ggx;
pub use mixture::{BeckmannMixture, Component, SharedMixture};
pub use one_width::{Family, OneWidth};
pub use sgd::{Accuracy, Sgd, SgdNdf, tuned_ggx_width};
pub use visible_normals::VisibleNormals;
