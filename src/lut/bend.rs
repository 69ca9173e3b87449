//! Bounds on how a texel bends along its axis: what linear interpolation errs by.

use rayon::prelude::*;
use std::f64::consts::PI;

use crate::brdf::Lobe;
use crate::lut::axis::Warp;
use crate::lut::interval::{Interval, between, hull};
use crate::lut::row::Rows;
use crate::lut::term::Term;
use crate::microfacet::{BeckmannMixture, Distribution as _, Fresnel, Sgd};

/// Pieces of the axis over which d²t/du² is bounded.
const PIECES: usize = 512;

/// Bounds on d²t/du² of every row and texel channel, piece by piece.
#[derive(Clone, Debug, PartialEq)]
pub struct Bends {
    rows: Vec<Vec<[Option<Interval>; 3]>>,
}

impl Bends {
    /// The bounds of a factor.
    #[must_use]
    pub fn new(term: Term, rows: &Rows) -> Self {
        let warp = term.warp(rows);
        let count = term.row_count(rows);
        Self {
            rows: (0..count).into_par_iter().map(|row| pieces(term, rows, row, &warp)).collect(),
        }
    }

    /// Bounds on d²t/du² over `u` in \[from, to\]; `None` where none is known.
    #[must_use]
    pub fn over(&self, row: usize, channel: usize, [from, to]: Interval) -> Option<Interval> {
        // All pieces that the interval touches, and at least one, also at u = 1.
        let first = ((from * PIECES as f64) as usize).min(PIECES - 1);
        let last = ((to * PIECES as f64).ceil() as usize).clamp(first + 1, PIECES);
        let pieces = &self.rows[row][first..last];
        // One piece without a bound leaves the whole without.
        pieces.iter().map(|piece| piece[channel]).reduce(|a, b| Some(hull(a?, b?))).flatten()
    }
}

/// The bounds of a row, piece by piece.
fn pieces(term: Term, rows: &Rows, row: usize, warp: &Warp) -> Vec<[Option<Interval>; 3]> {
    let ends = (0..PIECES).map(|i| [i, i + 1].map(|i| i as f64 / PIECES as f64));
    ends.map(|u| bend(term, rows, row, warp, u)).collect()
}

/// Bounds on d²t/du² of each texel channel over `u` in an interval.
fn bend(term: Term, rows: &Rows, row: usize, warp: &Warp, u: Interval) -> [Option<Interval>; 3] {
    let x = u.map(|u| warp.variable(row, u));
    match (term, warp) {
        (Term::Ndf, Warp::Log1p { scale, max }) => {
            // u = y/length, so d²t/du² = length² d²t/dy².
            let length = (max[row] / scale[row]).ln_1p();
            rows.lobes[row].lobes.each_ref().map(|lobe| {
                lobe.as_ref().map(|lobe| ndf(lobe, scale[row], x).map(|t| t * length * length))
            })
        }
        (Term::Masking, Warp::Rational { scale }) => {
            rows.lobes[row].lobes.each_ref().map(|lobe| match lobe {
                // The published fit has a corner where it sets in: its slope is bounded instead.
                Some(lobe) if lobe.fitted.is_none() => {
                    Some(masking(lobe.distribution.mixture(), scale[row], u, x))
                }
                _ => None,
            })
        }
        (Term::Fresnel, _) => rows.fresnel[row].curves.map(|curve| curve.map(|f| fresnel(&f, x))),
        _ => [None; 3],
    }
}

