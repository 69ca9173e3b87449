//! Intervals of the angles of a box of pairs, and of a lobe's factors over it.

use std::f64::consts::{FRAC_1_PI, FRAC_1_SQRT_2};

use crate::brdf::Lobe;
use crate::lut::interval::{Interval, plus, times};
use crate::math::direction::sin_of_cot;
use crate::microfacet::{Distribution as _, Sgd};

/// D relative to its peak below which an error counts as one of the peak's: see
/// [`crate::lut::cell_error`].
const VANISHED: f64 = 1e-60;

/// The angles of the pairs in a box.
#[derive(Clone, Copy, Debug)]
pub struct AngleRanges {
    /// cosθo.
    pub cos_o: Interval,
    /// sinθo.
    pub sin_o: Interval,
    /// cotθo.
    pub cot_o: Interval,
    /// tan²θh.
    pub tan2: Interval,
    /// cosθd.
    pub cos_d: Interval,
    /// cosθi.
    pub cos_i: Interval,
    /// cotθi.
    pub cot_i: Interval,
}

/// The factors of a lobe over a box.
#[derive(Clone, Copy, Debug, Default)]
pub struct LobeRange {
    /// D G1(wi) G1(wo)/(π cosθo).
    pub product: Interval,
    /// F per colour.
    pub fresnel: [Interval; 3],
    /// How much D, G1(wi) and G1(wo)/cosθo vary, as logarithms.
    pub spread: [f64; 3],
}

impl AngleRanges {
    /// The angles of viewers at cotθo, half vectors at tan²θh and the cosine of the azimuth between;
    /// `None` where no light of such a pair is above the horizon.
    #[must_use]
    pub fn new(cot_o: Interval, tan2: Interval, cos_phi: Interval) -> Option<Self> {
        // With cotθ cosines rise and sines fall, with tan²θh the other way round: ends swap.
        let cos_o = cot_o.map(|cot| if cot.is_finite() { cot * sin_of_cot(cot) } else { 1.0 });
        let sin_o = [sin_of_cot(cot_o[1]), sin_of_cot(cot_o[0])];
        let cos_h = [tan2[1], tan2[0]].map(|x| 1.0 / (1.0 + x).sqrt());
        let sin_h = tan2.map(|x| if x.is_finite() { (x / (1.0 + x)).sqrt() } else { 1.0 });
        // cosθd = cosθo cosθh + sinθo sinθh cosφ,   cosθi = cosθo cos2θh + sinθo sin2θh cosφ.
        // Sines are not negative: their ends multiply. cosφ has both signs, and needs all products.
        let sin_sin = [sin_o[0] * sin_h[0], sin_o[1] * sin_h[1]];
        let cos_d = plus([cos_o[0] * cos_h[0], cos_o[1] * cos_h[1]], times(sin_sin, cos_phi));
        // 2θh stays within [0, π], where the cosine falls: its ends remain ends.
        let cos_2h = cos_h.map(|cos| 2.0 * cos * cos - 1.0);
        let sin_2h = twice(sin_h, cos_h);
        let cos_i = plus(
            times(cos_o, cos_2h),
            times([sin_o[0] * sin_2h[0], sin_o[1] * sin_2h[1]], cos_phi),
        );
        if cos_i[1] <= 0.0 || cos_d[1] <= 0.0 {
            return None;
        }
        // A box may reach below the horizon, and rounding above 1.
        let [cos_d, cos_i] = [cos_d, cos_i].map(|cos| cos.map(|cos| cos.clamp(0.0, 1.0)));
        Some(Self { cos_o, sin_o, cot_o, tan2, cos_d, cos_i, cot_i: cos_i.map(cot_of) })
    }
}

/// sin2θ over an interval of θ in [0, π/2], from its sines and cosines.
fn twice(sin: Interval, cos: Interval) -> Interval {
    // The smallest θ has the least sine and the largest cosine.
    let ends = [2.0 * sin[0] * cos[1], 2.0 * sin[1] * cos[0]];
    let top =
        if sin[0] <= FRAC_1_SQRT_2 && FRAC_1_SQRT_2 <= sin[1] { 1.0 } else { ends[0].max(ends[1]) };
    [ends[0].min(ends[1]), top]
}

impl LobeRange {
    /// The factors of a lobe over angles.
    #[must_use]
    pub fn new(lobe: &Lobe<Sgd>, ranges: &AngleRanges) -> Self {
        let density = density(lobe, ranges.tan2);
        let g1 = ranges.cot_i.map(|cot| lobe.g1(cot));
        let v = visibility(lobe, ranges);
        Self {
            product: [0, 1].map(|end| FRAC_1_PI * density[end] * g1[end] * v[end]),
            fresnel: lobe.fresnel.map(|fresnel| fresnel.range_over(ranges.cos_d)),
            spread: [density, g1, v].map(log_ratio),
        }
    }
}

/// ln(high/low), infinite where low is 0.
fn log_ratio([low, high]: Interval) -> f64 {
    if low > 0.0 { (high / low).ln() } else { f64::INFINITY }
}

/// D over an interval of tan²θh.
fn density(lobe: &Lobe<Sgd>, tan2: Interval) -> Interval {
    let least = VANISHED * lobe.distribution.peak();
    // The slope density falls with x while cos⁻⁴θ rises: each is bounded by itself.
    let [most, fewest] = tan2.map(|x| lobe.distribution.slope_density(x));
    let [first, last] = tan2.map(|x| (1.0 + x) * (1.0 + x));
    if last.is_finite() {
        [fewest * first, most.max(least) * last]
    } else {
        // Beyond 80 α the slope density falls faster than cos⁴θ.
        [0.0, most.max(least) * first]
    }
}

/// G1(wo)/cosθo over an interval of viewers.
///
/// G1 rises with cotθ; Smith's G1/cotθ falls, as cotθ (1 + Λ) has a positive derivative.
fn visibility(lobe: &Lobe<Sgd>, ranges: &AngleRanges) -> Interval {
    const FARTHEST: f64 = 1e12;
    // The limits at the horizon and at the normal, without 0/0 and ∞/∞.
    let cot = ranges.cot_o.map(|cot| cot.clamp(1.0 / FARTHEST, FARTHEST));
    let g1 = cot.map(|cot| lobe.g1(cot));
    let cos = ranges.cos_o.map(|cos| cos.max(1.0 / FARTHEST));
    // Two bounds, of which the tighter holds: G1/cosθ, and (G1/cotθ)/sinθ near the horizon.
    let by_cos = [g1[0] / cos[1], g1[1] / cos[0]];
    if let Some(fitted) = &lobe.fitted {
        // G1/cosθ = (G1/e)(e/sin e) with the elevation e: the fit need not fall over cotθ.
        let e = cot.map(f64::atan);
        let (ratio, stretch) = (fitted.ratio(e), e.map(|e| e / e.sin()));
        let by_elevation = [ratio[0] * stretch[0], ratio[1] * stretch[1]];
        return [by_cos[0].max(by_elevation[0]), by_cos[1].min(by_elevation[1])];
    }
    let by_sin = [g1[1] / cot[1] / ranges.sin_o[1], g1[0] / cot[0] / ranges.sin_o[0]];
    [by_cos[0].max(by_sin[0]), by_cos[1].min(by_sin[1])]
}

/// cotθ of a cosine in [0, 1].
fn cot_of(cos: f64) -> f64 {
    // 1 − cos² would cancel near the normal.
    cos / ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt()
}
