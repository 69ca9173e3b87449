//! Parameters of measured materials: the published catalogue and material files.
//!
//! A [`Material`] is validated once, when it is read; everything after that is infallible.

pub(crate) mod catalog;
mod embedded;
pub(crate) mod file;
mod file_error;
pub(crate) mod lobe;
pub(crate) mod parameters;
mod range;
pub(crate) mod refit;
mod section;

pub use catalog::{CatalogEntry, Edition, UnknownMaterial, catalog, find, named};
pub use file::{load, parse, to_toml};
pub use file_error::MaterialFileError;
pub use lobe::{LobeFields, LobeParams, MAX_LOBES, MaskingParams};
pub use parameters::{Channel, ChannelParams, Material, MaterialError};
pub use range::ParameterError;
pub use refit::{RefitEntry, SUFFIX, SurfaceError, refit, refit_of};