/// d²t/dy² of t = −x/α − p ln(1 + x/α²) against y = ln(1 + x/s), x in an interval:
///
/// ```text
/// −(x+s)/α − p (α²−s) q(x),   q = (x+s)/(α²+x)²,   q' = 0 at x = α² − 2s
/// ```
fn ndf(lobe: &Lobe<Sgd>, s: f64, [from, to]: Interval) -> Interval {
    let (alpha, p) = (lobe.distribution.alpha(), lobe.distribution.p());
    let alpha2 = alpha * alpha;
    // The one turn of q; outside the interval the clamp makes it an end.
    let turn = (alpha2 - 2.0 * s).clamp(from, to);
    let [at_from, at_to, at_turn] = [from, to, turn].map(|x| power_share(x, s, alpha2));
    let [least, largest] = hull(between(at_from, at_to), [at_turn; 2]);
    // The sign of α² − s decides which of the two is the lower bound.
    let by_power = between(-p * (alpha2 - s) * least, -p * (alpha2 - s) * largest);
    // −(x+s)/α falls with x.
    [-(to + s) / alpha + by_power[0], -(from + s) / alpha + by_power[1]]
}

/// q = (x+s)/(α²+x)².
fn power_share(x: f64, s: f64, alpha2: f64) -> f64 {
    (x + s) / ((alpha2 + x) * (alpha2 + x))
}

/// d²t/du² of t = ln(G1/u) against u, cotθ = c = su/(1−u), of a Beckmann mixture.
///
/// # Derivation
///
/// With a(c) = c/G1 = c (1+Λ): a' = 1 − ½ Σ w erfc(c/α_j) in \[½, 1\], and
/// a'' = Σ w e^{−c²/α_j²}/(α_j √π) ≥ 0. Then t = ln s − ln b, b(u) = (1−u) a(c(u)):
///
/// ```text
/// b' = −a + a' (c+s),   b''/b = a'' (c+s)⁴/(s² a) ≥ 0,   t'' = (b'/b)² − b''/b
/// ```
///
/// a and b' rise with u, and e^{−c²/α²}(c+s)⁴ has one maximum, at c (c+s) = 2α².
fn masking(mixture: &BeckmannMixture, s: f64, u: Interval, c: Interval) -> Interval {
    let [from, to] = c;
    let ends = [(u[0], from), (u[1], to)];
    // At u = 1, a → c → ∞ and (1−u) a → s.
    let b = ends.map(|(u, c)| if u < 1.0 { (1.0 - u) * projected(mixture, c) } else { s });
    let b_slope = c.map(|c| b_slope(mixture, s, c));
    // b is convex: above its tangents, below its chord.
    let width = u[1] - u[0];
    let fall = (b[0] + b_slope[0] * width).min(b[0]).max((b[1] - b_slope[1] * width).min(b[1]));
    // Tangents that fall below 0 tell nothing: b is positive, and its bound may be useless.
    let least_b = if fall > 0.0 { fall } else { f64::MIN_POSITIVE };
    let largest_b = b[0].max(b[1]);
    // b' rises with u, so b'/b lies between the ends' slopes, each over either extreme of b.
    let [left, right] = b_slope.map(|slope| between(slope / least_b, slope / largest_b));
    let [low, high] = hull(left, right);
    let largest_square = low.abs().max(high.abs()).powi(2);
    // The square of an interval that holds 0 begins at 0.
    let least_square =
        if low < 0.0 && high > 0.0 { 0.0 } else { low.abs().min(high.abs()).powi(2) };
    // (b'/b)² − b''/b, with a between its ends since it rises with c.
    let curvature = curvature(mixture, s, c);
    let least_a = projected(mixture, from);
    let largest_a = if to.is_finite() { projected(mixture, to) } else { f64::INFINITY };
    [least_square - curvature[1] / least_a, largest_square - curvature[0] / largest_a]
}

/// a = c (1 + Λ), the projected area over sinθ.
fn projected(mixture: &BeckmannMixture, c: f64) -> f64 {
    // 0 · ∞ at the horizon itself, where a has a finite limit.
    if c > 0.0 { c * (1.0 + mixture.lambda(c)) } else { GRAZING * (1.0 + mixture.lambda(GRAZING)) }
}

/// cotθ that stands for the limit at grazing.
const GRAZING: f64 = 1e-12;

