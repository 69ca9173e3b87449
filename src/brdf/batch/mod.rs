//! f of many pairs of directions in f32: slices in, slices out, on the widest vector instructions
//! that the machine has.
//!
//! The loops are plain; compilers vectorise them for each instruction set, and the choice is made
//! at run time. Results on one instruction set do not depend on a pair's place in its slice or on
//! the slice's length.

pub mod albedo;
pub mod masking;
pub mod sampler;

mod block;
mod constants;
mod kernel;
mod pairs;
mod sgd_batch;
mod shares;
mod squared_slopes;

pub use crate::math::instruction_set::InstructionSet;
pub use pairs::{LengthMismatch, Pairs, RgbMut};
pub use sampler::{Draws, SamplerBatch, SamplesMut};
pub use sgd_batch::SgdBatch;
