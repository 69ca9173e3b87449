//! Tables as bytes: image files, each with the entry that tells how to decode it. Nothing here
//! knows what a texel means beyond what the table says.

mod entry;
mod exr;
mod file;
mod format;
mod generator;
mod ktx2;
mod png;
pub mod shader;

pub use entry::{Interpolation, Location, TextureEntry};
pub use file::{EntryError, UnsupportedDepth, encode, read_entry};
pub use format::{Format, UnknownFormat};
pub use generator::generator_of;

/// The program and its version, as every written file names it.
pub const GENERATOR: &str = concat!("sgdbake ", env!("CARGO_PKG_VERSION"));

/// The key under which a texture file carries its entry.
pub const KEY: &str = "sgdbake";
