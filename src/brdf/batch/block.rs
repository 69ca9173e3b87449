//! A block of pairs: one array per quantity, so that straight loops over them are vector loops.

/// Pairs that go through the formula together; every block is full, the last one padded, so a
/// pair's result does not depend on its place in a slice.
pub const BLOCK: usize = 128;

/// A value for each pair of a block.
pub type Lanes = [f32; BLOCK];
