//! The proof of a promise: a bound on the error of f for every pair of directions at once.
//!
//! # Derivation
//!
//! Pairs are boxes of (θo, θh, φ): the viewer, the half vector and the azimuth between them. Over a
//! box every factor of f lies between two values that its monotony gives, and every texture errs by
//! at most the extremes of the cells that the box touches. With D G1(wi) G1(wo) within \[S_low,
//! S_high\] and F within an interval, a lobe's part of |f_lut − f| cosθi is at most
//!
//! ```text
//! (ρs/π) S_high · |F·(g − 1) + ε·g|,   g = (1+δ_D)(1+δ_i)(1+δ_o),
//! ```
//!
//! held against the least that max over wi of |f|cosθi + |f|cosθi can be: the first from a few
//! lights known to be bright, the second from the box itself. A box whose error is within the
//! tolerance is done; another is halved.

use std::collections::HashMap;
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use glam::DVec3;

use crate::brdf::{Lobe, SgdBrdf};
use crate::lut::axis::Warp;
use crate::lut::bend::{Interval, times};
use crate::lut::cell_error::CellErrors;
use crate::lut::row::Rows;
use crate::lut::term::{Term, ndf_scale};
use crate::material::MAX_LOBES;
use crate::math::direction::from_cos_sin;
use crate::microfacet::{Distribution as _, Sgd};

/// D relative to its peak below which an error counts as one of the peak's: see
/// [`crate::lut::cell_error`].
const VANISHED: f64 = 1e-60;
/// Half vectors whose lights tell how much a viewer sees at most.
const LIGHTS: usize = 40;
/// Boxes after which a proof is given up.
const MAX_BOXES: usize = 150_000;
/// Halvings of a box along one side.
const MAX_HALVINGS: u32 = 13;
/// Halvings of the viewers within which one light is the brightest.
const LIGHT_HALVINGS: u32 = 7;
/// tan²θh/α beyond which D is below e^{−80} of its peak and falls on.
const END: f64 = 80.0;

/// The outcome of a proof.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// Every pair of directions keeps the tolerance.
    Kept,
    /// Around this pair, wi and wo, the bound does not, or not within `MAX_BOXES`.
    Broken([DVec3; 2]),
}

/// The largest and least cell errors over any run of cells of a row.
pub struct Extremes {
    /// Of every cell, then of pairs of them, of fours, …; row by row.
    levels: Vec<Vec<[Interval; 3]>>,
    cells_per_row: usize,
}

impl Extremes {
    /// The extremes of a table's cell errors in `rows` rows.
    #[must_use]
    pub fn new(errors: &CellErrors, rows: usize) -> Self {
        let cells_per_row = errors.cells_per_row();
        let cells = (0..rows).flat_map(|row| (0..cells_per_row).map(move |cell| (row, cell)));
        let mut levels: Vec<Vec<[Interval; 3]>> =
            vec![cells.map(|(row, cell)| *errors.of_cell(row, cell)).collect()];
        let mut per_row = cells_per_row;
        while per_row > 1 {
            let below = &levels[levels.len() - 1];
            let halves = per_row.div_ceil(2);
            let pair = |i: usize| {
                let (row, pair) = (i / halves, 2 * (i % halves));
                let left = below[row * per_row + pair];
                if pair + 1 < per_row { hull(left, below[row * per_row + pair + 1]) } else { left }
            };
            let level = (0..rows * halves).map(pair).collect();
            levels.push(level);
            per_row = halves;
        }
        Self { levels, cells_per_row }
    }

    /// The extremes over `u` in an interval.
    fn over(&self, row: usize, u: Interval) -> [Interval; 3] {
        let last = self.cells_per_row - 1;
        let [mut first, mut end] = u.map(|u| ((u * (last + 1) as f64) as usize).min(last));
        end += 1;
        let mut extremes = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        let mut per_row = self.cells_per_row;
        for level in &self.levels {
            let start = row * per_row;
            if first >= end {
                break;
            }
            if first % 2 == 1 {
                extremes = hull(extremes, level[start + first]);
                first += 1;
            }
            if end % 2 == 1 && first < end {
                end -= 1;
                extremes = hull(extremes, level[start + end]);
            }
            (first, end) = (first / 2, end / 2);
            per_row = per_row.div_ceil(2);
        }
        extremes
    }
}

