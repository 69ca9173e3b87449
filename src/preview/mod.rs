//! Reference images: a ball or a mesh under a sun or an environment, and how different two such
//! images look.
//!
//! World frame of a picture: x right, y up, z towards the viewer; the camera is orthographic and
//! sees the unit square around the origin.

pub mod ball;
pub mod colour;
pub mod environment;
pub(crate) mod film;
pub(crate) mod model;
pub mod render;
pub mod shape;

pub use environment::Environment;
pub use film::Film;
pub use model::Model;
pub use shape::Shape;
