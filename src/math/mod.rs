//! Pure numerics: special functions, quadrature rules and directions, with no physics in them.

pub mod box_least_squares;
pub mod direction;
pub mod exponential_integral;
pub mod quadrature;

pub use errorfunctions::RealErrorFunctions;
