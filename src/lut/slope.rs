//! Bounds on the slope of the published masking's texels: what linear interpolation errs by across
//! the corner where masking sets in.

use crate::lut::interval::{Interval, hull, plus, times};
use crate::microfacet::FittedMasking;

/// Parts of a cell over which the slope is bounded.
const PARTS: usize = 8;
/// The coordinate that stands for the limit at grazing.
const GRAZING: f64 = 1e-12;

/// The `masking` texel t = ln(G1/u) of a published fit, against u with cotθ = s u/(1−u).
///
/// # Derivation
///
/// With e = atan cotθ, d ln G1/d ln e is bounded by [`FittedMasking::elasticity`], and
///
/// ```text
/// t' = (R − 1)/u,   R = (d ln G1/d ln e)·(d ln e/d ln u)
/// d ln e/d ln u = (sin e cos e/e)/(1−u) = sin²e/(e s u)
/// ```
///
/// sin e cos e/e and 1/u fall with u, 1/(1−u) and sin²e rise. Next to u = 0, where R is near 1, the
/// same without a difference over u, each factor again monotonic, but for (1−u)² + s²u², a parabola:
///
/// ```text
/// t' = (d ln(G1/e)/de)·de/du + d ln(e/u)/du,   de/du = s/((1−u)² + s²u²)
/// d ln(e/u)/du = 1/(1−u) − P e (e/tan e) s/(1−u)²,   P = (1 − sin 2e/(2e))/e²
/// ```
pub struct SlopeBounds<'a> {
    masking: &'a FittedMasking,
    /// s of the warp.
    scale: f64,
}

impl<'a> SlopeBounds<'a> {
    /// The bounds for a fit in a row whose warp has the scale s.
    #[must_use]
    pub fn new(masking: &'a FittedMasking, scale: f64) -> Self {
        Self { masking, scale }
    }

    /// How far the chord between two `stored` texels at the ends of `u` lies below and above the
    /// exact t, at most.
    #[must_use]
    pub fn chord_error(&self, u: Interval, stored: Interval) -> Interval {
        let rise = (stored[1] - stored[0]) / (u[1] - u[0]);
        let places = self.places(u);
        let parts = places.windows(2).map(|part| {
            let part = [part[0], part[1]];
            let [left, right] = part.map(|x| stored[0] + rise * (x - u[0]) - self.texel(x));
            let room = self.room(part);
            [left.min(right) - room, left.max(right) + room]
        });
        parts.reduce(hull).unwrap_or([0.0; 2])
    }

    /// t = ln(G1/u).
    fn texel(&self, u: f64) -> f64 {
        let u = u.max(GRAZING);
        (self.masking.g1_at_elevation(self.elevation(u)) / u).ln()
    }

    /// e = atan(s u/(1−u)).
    fn elevation(&self, u: f64) -> f64 {
        (self.scale * u).atan2(1.0 - u)
    }

    /// The ends of the parts of a cell, and the corner if the cell has it.
    fn places(&self, [from, to]: Interval) -> Vec<f64> {
        let even = (0..=PARTS).map(|k| from + (to - from) * k as f64 / PARTS as f64);
        let onset = self.masking.onset_elevation();
        let corner = if onset < std::f64::consts::FRAC_PI_2 {
            1.0 / (1.0 + self.scale / onset.tan())
        } else {
            1.0
        };
        let inside = (from < corner && corner < to).then_some(corner);
        let mut places: Vec<f64> = even.chain(inside).collect();
        places.sort_by(f64::total_cmp);
        places
    }

    /// How far t may lie from its own chord over a part: a curve through both ends whose slope lies
    /// between two values stays within the parallelogram of these slopes.
    fn room(&self, part: Interval) -> f64 {
        let width = part[1] - part[0];
        if width <= 0.0 {
            return 0.0;
        }
        let [low, high] = self.slope(part);
        let mean = ((self.texel(part[1]) - self.texel(part[0])) / width).clamp(low, high);
        match (low.is_finite(), high.is_finite()) {
            (true, true) if high > low => width * (high - mean) * (mean - low) / (high - low),
            (true, true) => 0.0,
            (true, false) => width * (mean - low),
            (false, true) => width * (high - mean),
            (false, false) => f64::INFINITY,
        }
    }

    /// Bounds on t' over `u` in an interval that the corner does not divide.
    fn slope(&self, u: Interval) -> Interval {
        let e = u.map(|u| self.elevation(u));
        let of_masking = self.masking.elasticity(e);
        let of_angle = self.of_angle(u, e);
        let r = [0, 1].map(|end| of_masking[end] * of_angle[end]);
        let by_ratio = [
            (r[0] - 1.0) / if r[0] < 1.0 { u[0] } else { u[1] },
            (r[1] - 1.0) / if r[1] > 1.0 { u[0] } else { u[1] },
        ];
        let by_sum = self.by_sum(u, e);
        let [low, high] = [by_ratio[0].max(by_sum[0]), by_ratio[1].min(by_sum[1])];
        [low.min(high), high.max(low)]
    }

