//! Tables as bytes: image files and the manifest that tells how to decode them. Nothing here
//! knows what a texel means beyond what the table says.

pub mod entry;
pub mod exr;
pub mod ktx2;
pub mod manifest;
pub mod png;
pub mod shader;

/// What writes the files, and the mark by which the tool knows its own.
pub const GENERATOR: &str = concat!("sgdbake ", env!("CARGO_PKG_VERSION"));

/// The key under which a texture file carries its manifest entry.
pub const KEY: &str = "sgdbake";