/// a' = 1 − ½ Σ w erfc(c/α).
fn a_slope(mixture: &BeckmannMixture, c: f64) -> f64 {
    let shares = mixture.components().iter().map(|j| 0.5 * j.weight * libm::erfc(c / j.alpha));
    1.0 - shares.sum::<f64>()
}

/// b' = −a + a' (c+s), and its limit s where cotθ is infinite.
fn b_slope(mixture: &BeckmannMixture, s: f64, c: f64) -> f64 {
    // ∞ − ∞ at normal incidence.
    if c.is_finite() { a_slope(mixture, c) * (c + s) - projected(mixture, c) } else { s }
}

/// a'' (c+s)⁴/s² over c in an interval.
fn curvature(mixture: &BeckmannMixture, s: f64, [from, to]: Interval) -> Interval {
    let mut sum = [0.0; 2];
    for j in mixture.components() {
        let scale = j.weight / (j.alpha * PI.sqrt());
        // The positive root of c (c + s) = 2α², the only maximum: the least is at an end.
        let peak = 0.5 * ((s * s + 8.0 * j.alpha * j.alpha).sqrt() - s);
        let [a, b, top] = [from, to, peak.clamp(from, to)].map(|c| bump(c, s, j.alpha));
        sum[0] += scale * a.min(b);
        sum[1] += scale * top;
    }
    sum
}

/// e^{−c²/α²} (c+s)⁴/s².
fn bump(c: f64, s: f64, alpha: f64) -> f64 {
    let a = c / alpha;
    let decay = (-a * a).exp();
    // The power is infinite where the decay has vanished.
    if decay > 0.0 { decay * (c + s).powi(4) / (s * s) } else { 0.0 }
}

/// d²F/dc² = 20 (f90−f0)(1−c)³.
fn fresnel(curve: &Fresnel, c: Interval) -> Interval {
    // (1−c)³ falls with c, and the term in f1 is linear: it does not bend.
    let [a, b] = c.map(|c| 20.0 * (curve.f90 - curve.f0) * (1.0 - c).max(0.0).powi(3));
    between(a, b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{MaskingKind, SgdBrdf};
    use crate::material::catalog;
    use crate::microfacet::Accuracy;

    /// Second differences of the texels themselves lie within the bounds, and the bounds are not
    /// much wider than they need be.
    #[test]
    fn second_differences_are_within_their_bounds() {
        for entry in catalog().iter().step_by(7) {
            let brdf =
                SgdBrdf::with_accuracy(&entry.material, MaskingKind::Exact, Accuracy::Reference);
            let mut rows = Rows::default();
            rows.push("m", &brdf, [true; 3]);
            for term in Term::ALL {
                let (bends, warp) = (Bends::new(term, &rows), term.warp(&rows));
                const STEP: f64 = 1e-3;
                let (mut widest, mut largest): (f64, f64) = (0.0, 0.0);
                for i in 0..700 {
                    let u = 0.002 + 0.996 * f64::from(i) / 700.0;
                    let t = [-STEP, 0.0, STEP].map(|d| term.texel(&rows, 0, &warp, u + d));
                    for c in 0..3 {
                        let [a, b, c_] = t.map(|t| t[c].expect("stored"));
                        if term == Term::Ndf && c_ < -140.0 {
                            continue;
                        }
                        let second = (a - 2.0 * b + c_) / (STEP * STEP);
                        let [low, high] = bends.over(0, c, [u - STEP, u + STEP]).expect("known");
                        let rounding = 1e-8 * (1.0 + b.abs()) + 1e-12 * b.abs() / (STEP * STEP);
                        let name = &entry.material.name;
                        assert!(
                            low - rounding <= second && second <= high + rounding,
                            "{name} {term:?} {c} at {u}: {second} not in {low}..{high}"
                        );
                        widest = widest.max(high - low);
                        largest = largest.max(second.abs());
                    }
                }
                // A constant Fresnel term bends nowhere: both are 0.
                assert!(widest <= 0.3 * largest, "{} {term:?}: {widest}", entry.material.name);
            }
        }
    }
}
