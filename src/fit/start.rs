//! The starts of the descents of an SGD fit.

use nalgebra::{DMatrix, DVector};
use std::f64::consts::FRAC_1_PI;

use crate::fit::fresnel_curve::{COEFFICIENTS, Energy, coefficient_bounds, fresnel_basis};
use crate::fit::measured_target::MeasuredTarget;
use crate::fit::shape::{LogShape, ShapeGrid};
use crate::fit::unknowns::{Colours, LOG_ALPHA, LOG_P, Layout};
use crate::math::least_squares::{Bounds, box_quadratic};

/// Shapes spread over all that are searched, and the best colours of every choice of them.
///
/// With fixed shapes, the error of f times its visibility is linear in the colours: each
/// choice is a small quadratic problem.
pub struct Library {
    shapes: Vec<LogShape>,
    energy: Energy,
    /// The quadratic form of each channel, of all coefficients: ρd, then those of each shape.
    forms: [Form; 3],
}

/// ½ xᵀHx + gᵀx + constant.
struct Form {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    constant: f64,
}

/// The number of widths of the library, spaced evenly in ln α, and its exponents p.
const ALPHAS: usize = 8;
const EXPONENTS: [f64; 4] = [0.1, 0.4, 0.8, 1.4];

impl Library {
    /// The library for a target.
    #[must_use]
    pub fn new(target: &MeasuredTarget, grid: &ShapeGrid, energy: Energy) -> Self {
        let shapes = shapes();
        // Every shape is evaluated once; a choice of shapes only picks rows and columns.
        let values: Vec<Vec<f64>> = shapes.iter().map(|shape| grid.values(*shape)).collect();
        let forms = [0, 1, 2].map(|c| Form::new(target, &values, energy, c));
        Self { shapes, energy, forms }
    }

    /// Up to `most` starts for a layout, best first.
    #[must_use]
    pub fn starts(&self, layout: &Layout, most: usize) -> Vec<DVector<f64>> {
        let choices = match layout.lobes() {
            [Colours::All] => self.distinct((0..self.shapes.len()).map(|i| vec![i]), most),
            [Colours::All, Colours::All] => self.distinct(self.couples(), most),
            _ => self.per_channel(most),
        };
        choices.iter().map(|choice| self.start(layout, choice)).collect()
    }

    fn couples(&self) -> impl Iterator<Item = Vec<usize>> {
        let n = self.shapes.len();
        // The two lobes are alike, so each couple counts once.
        (0..n).flat_map(move |i| (i + 1..n).map(move |j| vec![i, j]))
    }

    /// The best choices, no two of them alike in every shape.
    fn distinct(&self, choices: impl Iterator<Item = Vec<usize>>, most: usize) -> Vec<Vec<usize>> {
        let mut rated: Vec<(f64, Vec<usize>)> =
            choices.map(|choice| (self.error(&choice), choice)).collect();
        rated.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut kept: Vec<Vec<usize>> = Vec::new();
        for (_, choice) in rated {
            // Neighbours mostly lead to the same minimum.
            if kept.len() < most && !kept.iter().any(|other| alike(other, &choice)) {
                kept.push(choice);
            }
        }
        kept
    }

    /// The error that the best colours of these shapes leave.
    fn error(&self, shapes: &[usize]) -> f64 {
        self.forms.iter().map(|form| form.best(shapes, self.energy).1).sum()
    }

    /// The best shapes of each channel by itself: all the best, all the second best, and so on.
    fn per_channel(&self, most: usize) -> Vec<Vec<usize>> {
        let ranked = self.forms.each_ref().map(|form| {
            let mut rated: Vec<(f64, usize)> =
                (0..self.shapes.len()).map(|i| (form.best(&[i], self.energy).1, i)).collect();
            rated.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut kept: Vec<usize> = Vec::new();
            for (_, i) in rated {
                if !kept.iter().any(|other| near(*other, i)) {
                    kept.push(i);
                }
            }
            kept
        });
        // The channels have nothing in common, so their ranks need not be mixed.
        let count = ranked.iter().map(Vec::len).min().unwrap_or(0).min(most);
        (0..count).map(|rank| ranked.iter().map(|kept| kept[rank]).collect()).collect()
    }

