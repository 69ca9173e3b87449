//! Local minima of a scan, from which descents start, and the lowest of their ends.

use crate::math::least_squares::Minimum;

/// Local minima higher than this multiple of the lowest point are left alone: the descent from a
/// point of the scan gains less than that.
const LOW_ENOUGH: f64 = 3.0;

/// The indices of a scan's local minima that may lead to the lowest point; at least one of a scan
/// that is not empty and holds a number.
#[must_use]
pub fn local_minima(scan: &[f64]) -> Vec<usize> {
    let lowest = scan.iter().copied().fold(f64::INFINITY, f64::min);
    // A NaN is neither low nor a neighbour: `min` and `<=` both pass over it.
    let low = (0..scan.len()).filter(|i| scan[*i] <= LOW_ENOUGH * lowest);
    // ≥, so that on a plateau at least one point counts.
    low.filter(|i| lowest_neighbour(scan, *i) >= scan[*i]).collect()
}

/// The lower of a point's neighbours; an end of the scan has one.
fn lowest_neighbour(scan: &[f64], i: usize) -> f64 {
    let neighbours = [i.checked_sub(1), Some(i + 1)].into_iter().flatten();
    neighbours.filter_map(|j| scan.get(j)).copied().fold(f64::INFINITY, f64::min)
}

/// The lowest of at least one minimum.
///
/// # Panics
///
/// Without a minimum.
#[must_use]
pub fn lowest(minima: impl Iterator<Item = Minimum>) -> Minimum {
    minima
        .min_by(|a, b| a.squares.total_cmp(&b.squares))
        .expect("a scan has at least one local minimum, its lowest point")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_of_two_minima_are_found_and_a_high_one_is_not() {
        assert_eq!(local_minima(&[3.0, 1.0, 2.0, 1.5, 4.0, 3.5]), [1, 3]);
        assert_eq!(local_minima(&[5.0, 4.0, 1.0]), [2]);
    }
}
