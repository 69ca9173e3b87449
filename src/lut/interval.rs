//! Intervals: the values that something takes, from the least to the largest.

/// The least and the largest value.
pub type Interval = [f64; 2];

/// The interval that holds both.
#[must_use]
pub fn hull(a: Interval, b: Interval) -> Interval {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// The products of two intervals' values.
#[must_use]
pub fn times(a: Interval, b: Interval) -> Interval {
    let products = [a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]];
    products.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)])
}

/// The interval between two values.
#[must_use]
pub fn between(a: f64, b: f64) -> Interval {
    [a.min(b), a.max(b)]
}

/// The sums of two intervals' values.
#[must_use]
pub fn plus(a: Interval, b: Interval) -> Interval {
    [a[0] + b[0], a[1] + b[1]]
}

/// The least magnitude within an interval.
#[must_use]
pub fn least_magnitude([low, high]: Interval) -> f64 {
    // Where the interval holds 0, low and −high are both negative.
    low.max(-high).max(0.0)
}
