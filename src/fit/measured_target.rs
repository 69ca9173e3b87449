//! The aim of a fit to a measurement: the measured colour of a ball under suns, and of pairs of
//! directions about the mirror direction.

use std::f64::consts::PI;

use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use crate::brdf::Reflectance;
use crate::fit::colour::{Ellipsoid, Lab, ellipsoid};
use crate::fit::target::pair;
use crate::math::direction::{cot_theta, tan2_theta};
use crate::math::least_squares::NormalEquations;
use crate::math::quadrature::{Node, gauss_legendre};

/// A measured pair of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredPair {
    /// Direction to the light.
    pub wi: DVec3,
    /// Direction to the viewer.
    pub wo: DVec3,
    /// tan²θh.
    pub tan2_theta_h: f64,
    /// cosθd = wi·h.
    pub cos_theta_d: f64,
    /// cosθi, cosθo.
    pub cos_theta: [f64; 2],
    /// cotθi, cotθo.
    pub cot_theta: [f64; 2],
    /// The measured reflectance \[1/sr\].
    pub f: [f64; 3],
    /// π cosθi: the radiance of f = 1 relative to white.
    pub white: f64,
    /// The pair's share; those of all pairs sum to 1.
    pub weight: f64,
    /// Whether it is a pixel of the ball.
    pub in_picture: bool,
    /// The measured colour in CIELAB.
    goal: [f64; 3],
    /// ΔE2000 about it.
    ellipsoid: Ellipsoid,
}

/// The measured pairs that a fit aims at.
///
/// A fit lowers the mean of √(ΔE² + [`SOFT`]²) over them: ΔE is that of ΔE2000's ellipsoid about
/// the measured colour, between the radiances π f cosθi relative to white, with highlights
/// compressed above white. The mean of ΔE, not of its square, so that pairs which the model cannot
/// follow, or which were measured badly, do not pull at all others.
///
/// # Example
///
/// ```
/// use sgdbake::{MaskingKind, MeasuredTarget, SgdBrdf, named};
///
/// // Any reflectance: a measurement, or here a published fit.
/// let brdf = SgdBrdf::new(named("gold-paint")?, MaskingKind::Fitted);
/// let target = MeasuredTarget::of(&brdf)?;
/// assert!(target.typical().iter().all(|f| *f > 0.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct MeasuredTarget {
    /// The pairs that were measured.
    pub pairs: Vec<MeasuredPair>,
    /// The ΔE up to which an error counts by its square.
    soft: f64,
}

/// Nothing was measured at any pair that a fit looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "nothing to fit: the measurement has no valid value at any pair of directions that a fit looks at"
)]
pub struct NothingMeasured;

/// Suns that light the ball, in degrees from the viewer. None is within 2° of the suns by which
/// fits are judged.
const SUNS: [f64; 12] =
    [3.0, 18.0, 32.0, 46.0, 61.0, 76.0, 90.0, 104.0, 119.0, 133.0, 148.0, 162.0];
/// Pixels across the ball.
const BALL: usize = 20;
/// Squared radius of the ball that counts: the rim is less than a pixel wide.
const RIM: f64 = 0.94;
/// cosθi below which a pixel of the ball is dark.
const LIT: f64 = 0.05;

/// The share of the pairs about the mirror direction.
const HIGHLIGHT_SHARE: f64 = 0.06;
/// tan²θh at which the logarithmic spacing of their nodes sets in, (0.2°)², and the largest, 40°.
const FINEST: f64 = 1.2e-5;
const WIDEST: f64 = 0.7;
/// Nodes in θh, θd and φd.
const HIGHLIGHT_NODES: [usize; 3] = [16, 5, 2];
/// Share of the largest θd, 90° at the mirror direction, over which the nodes are spread. The last
/// is then 79°: measurements beyond 80° are mostly noise, and where no node holds a narrow lobe it
/// may come out ten times too bright.
const DIFFERENCE_RANGE: f64 = 0.925;

/// The ΔE up to which an error counts by its square.
pub const SOFT: f64 = 0.15;

