//! Measured materials for engines: the Shifted Gamma Distribution (SGD) of Bagher, Soler and
//! Holzschuch, evaluated exactly, sampled, baked into textures, fitted and exported.
//!
//! # Conventions
//!
//! * Frame: the surface normal is `n = +z`; `wi` points to the light, `wo` to the viewer, both away
//!   from the surface, unit length; `h = (wi + wo)/|wi + wo|` is the microfacet normal.
//! * Angles are radians, colours linear RGB; a value per colour channel is a `[T; 3]` in the order
//!   of [`material::Channel`].
//! * `f64` is the reference; the `f32` batch path is measured against it.
//! * `alpha` of an SGD channel plays the part of a *squared* Beckmann width: for p → 0 the channel is
//!   exactly a Beckmann lobe of width √alpha.
//!
//! # The pipeline
//!
//! [`math`] → [`material`] → [`microfacet`] → [`brdf`]: from a row of published parameters to
//! the reflectance of a pair of directions. Each module names only modules to its left;
//! ARCHITECTURE.md holds the table and a test keeps it.

#[cfg(feature = "full")]
pub mod asset;
pub mod brdf;
#[cfg(feature = "full")]
pub mod encode;
pub mod fit;
#[cfg(feature = "full")]
pub mod lut;
pub mod material;
pub mod math;
#[cfg(feature = "full")]
pub mod measurement;
pub mod microfacet;
#[cfg(feature = "full")]
pub mod preview;
#[cfg(feature = "full")]
pub mod report;
#[cfg(feature = "full")]
pub mod scene;