    /// Bounds on d ln e/d ln u.
    fn of_angle(&self, u: Interval, e: Interval) -> Interval {
        let falling = e.map(|e| if e > 0.0 { e.sin() * e.cos() / e } else { 1.0 });
        let rising = u.map(|u| 1.0 / (1.0 - u));
        let squares = e.map(|e| e.sin() * e.sin());
        let inverses = [0, 1].map(|end| 1.0 / (e[end] * self.scale * u[end]));
        let low = (falling[1] * rising[0]).max(squares[0] * inverses[1]);
        let high = (falling[0] * rising[1]).min(squares[1] * inverses[0]);
        [low, high]
    }

    /// Bounds on t' as a sum, which is tight next to the horizon; infinite where u may be 1.
    fn by_sum(&self, u: Interval, e: Interval) -> Interval {
        if u[1] >= 1.0 {
            return [f64::NEG_INFINITY, f64::INFINITY];
        }
        let s = self.scale;
        let least = square_distance(s, (1.0 / (1.0 + s * s)).clamp(u[0], u[1]));
        let most = square_distance(s, u[0]).max(square_distance(s, u[1]));
        let turn = [s / most, s / least];
        let [bend, straight] = [curvature_of_angle, angle_per_cot].map(|f| e.map(f));
        let open = u.map(|u| 1.0 / (1.0 - u));
        let of_angle = [
            open[0] - bend[0] * e[1] * straight[0] * s * open[1] * open[1],
            open[1] - bend[1] * e[0] * straight[1] * s * open[0] * open[0],
        ];
        plus(times(self.masking.ratio_slope(e), turn), of_angle)
    }
}

/// (1−u)² + s²u².
fn square_distance(s: f64, u: f64) -> f64 {
    (1.0 - u) * (1.0 - u) + s * s * u * u
}

/// (1 − sin 2e/(2e))/e², which falls with e from ⅔.
fn curvature_of_angle(e: f64) -> f64 {
    const SERIES: f64 = 1e-3;
    if e < SERIES {
        return 2.0 / 3.0 - 2.0 / 15.0 * e * e;
    }
    (1.0 - (2.0 * e).sin() / (2.0 * e)) / (e * e)
}

/// e/tan e, which falls with e from 1.
fn angle_per_cot(e: f64) -> f64 {
    if e > 0.0 { e / e.tan() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{MaskingParams, catalog};

    /// Chords of many cells, the exact texels at their ends, against the texel at many places.
    fn check(masking: &FittedMasking, scale: f64, cells: usize) -> (f64, f64) {
        let bounds = SlopeBounds::new(masking, scale);
        let (mut largest, mut widest): (f64, f64) = (0.0, 0.0);
        for cell in 0..cells {
            let u = [cell, cell + 1].map(|i| i as f64 / cells as f64);
            let stored = u.map(|u| bounds.texel(u));
            let [low, high] = bounds.chord_error(u, stored);
            for k in 0..=97 {
                let w = f64::from(k) / 97.0;
                let chord = stored[0] + (stored[1] - stored[0]) * w;
                let off = chord - bounds.texel(u[0] + (u[1] - u[0]) * w);
                assert!(
                    low - 1e-11 <= off && off <= high + 1e-11,
                    "{masking:?} cell {cell} at {w}: {off} not in {low}..{high}"
                );
                largest = largest.max(off.abs());
            }
            widest = widest.max(high.max(-low));
        }
        (largest, widest)
    }

    fn scale_of(masking: &FittedMasking) -> f64 {
        GRAZING / masking.g1(GRAZING)
    }

    #[test]
    fn the_published_fits_keep_within_their_bounds() {
        for entry in catalog() {
            for lobe in entry.material.lobes() {
                let masking = FittedMasking::of(lobe);
                let (largest, bound) = check(&masking, scale_of(&masking), 90);
                let name = &entry.material.name;
                assert!(bound <= 1.4 * largest + 1e-9, "{name}: {bound} for {largest}");
            }
        }
    }

    #[test]
    fn powers_below_one_and_corners_anywhere_keep_within_their_bounds() {
        for k in [0.3, 0.9, 1.0, 1.5, 2.0, 6.0, 300.0] {
            for lambda in [1e-6, 0.3, 40.0, 1e6] {
                for c in [1e-3, 1.0, 50.0, 1e9] {
                    let masking = FittedMasking::new(MaskingParams { lambda, c, k });
                    for factor in [0.3, 1.0, 4.0] {
                        check(&masking, factor * scale_of(&masking), 60);
                    }
                }
            }
        }
    }
}
