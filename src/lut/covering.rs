//! The proof of a promise: a bound on the error of f for every pair of directions at once.
//!
//! # Derivation
//!
//! Pairs are boxes of (θo, θh, φ): the viewer, the half vector and the azimuth between them. Over a
//! box every factor of f lies between two values that its monotonicity gives, and every texture
//! errs by at most the extremes of the cells that the box touches. With D G1(wi) G1(wo) within
//! \[S_low, S_high\] and F within an interval, a lobe's part of |f_lut − f| cosθi is at most
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

use crate::brdf::SgdBrdf;
use crate::lut::axis::Warp;
use crate::lut::cell_error::growth;
use crate::lut::extremes::Extremes;
use crate::lut::interval::{Interval, least_magnitude, plus, times};
use crate::lut::ranges::{AngleRanges, LobeRange};
use crate::lut::row::Rows;
use crate::lut::term::{Term, ndf_scale};
use crate::material::MAX_LOBES;
use crate::math::direction::at_cot;

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

/// Where the textures hold the lobes of a material.
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
/// (numerator, halvings); or, with `beyond`, the half vectors after the last of those.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Part {
    at: [(u32, u32); 3],
    beyond: bool,
}

impl Part {
    /// Returns whether a side may be halved: not too often, nor where the half vectors have no end.
    fn can_split(&self, side: usize) -> bool {
        self.at[side].1 < MAX_HALVINGS && !(self.beyond && side == 1)
    }
}

/// Findings of a proof so far, by intervals of viewers.
#[derive(Default)]
struct Known {
    /// The brightest light for each colour, by intervals of viewers.
    lights: HashMap<(u32, u32), [usize; 3]>,
    /// The least that it gives.
    floors: HashMap<(u32, u32), [f64; 3]>,
}

/// The coordinates of (numerator, halvings).
fn interval(at: (u32, u32)) -> Interval {
    let width = 0.5_f64.powi(at.1 as i32);
    [f64::from(at.0) * width, f64::from(at.0 + 1) * width]
}

