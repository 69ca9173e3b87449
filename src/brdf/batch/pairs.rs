//! What a batch takes and gives: slices of one length.

/// Pairs of unit directions, one slice per component x, y, z.
#[derive(Clone, Copy, Debug)]
pub struct Pairs<'a> {
    /// Directions to the light.
    pub wi: [&'a [f32]; 3],
    /// Directions to the viewer.
    pub wo: [&'a [f32]; 3],
}

/// The results: one slice per colour channel.
#[derive(Debug)]
pub struct RgbMut<'a>(pub [&'a mut [f32]; 3]);

/// Slices of one batch that differ in length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("slices differ in length: expected {expected}, found {found}")]
pub struct LengthMismatch {
    /// Length of the first slice.
    pub expected: usize,
    /// Length of the slice that differs.
    pub found: usize,
}

/// Checks that all lengths are the first one.
pub fn same_length(mut lengths: impl Iterator<Item = usize>) -> Result<(), LengthMismatch> {
    let expected = lengths.next().unwrap_or(0);
    match lengths.find(|length| *length != expected) {
        Some(found) => Err(LengthMismatch { expected, found }),
        None => Ok(()),
    }
}
