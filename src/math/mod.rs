//! Pure numerics: special functions, polynomials, quadrature rules, directions and vector
//! arithmetic, with no physics in them.

pub mod arithmetic;
pub mod chebyshev;
pub mod direction;
pub mod exponential_integral;
pub mod instruction_set;
pub mod least_squares;
pub mod octave_table;
pub mod quadrature;

pub use errorfunctions::RealErrorFunctions;