impl<'a> Covering<'a> {
    /// The proof for a material whose lobes are at `places`.
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
        // In the plane of incidence, evenly in y and on both sides. A light that misses the
        // brightest only lowers the floor: the bound stays valid.
        let lights = (0..LIGHTS).flat_map(|k| {
            let y = half_length * k as f64 / LIGHTS as f64;
            [1.0, -1.0].map(|side| (half_scale * y.exp_m1(), side))
        });
        let view_scale = match &warps[1] {
            Warp::Rational { scale } => scale[places.row],
            _ => 1.0,
        };
        let lights = lights.collect();
        Self { brdf, places, errors, warps, view_scale, half_scale, half_length, lights }
    }

    /// Returns whether every pair of directions keeps `tolerance`.
    #[must_use]
    pub fn verdict(&self, tolerance: f64) -> Verdict {
        let whole = Part { at: [(0, 0); 3], beyond: false };
        // A stack: a part is halved until done, so that few parts wait at a time.
        let mut parts = vec![whole, Part { beyond: true, ..whole }];
        let mut known = Known::default();
        let mut boxes = 0;
        while let Some(part) = parts.pop() {
            boxes += 1;
            // Below the horizon there is nothing to keep.
            let Some(ranges) = self.ranges(&part) else { continue };
            let floor = self.floor(part.at[0], &mut known);
            let factors = self.factors(&ranges);
            if self.error(&ranges, &factors, floor) <= tolerance {
                continue;
            }
            match self.longest(&part, &ranges, &factors) {
                Some(side) if boxes < MAX_BOXES => parts.extend(halves(part, side)),
                // The caller makes a probe of the pair, which the next search has to satisfy.
                _ => return Verdict::Broken(self.middle(&part)),
            }
        }
        Verdict::Kept
    }

    /// The angles of a part; `None` where no pair of it is above the horizon.
    fn ranges(&self, part: &Part) -> Option<AngleRanges> {
        let cot_o = self.cot_o(part.at[0]);
        let tan2 = if part.beyond {
            [self.half_scale * self.half_length.exp_m1(), f64::INFINITY]
        } else {
            interval(part.at[1]).map(|y| self.half_scale * (y * self.half_length).exp_m1())
        };
        // Half a turn: an isotropic f is even in the azimuth. Its cosine falls, so the ends swap.
        let [first, last] = interval(part.at[2]).map(|turn| (PI * turn).cos());
        AngleRanges::new(cot_o, tan2, [last, first])
    }

    /// The pair in the middle of a part.
    fn middle(&self, part: &Part) -> [DVec3; 2] {
        let [q, y, turn] = part.at.map(|at| 0.5 * (interval(at)[0] + interval(at)[1]));
        let wo = at_cot(self.viewer(q));
        let tan = (self.half_scale * (y * self.half_length).exp_m1()).sqrt();
        let (sin_phi, cos_phi) = (PI * turn).sin_cos();
        let h = DVec3::new(tan * cos_phi, tan * sin_phi, 1.0).normalize();
        [2.0 * wo.dot(h) * h - wo, wo]
    }

    /// The factors of the lobes over a part.
    fn factors(&self, ranges: &AngleRanges) -> [LobeRange; MAX_LOBES] {
        let mut factors = [LobeRange::default(); MAX_LOBES];
        for (slot, lobe) in factors.iter_mut().zip(&self.brdf.lobes) {
            *slot = LobeRange::new(lobe, ranges);
        }
        factors
    }

    /// |f| cosθi of each colour over a part, at least.
    fn least_reflected(&self, ranges: &AngleRanges, factors: &[LobeRange; MAX_LOBES]) -> [f64; 3] {
        std::array::from_fn(|c| {
            let diffuse = ranges.cos_i.map(|cos| self.brdf.rho_d[c] * FRAC_1_PI * cos);
            let lobes = self.brdf.lobes.iter().zip(factors);
            let specular = lobes.map(|(lobe, factors)| {
                times(factors.product, factors.fresnel[c]).map(|f| lobe.rho_s[c] * f)
            });
            // F may be negative, so lobes may cancel: signs are kept in the sum.
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
        let ranges = AngleRanges::new(cot_o, [tan2; 2], [side; 2]);
        ranges.map_or([0.0; 3], |ranges| self.least_reflected(&ranges, &self.factors(&ranges)))
    }

    /// The same of one light for each colour.
    fn seen_of(&self, cot_o: Interval, lights: [usize; 3]) -> [f64; 3] {
        [0, 1, 2].map(|c| self.seen(cot_o, self.lights[lights[c]])[c])
    }

    /// The brightest of the lights for each colour, in the middle of an interval of viewers.
    fn brightest(&self, at: (u32, u32)) -> [usize; 3] {
        // The lower end of the right half.
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
        // Finer intervals keep the light of the coarse one they lie in: a choice evaluates every
        // light.
        let coarse = if at.1 > LIGHT_HALVINGS {
            (at.0 >> (at.1 - LIGHT_HALVINGS), LIGHT_HALVINGS)
        } else {
            at
        };
        let lights = *known.lights.entry(coarse).or_insert_with(|| self.brightest(coarse));
        let cot_o = self.cot_o(at);
        // What holds for all viewers of an interval holds for those of its halves.
        let whole = if at.1 > 0 { self.floor((at.0 / 2, at.1 - 1), known) } else { [0.0; 3] };
        let of_lights = self.seen_of(cot_o, lights);
        let mut floor: [f64; 3] = std::array::from_fn(|c| whole[c].max(of_lights[c]));
        // Where f changes its sign another light is the brightest; the coarse one could leave a
        // floor of 0.
        if at.1 > LIGHT_HALVINGS && (0..3).any(|c| of_lights[c] < 0.7 * whole[c] || floor[c] == 0.0)
        {
            let own = self.seen_of(cot_o, self.brightest(at));
            floor = std::array::from_fn(|c| floor[c].max(own[c]));
        }
        known.floors.insert(at, floor);
        floor
    }

    /// The largest error of a colour over a part, relative to its bound.
    fn error(
        &self,
        ranges: &AngleRanges,
        factors: &[LobeRange; MAX_LOBES],
        floor: [f64; 3],
    ) -> f64 {
        let [ndf, masking, _] = self.warps;
        let row = self.places.row;
        let d = self.errors_over(0, row, ranges.tan2.map(|x| ndf.coordinate(row, x)));
        let g_i = self.errors_over(1, row, ranges.cot_i.map(|cot| masking.coordinate(row, cot)));
        let g_o = self.errors_over(1, row, ranges.cot_o.map(|cot| masking.coordinate(row, cot)));
        // The interval of f_lut − f: errors of opposite sign do not add up.
        let mut off = [[0.0; 2]; 3];
        for (j, (lobe, factors)) in self.brdf.lobes.iter().zip(factors).enumerate() {
            let growth =
                // A lobe that is left out has g = 0: all of it is missing.
                if self.places.stored[j] { growth([d[j], g_i[j], g_o[j]]) } else { [0.0; 2] };
            let f = self.errors_over(2, self.places.fresnel_rows[j], ranges.cos_d);
            // In other colours `fresnel` holds another lobe's curve, or none.
            for c in (0..3).filter(|c| lobe.rho_s[*c] > 0.0) {
                let by_growth = times(factors.fresnel[c], growth.map(|g| g - 1.0));
                let [low, high] = plus(by_growth, times(f[c], growth));
                // D G1 G1 may lie far below its upper end: the interval is widened to hold 0.
                let most = lobe.rho_s[c] * factors.product[1];
                off[c] = plus(off[c], [most * low.min(0.0), most * high.max(0.0)]);
            }
        }
        let reflected = self.least_reflected(ranges, factors);
        let mut error: f64 = 0.0;
        for c in 0..3 {
            let off = off[c][1].max(-off[c][0]);
            // Where nothing is off, both may be 0.
            error = error.max(if off > 0.0 { off / (floor[c] + reflected[c]) } else { 0.0 });
        }
        error
    }

    /// The extremes of a factor's errors over coordinates of a row; 0 where it has no table.
    fn errors_over(&self, term: usize, row: usize, u: Interval) -> [Interval; 3] {
        self.errors[term].map_or([[0.0; 2]; 3], |errors| errors.over(row, u))
    }

    /// The side of a part along which its factors vary most; `None` if it is small enough.
    fn longest(
        &self,
        part: &Part,
        ranges: &AngleRanges,
        factors: &[LobeRange; MAX_LOBES],
    ) -> Option<usize> {
        /// A variation that counts as all of it.
        const MAX_SPREAD: f64 = 4.0;
        let lobes = &factors[..self.brdf.lobes.len()];
        let [of_d, of_light, of_view] = [0, 1, 2]
            .map(|k| lobes.iter().map(|f| f.spread[k].min(MAX_SPREAD)).fold(0.0, f64::max));
        let [tan_low, tan_high] = ranges.tan2.map(f64::sqrt);
        let view = angle_between(ranges.cos_o);
        // wi = 2 (wo·h) h − wo turns twice as far as h, about the normal as well.
        let half = 2.0 * (tan_high.atan() - tan_low.atan());
        let turn = interval(part.at[2]);
        let azimuth = 2.0 * tan_high.atan().sin() * PI * (turn[1] - turn[0]);
        // G1(wi) and F vary with the light, which every side turns: per radian of all three.
        let light = (of_light + angle_between(ranges.cos_d)) / (view + half + azimuth);
        let scores = [of_view + view * (1.0 + light), of_d + half * light, azimuth * light];
        // The logarithm of a factor and an angle in radians count alike.
        let sides = (0..3).filter(|side| part.can_split(*side));
        let side = sides.max_by(|a, b| scores[*a].total_cmp(&scores[*b]))?;
        /// Where factors vary by less, halving a part changes its bound by less than is of use.
        const SMALLEST: f64 = 1.5e-2;
        (scores[side] > SMALLEST).then_some(side)
    }
}

/// The angle between two directions in a plane, from their cosines.
fn angle_between(cos: Interval) -> f64 {
    // Rounding may leave [0, 1], where acos is NaN.
    cos[0].clamp(0.0, 1.0).acos() - cos[1].clamp(0.0, 1.0).acos()
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

/// The warps of `ndf`, `masking` and `fresnel`.
#[must_use]
pub fn warps(rows: &Rows) -> [Warp; 3] {
    Term::ALL.map(|term| term.warp(rows))
}