impl MeasuredTarget {
    /// The target of a reflectance, the pairs left out where it is NaN.
    ///
    /// # Errors
    ///
    /// [`NothingMeasured`]: no pair is left.
    pub fn of(reflectance: &dyn Reflectance) -> Result<Self, NothingMeasured> {
        let mut pairs = ball();
        pairs.extend(highlight());
        let mut values = vec![[0.0; 3]; pairs.len()];
        let directions: Vec<[DVec3; 2]> = pairs.iter().map(|pair| [pair.wi, pair.wo]).collect();
        reflectance.eval_all(&directions, &mut values);
        for (pair, f) in pairs.iter_mut().zip(values) {
            let goal = Lab::of_radiance(f.map(|f| f * pair.white)).value;
            (pair.f, pair.goal, pair.ellipsoid) = (f, goal, ellipsoid(goal));
        }
        // Not measured (NaN): the shares of all others grow, so that a gap pulls nowhere.
        pairs.retain(|pair| pair.f.iter().all(|f| f.is_finite()));
        share_out(&mut pairs);
        if pairs.is_empty() { Err(NothingMeasured) } else { Ok(Self { pairs, soft: SOFT }) }
    }

    /// One of every `step` pairs, to compare starts on, and errors below a ΔE of 1 by their square:
    /// it has fewer local minima.
    #[must_use]
    pub fn thinned(&self, step: usize) -> Self {
        let mut pairs: Vec<MeasuredPair> =
            self.pairs.iter().step_by(step.max(1)).copied().collect();
        share_out(&mut pairs);
        Self { pairs, soft: 1.0 }
    }

    /// A value of f, channel by channel, that three in ten of the pairs stay below: where the
    /// highlight is not.
    #[must_use]
    pub fn typical(&self) -> [f64; 3] {
        std::array::from_fn(|c| {
            let mut values: Vec<f64> = self.pairs.iter().map(|pair| pair.f[c]).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() * 3 / 10).copied().unwrap_or(0.0)
        })
    }

    /// The mean ΔE of a model over the pixels of the ball.
    #[must_use]
    pub fn picture_difference(&self, f: impl Fn(usize) -> [f64; 3]) -> f64 {
        let seen = self.pairs.iter().enumerate().filter(|(_, pair)| pair.in_picture);
        let [sum, count] = seen
            .fold([0.0, 0.0], |[sum, count], (i, pair)| [sum + pair.difference(f(i)), count + 1.0]);
        if count > 0.0 { sum / count } else { 0.0 }
    }

    /// The normal equations of a model of `unknowns` unknowns. `at` gives f at the pair of an
    /// index, and its derivative by each unknown, where that is not 0.
    pub fn equations(
        &self,
        unknowns: usize,
        at: impl FnMut(usize, &mut [[f64; 3]]) -> [f64; 3],
    ) -> NormalEquations {
        let mut sums = Sums::none(unknowns, self.soft);
        self.visit(unknowns, at, |weight, error, slopes| sums.add(weight, error, slopes));
        sums.finish()
    }

    /// Σ ψψᵀ over the pairs, ψ the gradient of a pair's share of the objective: what the errors of
    /// single pairs do to the solution. Then the matrix of [`Self::equations`] less the objective's
    /// second derivatives, which are smaller, as errors beyond the soft ones count by their
    /// absolute value.
    pub fn scatter(
        &self,
        unknowns: usize,
        at: impl FnMut(usize, &mut [[f64; 3]]) -> [f64; 3],
    ) -> [DMatrix<f64>; 2] {
        let mut scatter = DMatrix::zeros(unknowns, unknowns);
        let mut flatness = DMatrix::zeros(unknowns, unknowns);
        self.visit(unknowns, at, |weight, e, slopes| {
            let gradient = DVector::from_fn(unknowns, |i, _| {
                slopes[0][i] * e[0] + slopes[1][i] * e[1] + slopes[2][i] * e[2]
            });
            let root = softness(e, self.soft);
            // q = √(1 + |e|²/c²): ψ = (w/q) Jᵀe, its derivative (w/q) JᵀJ − (w/(c²q³)) Jᵀe eᵀJ.
            scatter.ger((weight / root).powi(2), &gradient, &gradient, 1.0);
            let flat = weight / (self.soft * self.soft * root.powi(3));
            flatness.ger(flat, &gradient, &gradient, 1.0);
        });
        [scatter, flatness]
    }

    /// Hands each pair's weight, its three errors and their derivatives to `each`.
    fn visit(
        &self,
        unknowns: usize,
        mut at: impl FnMut(usize, &mut [[f64; 3]]) -> [f64; 3],
        mut each: impl FnMut(f64, [f64; 3], &[Vec<f64>; 3]),
    ) {
        let mut rows = vec![[0.0; 3]; unknowns];
        let mut slopes = [(); 3].map(|()| vec![0.0; unknowns]);
        for (i, pair) in self.pairs.iter().enumerate() {
            // A model sets only the derivatives that are not 0.
            rows.fill([0.0; 3]);
            let f = at(i, &mut rows);
            let (error, by_f) = pair.error(f);
            for (slopes, by_f) in slopes.iter_mut().zip(by_f) {
                for (slope, row) in slopes.iter_mut().zip(&rows) {
                    *slope = by_f[0] * row[0] + by_f[1] * row[1] + by_f[2] * row[2];
                }
            }
            each(pair.weight, error, &slopes);
        }
    }
}

