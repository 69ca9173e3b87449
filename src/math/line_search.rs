//! Global minimum of a function of one variable.

/// An argument and the value there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The argument.
    pub x: f64,
    /// The value.
    pub value: f64,
}

/// The minimum of `f` by golden sections of the bracket around the lowest of `scan` (ascending in
/// x), until the bracket is narrower than `width`.
///
/// Global as far as the scan is dense enough to have its lowest point beside the minimum; at an
/// end of the scan the search stays between the last two points.
pub fn refine(scan: &[Point], width: f64, mut f: impl FnMut(f64) -> f64) -> Point {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let Some(lowest) = (0..scan.len()).min_by(|a, b| scan[*a].value.total_cmp(&scan[*b].value))
    else {
        return Point { x: f64::NAN, value: f64::NAN };
    };
    let (mut low, mut high) =
        (scan[lowest.saturating_sub(1)].x, scan[(lowest + 1).min(scan.len() - 1)].x);
    let mut at = |x: f64| Point { x, value: f(x) };
    let mut left = at(high - GOLDEN * (high - low));
    let mut right = at(low + GOLDEN * (high - low));
    while high - low > width {
        if left.value < right.value {
            high = right.x;
            right = left;
            left = at(high - GOLDEN * (high - low));
        } else {
            low = left.x;
            left = right;
            right = at(low + GOLDEN * (high - low));
        }
    }
    [scan[lowest], left, right]
        .into_iter()
        .min_by(|a, b| a.value.total_cmp(&b.value))
        .unwrap_or(left)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_lower_of_two_valleys() {
        let f = |x: f64| (x * x - 1.0).powi(2) + 0.1 * x;
        let scan: Vec<Point> =
            (0..9).map(|i| f64::from(i) * 0.5 - 2.0).map(|x| Point { x, value: f(x) }).collect();
        let found = refine(&scan, 1e-7, f);
        assert!((found.x + 1.012_272).abs() < 1e-5, "{found:?}");
    }

    #[test]
    fn a_minimum_at_the_end_is_kept() {
        let scan = [0.0, 1.0, 2.0].map(|x| Point { x, value: x });
        assert!(refine(&scan, 1e-6, |x| x).x < 1e-5);
    }
}
