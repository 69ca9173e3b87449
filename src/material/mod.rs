//! Parameters of measured materials: the published catalogue and material files.
//!
//! A [`Material`] is validated once, when it is read; everything after that is infallible.

pub mod catalog;
pub mod file;
pub mod parameters;

pub use catalog::{CatalogEntry, UnknownMaterial, catalog, find};
pub use file::{MaterialFileError, load, parse, to_toml};
pub use parameters::{
    Channel, ChannelParams, LobeFields, LobeParams, MAX_LOBES, MaskingParams, Material,
    MaterialError, ParameterError,
};