impl MeasuredPair {
    fn new(wi: DVec3, wo: DVec3, weight: f64, in_picture: bool) -> Self {
        let h = wi + wo;
        Self {
            wi,
            wo,
            tan2_theta_h: tan2_theta(h),
            // |wi + wo|/2: symmetric to the last bit, but rounding may take it beyond 1.
            cos_theta_d: (0.5 * h.length()).min(1.0),
            cos_theta: [wi.z, wo.z],
            cot_theta: [cot_theta(wi), cot_theta(wo)],
            white: PI * wi.z,
            f: [0.0; 3],
            weight,
            in_picture,
            goal: [0.0; 3],
            ellipsoid: [[0.0; 3]; 3],
        }
    }

    /// E ΔLab of a model's f, and its derivative by f.
    fn error(&self, f: [f64; 3]) -> ([f64; 3], Ellipsoid) {
        let lab = Lab::of_radiance(f.map(|f| f * self.white));
        let off: [f64; 3] = std::array::from_fn(|k| lab.value[k] - self.goal[k]);
        let slope = self.ellipsoid.map(|row| -> [f64; 3] {
            std::array::from_fn(|c| {
                self.white * (0..3).map(|k| row[k] * lab.slope[k][c]).sum::<f64>()
            })
        });
        (times(&self.ellipsoid, off), slope)
    }

    /// |E ΔLab| of a model's f.
    #[must_use]
    pub fn difference(&self, f: [f64; 3]) -> f64 {
        self.error(f).0.iter().map(|e| e * e).sum::<f64>().sqrt()
    }

    /// |∂(E Lab)/∂f| per channel at the measured value: how much a difference in f shows.
    #[must_use]
    pub fn visibility(&self) -> [f64; 3] {
        let slope = self.error(self.f).1;
        std::array::from_fn(|c| slope.iter().map(|row| row[c] * row[c]).sum::<f64>().sqrt())
    }
}

/// The product of a matrix and a vector.
fn times(matrix: &Ellipsoid, v: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// √(1 + |e|²/c²).
fn softness(e: [f64; 3], soft: f64) -> f64 {
    (1.0 + (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]) / (soft * soft)).sqrt()
}

/// The normal equations of Σ weight · ρ(|e|²), ρ(s) = 2 c² (√(1 + s/c²) − 1) a square up to c, an
/// absolute value beyond.
struct Sums {
    soft: f64,
    squares: f64,
    gradient: Vec<f64>,
    /// The lower triangle, row by row.
    hessian: Vec<f64>,
}

impl Sums {
    fn none(unknowns: usize, soft: f64) -> Self {
        let triangle = unknowns * (unknowns + 1) / 2;
        Self { soft, squares: 0.0, gradient: vec![0.0; unknowns], hessian: vec![0.0; triangle] }
    }

    fn add(&mut self, weight: f64, e: [f64; 3], slopes: &[Vec<f64>; 3]) {
        let root = softness(e, self.soft);
        self.squares += weight * 2.0 * self.soft * self.soft * (root - 1.0);
        // Iteratively reweighted least squares: only the direction of a large error pulls.
        let pull = weight / root;
        let [a, b, c] = slopes.each_ref().map(Vec::as_slice);
        let mut triangle = self.hessian.as_mut_slice();
        for i in 0..a.len() {
            let by = [a[i], b[i], c[i]].map(|slope| pull * slope);
            self.gradient[i] += by[0] * e[0] + by[1] * e[1] + by[2] * e[2];
            let (row, rest) = triangle.split_at_mut(i + 1);
            triangle = rest;
            for (((sum, a), b), c) in row.iter_mut().zip(a).zip(b).zip(c) {
                *sum += by[0] * a + by[1] * b + by[2] * c;
            }
        }
    }

