//! The colour scale of difference maps.

use crate::preview::film::{DeltaE, FilmError, encode_png};

/// ΔE2000 at the scale's end; larger differences look the same.
pub const SCALE_END: f64 = 10.0;

/// Colours at even steps from 0 to [`SCALE_END`]: dark to bright, evenly rising in lightness.
pub const SCALE: [[u8; 3]; 6] =
    [[13, 8, 66], [70, 16, 120], [145, 33, 118], [214, 69, 79], [249, 142, 32], [252, 232, 120]];

/// The colour of a difference.
#[must_use]
pub fn colour(delta_e: f64) -> [u8; 3] {
    let position = (delta_e / SCALE_END).clamp(0.0, 1.0) * (SCALE.len() - 1) as f64;
    // The end of the scale lies in the last interval, with a share of 1.
    let left = (position as usize).min(SCALE.len() - 2);
    let share = position - left as f64;
    std::array::from_fn(|c| {
        let [a, b] = [left, left + 1].map(|step| f64::from(SCALE[step][c]));
        (a + share * (b - a)).round() as u8
    })
}

/// A difference map as PNG bytes, transparent off the object.
///
/// # Errors
///
/// The encoder refuses the size.
pub fn png(difference: &DeltaE, width: usize) -> Result<Vec<u8>, FilmError> {
    let mut rgba = Vec::with_capacity(4 * difference.map.len());
    for delta_e in &difference.map {
        rgba.extend(delta_e.map_or([0; 4], |delta_e| {
            let [r, g, b] = colour(delta_e);
            [r, g, b, 255]
        }));
    }
    encode_png(&rgba, width, difference.map.len() / width.max(1))
}

/// The scale as a CSS gradient.
#[must_use]
pub fn gradient() -> String {
    let stops = SCALE.map(|[r, g, b]| format!("rgb({r} {g} {b})"));
    format!("linear-gradient(to right, {})", stops.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_starts_and_ends_where_it_says() {
        assert_eq!(colour(0.0), SCALE[0]);
        assert_eq!(colour(SCALE_END), SCALE[5]);
        assert_eq!(colour(1e9), SCALE[5]);
        assert_eq!(colour(2.0), SCALE[1]);
    }
}
