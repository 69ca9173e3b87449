//! The three factors of a microfacet reflectance: normal distribution, masking, Fresnel; and the
//! identity that SGD is a mixture of Beckmann lobes.

pub mod beckmann_mixture;
pub mod fresnel;
pub mod masking;
pub mod ndf;
pub mod smith_table;
pub mod visible_normals;

pub use beckmann_mixture::{BeckmannLobe, BeckmannMixture};
pub use fresnel::Fresnel;
pub use masking::{FittedMasking, Masking, SmithMasking};
pub use ndf::{BeckmannNdf, GgxNdf, SgdNdf};
pub use smith_table::SmithTable;
