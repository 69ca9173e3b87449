//! Where a scan is worth descending from.

/// The index of a scanned point that is no higher than its neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Valley(pub usize);

/// Valleys deeper than this multiple of the lowest point are left alone: the descent from a point
/// of the scan gains less than that.
const DEEP_ENOUGH: f64 = 3.0;

/// The valleys of a scan that may hold its lowest point; at least one of a scan that is not empty.
#[must_use]
pub fn valleys(scan: &[f64]) -> Vec<Valley> {
    let lowest = scan.iter().copied().fold(f64::INFINITY, f64::min);
    let neighbours = |i: usize| [i.checked_sub(1), Some(i + 1)].into_iter().flatten();
    let is_valley = |i: &usize| {
        let around = neighbours(*i).filter_map(|j| scan.get(j)).copied();
        scan[*i] <= DEEP_ENOUGH * lowest && around.fold(f64::INFINITY, f64::min) >= scan[*i]
    };
    (0..scan.len()).filter(is_valley).map(Valley).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_of_two_valleys_are_found_and_a_shallow_one_is_not() {
        assert_eq!(valleys(&[3.0, 1.0, 2.0, 1.5, 4.0, 3.5]), [Valley(1), Valley(3)]);
        assert_eq!(valleys(&[5.0, 4.0, 1.0]), [Valley(2)]);
    }
}