    /// The unknowns of a choice of shapes with their best colours.
    fn start(&self, layout: &Layout, choice: &[usize]) -> DVector<f64> {
        let mut x = DVector::zeros(layout.unknowns());
        for (lobe, i) in choice.iter().enumerate() {
            let at = layout.shape(lobe);
            (x[at], x[at + 1]) = (self.shapes[*i].alpha, self.shapes[*i].p);
        }
        for (c, form) in self.forms.iter().enumerate() {
            let lobes: Vec<usize> =
                (0..choice.len()).filter(|lobe| layout.lobes()[*lobe].has(c)).collect();
            let shapes: Vec<usize> = lobes.iter().map(|lobe| choice[*lobe]).collect();
            let (best, _) = form.best(&shapes, self.energy);
            x[c] = best[0];
            for (k, lobe) in lobes.iter().enumerate() {
                let colour = layout.colour(*lobe, c);
                for i in 0..COEFFICIENTS {
                    x[colour + i] = best[1 + COEFFICIENTS * k + i];
                }
            }
        }
        x
    }
}

fn shapes() -> Vec<LogShape> {
    let [low, high] = LOG_ALPHA;
    debug_assert!(EXPONENTS.iter().all(|p| (LOG_P[0]..LOG_P[1]).contains(&p.ln())));
    // At the middles of equal intervals: none starts on a bound.
    let alphas = (0..ALPHAS).map(|i| low + (high - low) * (i as f64 + 0.5) / ALPHAS as f64);
    alphas.flat_map(|alpha| EXPONENTS.map(|p| LogShape { alpha, p: p.ln() })).collect()
}

/// Returns whether two shapes of the library are neighbours or the same.
fn near(a: usize, b: usize) -> bool {
    let n = EXPONENTS.len();
    // A shape's index is that of its width times the number of exponents, plus its exponent's.
    (a / n).abs_diff(b / n) <= 1 && (a % n).abs_diff(b % n) <= 1
}

/// Returns whether two choices have neighbouring shapes, one by one.
fn alike(a: &[usize], b: &[usize]) -> bool {
    a.iter().zip(b).all(|(a, b)| near(*a, *b))
}

impl Form {
    fn new(target: &MeasuredTarget, values: &[Vec<f64>], energy: Energy, channel: usize) -> Self {
        let n = 1 + COEFFICIENTS * values.len();
        let mut rows = DMatrix::zeros(n, target.pairs.len());
        let mut goal = DVector::zeros(target.pairs.len());
        for (i, pair) in target.pairs.iter().enumerate() {
            // Squares of weighted differences in f approximate the objective's ΔE².
            let weight = pair.weight.sqrt() * pair.visibility()[channel];
            let basis = fresnel_basis(energy, pair.cos_theta_d);
            goal[i] = weight * pair.f[channel];
            rows[(0, i)] = weight * FRAC_1_PI;
            for (s, value) in values.iter().enumerate() {
                for k in 0..COEFFICIENTS {
                    rows[(1 + COEFFICIENTS * s + k, i)] = weight * value[i] * basis[k];
                }
            }
        }
        let hessian = &rows * rows.transpose();
        // ½ |Aᵀx − b|² = ½ xᵀAAᵀx − (Ab)ᵀx + ½ |b|².
        Self { gradient: -(&rows * &goal), hessian, constant: 0.5 * goal.norm_squared() }
    }

    /// ρd and the coefficients of the chosen shapes, and the error they leave.
    fn best(&self, shapes: &[usize], energy: Energy) -> (DVector<f64>, f64) {
        let first = shapes.iter().map(|s| 1 + COEFFICIENTS * s);
        let places: Vec<usize> =
            std::iter::once(0).chain(first.flat_map(|first| first..first + COEFFICIENTS)).collect();
        let n = places.len();
        // Neighbouring shapes have nearly the same column: the ridge keeps the matrix definite.
        let mut hessian = DMatrix::from_fn(n, n, |i, j| self.hessian[(places[i], places[j])]);
        let ridge = 1e-10 * hessian.diagonal().max();
        for i in 0..n {
            hessian[(i, i)] = hessian[(i, i)] * (1.0 + 1e-8) + ridge;
        }
        let gradient = DVector::from_fn(n, |i, _| self.gradient[places[i]]);
        let x = box_quadratic(&hessian, &gradient, &bounds(shapes.len(), energy));
        let error = 0.5 * x.dot(&(&hessian * &x)) + gradient.dot(&x) + self.constant;
        (x, error)
    }
}

/// ρd in \[0, 1\] and the coefficients of some shapes.
fn bounds(shapes: usize, energy: Energy) -> Bounds {
    let ranges: Vec<[f64; 2]> = std::iter::once([0.0, 1.0])
        .chain((0..shapes).flat_map(|_| coefficient_bounds(energy)))
        .collect();
    Bounds::of_ranges(&ranges)
}