fn hull(a: [Interval; 3], b: [Interval; 3]) -> [Interval; 3] {
    std::array::from_fn(|c| [a[c][0].min(b[c][0]), a[c][1].max(b[c][1])])
}

/// Where the lobes of a material stand in the textures.
#[derive(Clone, Copy, Debug)]
pub struct Places {
    /// Its row of `ndf` and `masking`.
    pub row: usize,
    /// Its row of `fresnel` for each lobe.
    pub fresnel_rows: [usize; MAX_LOBES],
    /// The lobes that are stored.
    pub stored: [bool; MAX_LOBES],
}

impl Places {
    /// The places of the material whose lobes are those of a row.
    #[must_use]
    pub fn new(rows: &Rows, row: usize) -> Self {
        let lobes = &rows.lobes[row];
        let stored = lobes.lobes.each_ref().map(Option::is_some);
        Self { row, fresnel_rows: lobes.fresnel_rows, stored }
    }
}

/// The proof for one material.
pub struct Covering<'a> {
    brdf: &'a SgdBrdf,
    places: Places,
    /// Of `ndf`, `masking` and `fresnel`; a factor without a table is exact.
    errors: [Option<&'a Extremes>; 3],
    warps: &'a [Warp; 3],
    /// s, where masking sets in.
    view_scale: f64,
    /// s and ln(1 + m/s) of tan²θh = s (e^{y} − 1).
    half_scale: f64,
    half_length: f64,
    /// Lights that may be the brightest: tan²θh, and on which side.
    lights: Vec<(f64, f64)>,
}

/// A part of all pairs: the coordinates of viewer, half vector and azimuth in [0, 1] as
/// (numerator, halvings); beyond the end of the half vectors, where the second is `BEYOND`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Part {
    at: [(u32, u32); 3],
    beyond: bool,
}

/// Findings of a proof so far, by intervals of viewers.
#[derive(Default)]
struct Known {
    /// The brightest light for each colour, by intervals of viewers.
    lights: HashMap<(u32, u32), [usize; 3]>,
    /// The least that it gives.
    floors: HashMap<(u32, u32), [f64; 3]>,
}

/// Values that the pairs of a part share.
#[derive(Clone, Copy, Debug)]
struct Ranges {
    cos_o: Interval,
    sin_o: Interval,
    cot_o: Interval,
    tan2: Interval,
    cos_d: Interval,
    cos_i: Interval,
    cot_i: Interval,
}

/// The factors of a lobe over a part.
#[derive(Clone, Copy, Debug, Default)]
struct Factors {
    /// D G1(wi) G1(wo)/(π cosθo).
    product: Interval,
    /// F per colour.
    fresnel: [Interval; 3],
    /// How much D, G1(wi) and G1(wo)/cosθo vary, as logarithms.
    spread: [f64; 3],
}

fn interval(at: (u32, u32)) -> Interval {
    let width = 0.5_f64.powi(at.1 as i32);
    [f64::from(at.0) * width, f64::from(at.0 + 1) * width]
}

fn plus(a: Interval, b: Interval) -> Interval {
    [a[0] + b[0], a[1] + b[1]]
}

/// The least magnitude within an interval.
fn least_magnitude([low, high]: Interval) -> f64 {
    low.max(-high).max(0.0)
}

/// cotθ of a cosine in [0, 1].
fn cot_of(cos: f64) -> f64 {
    cos / ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt()
}

