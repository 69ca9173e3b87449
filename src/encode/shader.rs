//! The decoders that are written with the textures.

/// GLSL ES 3.00 / GLSL 4.5: evaluates f from the 2D textures.
pub const GLSL: &str = include_str!("sgd_lut.glsl");

/// WGSL: the same.
pub const WGSL: &str = include_str!("sgd_lut.wgsl");