    fn finish(self) -> NormalEquations {
        let n = self.gradient.len();
        NormalEquations {
            squares: self.squares,
            hessian: DMatrix::from_fn(n, n, |i, j| self.hessian[triangle_index(i, j)]),
            gradient: DVector::from_vec(self.gradient),
        }
    }
}

/// The index of the entries (i, j) and (j, i) of a symmetric matrix in its lower triangle.
fn triangle_index(i: usize, j: usize) -> usize {
    let (row, column) = (i.max(j), i.min(j));
    row * (row + 1) / 2 + column
}

/// The centre of a pixel's row or column on the ball of radius 1.
fn pixel_centre(i: usize) -> f64 {
    2.0 * (i as f64 + 0.5) / BALL as f64 - 1.0
}

/// The lit pixels of the ball under each sun; half of it, as the other half is its mirror image.
fn ball() -> Vec<MeasuredPair> {
    let mut pairs = Vec::new();
    // An isotropic reflectance is the same on both sides of the plane of light and view.
    for sun in SUNS.map(f64::to_radians) {
        let light = DVec3::new(sun.sin(), 0.0, sun.cos());
        for (column, row) in (BALL / 2..BALL).flat_map(|row| (0..BALL).map(move |c| (c, row))) {
            let (x, y) = (pixel_centre(column), pixel_centre(row));
            let r2 = x * x + y * y;
            if r2 >= RIM {
                continue;
            }
            let normal = DVec3::new(x, y, (1.0 - r2).sqrt());
            if normal.dot(light) > LIT {
                // The axes of the surface: an isotropic reflectance does not depend on the tangent.
                // The vector points beyond RIM, so that no pixel's normal is parallel to it.
                let t = normal.cross(DVec3::new(0.3, 0.9, 0.1)).normalize();
                let b = normal.cross(t);
                let [wi, wo] =
                    [light, DVec3::Z].map(|w| DVec3::new(t.dot(w), b.dot(w), normal.dot(w)));
                pairs.push(MeasuredPair::new(wi, wo, 1.0, true));
            }
        }
    }
    pairs
}

/// Pairs about the mirror direction, evenly spaced by the logarithm of the half vector's slope: a
/// lobe narrower than a pixel shows in them.
fn highlight() -> Vec<MeasuredPair> {
    let [polar, difference, azimuth] = HIGHLIGHT_NODES.map(gauss_legendre);
    let length = (WIDEST / FINEST).ln_1p();
    let mut pairs = Vec::new();
    for theta_h in &polar {
        let tan2_theta_h = FINEST * (theta_h.x * length).exp_m1();
        for theta_d in &difference {
            for phi_d in &azimuth {
                // Weights even in ln tan²θh and not by solid angle: all widths count alike.
                let node = Node { x: DIFFERENCE_RANGE * theta_d.x, weight: 1.0 };
                if let Some(found) = pair(tan2_theta_h, 1.0, node, phi_d.x * 0.5 * PI) {
                    let weight = theta_h.weight * theta_d.weight * phi_d.weight;
                    pairs.push(MeasuredPair::new(found.wi, found.wo, weight, false));
                }
            }
        }
    }
    pairs
}

/// Scales the weights: the highlight's pairs have [`HIGHLIGHT_SHARE`] of the sum, which is 1.
fn share_out(pairs: &mut [MeasuredPair]) {
    let [picture, highlight] = [true, false].map(|in_picture| -> f64 {
        pairs.iter().filter(|pair| pair.in_picture == in_picture).map(|pair| pair.weight).sum()
    });
    // If one kind was not measured at all, the other has the whole sum.
    let share = match (picture > 0.0, highlight > 0.0) {
        (true, true) => HIGHLIGHT_SHARE,
        (false, _) => 1.0,
        (true, false) => 0.0,
    };
    for pair in pairs {
        // A kind without pairs divides by 0, but then none of its pairs asks for the scale.
        let scale = if pair.in_picture { (1.0 - share) / picture } else { share / highlight };
        pair.weight *= scale;
    }
}