impl<'a> Covering<'a> {
    /// The proof for a material whose lobes stand at `places`.
    #[must_use]
    pub fn new(
        brdf: &'a SgdBrdf,
        rows: &Rows,
        places: Places,
        warps: &'a [Warp; 3],
        errors: [Option<&'a Extremes>; 3],
    ) -> Self {
        let row = &rows.lobes[places.row];
        let widest = brdf.lobes.iter().map(|lobe| lobe.distribution.alpha()).fold(0.0, f64::max);
        let half_scale = ndf_scale(row);
        let half_length = (END * widest / half_scale).ln_1p();
        let light = |k: usize| {
            let y = half_length * k as f64 / LIGHTS as f64;
            half_scale * y.exp_m1()
        };
        let lights = (0..LIGHTS).flat_map(|k| [(light(k), 1.0), (light(k), -1.0)]).collect();
        let view_scale = match &warps[1] {
            Warp::Rational { scale } => scale[places.row],
            _ => 1.0,
        };
        Self { brdf, places, errors, warps, view_scale, half_scale, half_length, lights }
    }

    /// Returns whether every pair of directions keeps `tolerance`.
    #[must_use]
    pub fn verdict(&self, tolerance: f64) -> Verdict {
        let whole = Part { at: [(0, 0); 3], beyond: false };
        let mut parts = vec![whole, Part { beyond: true, ..whole }];
        let mut known = Known::default();
        let mut boxes = 0;
        while let Some(part) = parts.pop() {
            boxes += 1;
            let Some(ranges) = self.ranges(&part) else { continue };
            let floor = self.floor(part.at[0], &mut known);
            let factors = self.factors(&ranges);
            if self.error(&ranges, &factors, floor) <= tolerance {
                continue;
            }
            match self.longest(&part, &ranges, &factors) {
                Some(side) if boxes < MAX_BOXES => parts.extend(halves(part, side)),
                _ => return Verdict::Broken(self.middle(&part)),
            }
        }
        Verdict::Kept
    }

    /// The angles of a part; `None` where no pair of it is above the horizon.
    fn ranges(&self, part: &Part) -> Option<Ranges> {
        let cot_o = self.cot_o(part.at[0]);
        let tan2 = if part.beyond {
            [self.half_scale * self.half_length.exp_m1(), f64::INFINITY]
        } else {
            interval(part.at[1]).map(|y| self.half_scale * (y * self.half_length).exp_m1())
        };
        let [first, last] = interval(part.at[2]).map(|turn| (PI * turn).cos());
        Ranges::new(cot_o, tan2, [last, first])
    }

    /// The pair in the middle of a part.
    fn middle(&self, part: &Part) -> [DVec3; 2] {
        let [q, y, turn] = part.at.map(|at| 0.5 * (interval(at)[0] + interval(at)[1]));
        let cot = self.viewer(q);
        let sin = 1.0 / cot.hypot(1.0);
        let wo = from_cos_sin(cot * sin, sin, 0.0);
        let tan = (self.half_scale * (y * self.half_length).exp_m1()).sqrt();
        let (sin_phi, cos_phi) = (PI * turn).sin_cos();
        let h = DVec3::new(tan * cos_phi, tan * sin_phi, 1.0).normalize();
        [2.0 * wo.dot(h) * h - wo, wo]
    }

    /// The factors of the lobes over a part.
    fn factors(&self, ranges: &Ranges) -> [Factors; MAX_LOBES] {
        let mut factors = [Factors::default(); MAX_LOBES];
        for (slot, lobe) in factors.iter_mut().zip(&self.brdf.lobes) {
            *slot = Factors::new(lobe, ranges);
        }
        factors
    }

    /// |f| cosθi of each colour over a part, at least.
    fn least_reflected(&self, ranges: &Ranges, factors: &[Factors; MAX_LOBES]) -> [f64; 3] {
        std::array::from_fn(|c| {
            let diffuse = ranges.cos_i.map(|cos| self.brdf.rho_d[c] * FRAC_1_PI * cos);
            let lobes = self.brdf.lobes.iter().zip(factors);
            let specular = lobes.map(|(lobe, factors)| {
                times(factors.product, factors.fresnel[c]).map(|f| lobe.rho_s[c] * f)
            });
            least_magnitude(specular.fold(diffuse, plus))
        })
    }

    /// cotθo over an interval of viewers.
    fn cot_o(&self, at: (u32, u32)) -> Interval {
        interval(at).map(|q| self.viewer(q))
    }

    /// cotθo at a coordinate in [0, 1]: evenly in the logarithm of cotθo + s from the horizon to 45°,
    /// evenly in θo from there to the normal.
    fn viewer(&self, q: f64) -> f64 {
        if q <= 0.5 {
            self.view_scale * (2.0 * q * self.view_scale.recip().ln_1p()).exp_m1()
        } else if q < 1.0 {
            1.0 / (FRAC_PI_2 * (1.0 - q)).tan()
        } else {
            f64::INFINITY
        }
    }

    /// |f| cosθi of each colour that a light gives viewers at cotθo, at least.
    fn seen(&self, cot_o: Interval, (tan2, side): (f64, f64)) -> [f64; 3] {
        let ranges = Ranges::new(cot_o, [tan2; 2], [side; 2]);
        ranges.map_or([0.0; 3], |ranges| self.least_reflected(&ranges, &self.factors(&ranges)))
    }

    /// The brightest of the lights for each colour, in the middle of an interval of viewers.
    fn brightest(&self, at: (u32, u32)) -> [usize; 3] {
        let middle = [self.cot_o((2 * at.0 + 1, at.1 + 1))[0]; 2];
        let seen: Vec<[f64; 3]> =
            self.lights.iter().map(|light| self.seen(middle, *light)).collect();
        [0, 1, 2].map(|c| {
            (0..seen.len()).max_by(|i, j| seen[*i][c].total_cmp(&seen[*j][c])).unwrap_or(0)
        })
    }

    /// The least that the brightest light of a viewer gives, over an interval of viewers.
    fn floor(&self, at: (u32, u32), known: &mut Known) -> [f64; 3] {
        if let Some(floor) = known.floors.get(&at) {
            return *floor;
        }
        let coarse = if at.1 > LIGHT_HALVINGS {
            (at.0 >> (at.1 - LIGHT_HALVINGS), LIGHT_HALVINGS)
        } else {
            at
        };
        let lights = *known.lights.entry(coarse).or_insert_with(|| self.brightest(coarse));
        let cot_o = self.cot_o(at);
        let below = |lights: [usize; 3]| -> [f64; 3] {
            std::array::from_fn(|c| self.seen(cot_o, self.lights[lights[c]])[c])
        };
        // What holds for all viewers of an interval holds for those of its halves.
        let whole = if at.1 > 0 { self.floor((at.0 / 2, at.1 - 1), known) } else { [0.0; 3] };
        let of_lights = below(lights);
        let mut floor: [f64; 3] = std::array::from_fn(|c| whole[c].max(of_lights[c]));
        // Where f changes its sign another light is the brightest.
        if at.1 > LIGHT_HALVINGS && (0..3).any(|c| of_lights[c] < 0.7 * whole[c] || floor[c] == 0.0)
        {
            let own = below(self.brightest(at));
            floor = std::array::from_fn(|c| floor[c].max(own[c]));
        }
        known.floors.insert(at, floor);
        floor
    }

    /// The largest error of a colour over a part, relative to its bound.
    fn error(&self, ranges: &Ranges, factors: &[Factors; MAX_LOBES], floor: [f64; 3]) -> f64 {
        let [ndf, masking, _] = self.warps;
        let row = self.places.row;
        let over = |term: usize, row: usize, u: Interval| {
            self.errors[term].map_or([[0.0; 2]; 3], |errors| errors.over(row, u))
        };
        let d = over(0, row, ranges.tan2.map(|x| ndf.coordinate(row, x)));
        let g_i = over(1, row, ranges.cot_i.map(|cot| masking.coordinate(row, cot)));
        let g_o = over(1, row, ranges.cot_o.map(|cot| masking.coordinate(row, cot)));
        let mut off = [[0.0; 2]; 3];
        for (j, (lobe, factors)) in self.brdf.lobes.iter().zip(factors).enumerate() {
            let kept = |k: usize| (1.0 + d[j][k]) * (1.0 + g_i[j][k]) * (1.0 + g_o[j][k]);
            let growth = if self.places.stored[j] { [kept(0), kept(1)] } else { [0.0; 2] };
            let f = over(2, self.places.fresnel_rows[j], ranges.cos_d);
            for c in (0..3).filter(|c| lobe.rho_s[*c] > 0.0) {
                let by_growth = times(factors.fresnel[c], growth.map(|g| g - 1.0));
                let [low, high] = plus(by_growth, times(f[c], growth));
                let most = lobe.rho_s[c] * factors.product[1];
                off[c] = plus(off[c], [most * low.min(0.0), most * high.max(0.0)]);
            }
        }
        let reflected = self.least_reflected(ranges, factors);
        let error = |c: usize| {
            let off = off[c][1].max(-off[c][0]);
            if off > 0.0 { off / (floor[c] + reflected[c]) } else { 0.0 }
        };
        (0..3).map(error).fold(0.0, f64::max)
    }

    /// The side of a part along which its factors vary most; `None` if it is small enough.
    fn longest(
        &self,
        part: &Part,
        ranges: &Ranges,
        factors: &[Factors; MAX_LOBES],
    ) -> Option<usize> {
        /// A variation that counts as all of it.
        const MAX_SPREAD: f64 = 4.0;
        let lobes = &factors[..self.brdf.lobes.len()];
        let spread =
            |k: usize| lobes.iter().map(|f| f.spread[k].min(MAX_SPREAD)).fold(0.0, f64::max);
        let angles = |cos: Interval| cos[0].clamp(0.0, 1.0).acos() - cos[1].clamp(0.0, 1.0).acos();
        let [tan_low, tan_high] = ranges.tan2.map(f64::sqrt);
        let view = angles(ranges.cos_o);
        let half = 2.0 * (tan_high.atan() - tan_low.atan());
        let turn = interval(part.at[2]);
        let azimuth = 2.0 * tan_high.atan().sin() * PI * (turn[1] - turn[0]);
        let light = (spread(1) + angles(ranges.cos_d)) / (view + half + azimuth);
        let scores = [spread(2) + view * (1.0 + light), spread(0) + half * light, azimuth * light];
        let splittable =
            |side: &usize| part.at[*side].1 < MAX_HALVINGS && !(part.beyond && *side == 1);
        let side = (0..3).filter(splittable).max_by(|a, b| scores[*a].total_cmp(&scores[*b]))?;
        /// Where factors vary by less, halving a part changes its bound by less than is of use.
        const SMALLEST: f64 = 1.5e-2;
        (scores[side] > SMALLEST).then_some(side)
    }
}

/// Both halves of a part along a side.
fn halves(part: Part, side: usize) -> [Part; 2] {
    [0, 1].map(|half| {
        let (numerator, halvings) = part.at[side];
        let mut part = part;
        part.at[side] = (2 * numerator + half, halvings + 1);
        part
    })
}

impl Ranges {
    /// The angles of viewers at cotθo, half vectors at tan²θh and the cosine of the azimuth between.
    fn new(cot_o: Interval, tan2: Interval, cos_phi: Interval) -> Option<Self> {
        let sin = |cot: f64| 1.0 / cot.hypot(1.0);
        let cos_o = cot_o.map(|cot| if cot.is_finite() { cot * sin(cot) } else { 1.0 });
        let sin_o = [sin(cot_o[1]), sin(cot_o[0])];
        let cos_h = [tan2[1], tan2[0]].map(|x| 1.0 / (1.0 + x).sqrt());
        let sin_h = tan2.map(|x| if x.is_finite() { (x / (1.0 + x)).sqrt() } else { 1.0 });
        // cosθd = cosθo cosθh + sinθo sinθh cosφ,   cosθi = cosθo cos2θh + sinθo sin2θh cosφ.
        let sin_sin = [sin_o[0] * sin_h[0], sin_o[1] * sin_h[1]];
        let cos_d = plus([cos_o[0] * cos_h[0], cos_o[1] * cos_h[1]], times(sin_sin, cos_phi));
        let cos_2h = cos_h.map(|cos| 2.0 * cos * cos - 1.0);
        let sin_2h = twice(sin_h, cos_h);
        let cos_i = plus(
            times(cos_o, cos_2h),
            times([sin_o[0] * sin_2h[0], sin_o[1] * sin_2h[1]], cos_phi),
        );
        if cos_i[1] <= 0.0 || cos_d[1] <= 0.0 {
            return None;
        }
        let [cos_d, cos_i] = [cos_d, cos_i].map(|cos| cos.map(|cos| cos.clamp(0.0, 1.0)));
        Some(Self { cos_o, sin_o, cot_o, tan2, cos_d, cos_i, cot_i: cos_i.map(cot_of) })
    }
}

/// sin2θ over an interval of θ in [0, π/2], from its sines and cosines.
fn twice(sin: Interval, cos: Interval) -> Interval {
    let ends = [2.0 * sin[0] * cos[1], 2.0 * sin[1] * cos[0]];
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let top = if sin[0] <= half && half <= sin[1] { 1.0 } else { ends[0].max(ends[1]) };
    [ends[0].min(ends[1]), top]
}

impl Factors {
    fn new(lobe: &Lobe<Sgd>, ranges: &Ranges) -> Self {
        let density = density(lobe, ranges.tan2);
        let g1 = ranges.cot_i.map(|cot| lobe.g1(cot));
        let v = visibility(lobe, ranges);
        let product = |k: usize| FRAC_1_PI * density[k] * g1[k] * v[k];
        let log_ratio =
            |[low, high]: Interval| if low > 0.0 { (high / low).ln() } else { f64::INFINITY };
        Self {
            product: [product(0), product(1)],
            fresnel: lobe.fresnel.map(|fresnel| fresnel.range_over(ranges.cos_d)),
            spread: [density, g1, v].map(log_ratio),
        }
    }
}

/// D over an interval of tan²θh.
fn density(lobe: &Lobe<Sgd>, tan2: Interval) -> Interval {
    let least = VANISHED * lobe.distribution.peak();
    let [most, fewest] = tan2.map(|x| lobe.distribution.slope_density(x));
    let squared = |x: f64| (1.0 + x) * (1.0 + x);
    if tan2[1].is_finite() {
        [fewest * squared(tan2[0]), most.max(least) * squared(tan2[1])]
    } else {
        // Beyond 80 α the slope density falls faster than cos⁴θ.
        [0.0, most.max(least) * squared(tan2[0])]
    }
}

/// G1(wo)/cosθo over an interval of viewers.
///
/// G1 rises with cotθ; Smith's G1/cotθ falls, as cotθ (1 + Λ) has a positive derivative.
fn visibility(lobe: &Lobe<Sgd>, ranges: &Ranges) -> Interval {
    const FARTHEST: f64 = 1e12;
    let cot = ranges.cot_o.map(|cot| cot.clamp(1.0 / FARTHEST, FARTHEST));
    let g1 = cot.map(|cot| lobe.g1(cot));
    let cos = ranges.cos_o.map(|cos| cos.max(1.0 / FARTHEST));
    let by_cos = [g1[0] / cos[1], g1[1] / cos[0]];
    if lobe.fitted.is_some() {
        return by_cos;
    }
    let by_sin = [g1[1] / cot[1] / ranges.sin_o[1], g1[0] / cot[0] / ranges.sin_o[0]];
    [by_cos[0].max(by_sin[0]), by_cos[1].min(by_sin[1])]
}

/// The warps of `ndf`, `masking` and `fresnel`.
#[must_use]
pub fn warps(rows: &Rows) -> [Warp; 3] {
    Term::ALL.map(|term| term.warp(rows))
}
