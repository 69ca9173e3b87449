//! Pure numerics: special functions, polynomials, quadrature rules and directions, with no physics in them.

pub mod box_least_squares;
pub mod chebyshev;
pub mod direction;
pub mod exponential_integral;
pub mod quadrature;

pub use errorfunctions::RealErrorFunctions;
