//! Parameters of measured materials: the published catalogue and material files.
//!
//! A [`Material`] is validated once, when it is read; everything after that is infallible.

pub(crate) mod catalog;
mod embedded;
pub(crate) mod file;
pub(crate) mod parameters;
pub(crate) mod refit;

pub use catalog::{CatalogEntry, Edition, UnknownMaterial, catalog, find, named};
pub use file::{MaterialFileError, load, parse, to_toml};
pub use parameters::{
    Channel, ChannelParams, LobeFields, LobeParams, MAX_LOBES, MaskingParams, Material,
    MaterialError, ParameterError,
};
pub use refit::{RefitEntry, SUFFIX, SurfaceError, refit, refit_of};
