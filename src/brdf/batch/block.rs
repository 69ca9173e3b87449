//! A block of pairs: one array per quantity, so that straight loops over them are vector loops.

/// Pairs that go through the formula together; every block is full, the last one padded, so a
/// pair's result does not depend on its place in a slice.
pub const BLOCK: usize = 128;

/// A value for each pair of a block.
pub type PerPair = [f32; BLOCK];

/// `count` values from `start` of each slice, then zeros.
#[inline(always)]
pub fn load<const N: usize>(
    lanes: &mut [PerPair; N],
    from: [&[f32]; N],
    start: usize,
    count: usize,
) {
    for (lanes, from) in lanes.iter_mut().zip(from) {
        if count < BLOCK {
            *lanes = [0.0; BLOCK];
        }
        lanes[..count].copy_from_slice(&from[start..start + count]);
    }
}

/// The first `count` values to `start` of each slice.
#[inline(always)]
pub fn store<const N: usize>(
    to: &mut [&mut [f32]; N],
    lanes: &[PerPair; N],
    start: usize,
    count: usize,
) {
    for (to, lanes) in to.iter_mut().zip(lanes) {
        to[start..start + count].copy_from_slice(&lanes[..count]);
    }
}

/// The direction of pair `i`.
///
/// Not a closure over the axes: those stay calls, and a loop with a call is no vector loop.
#[inline(always)]
pub fn at([x, y, z]: &[PerPair; 3], i: usize) -> [f32; 3] {
    [x[i], y[i], z[i]]
}
