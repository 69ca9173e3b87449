//! Descents from several starts, and derivatives by small steps.

use nalgebra::DVector;

use crate::fit::measured_target::MeasuredTarget;
use crate::math::least_squares::{Bounds, Minimum, NormalEquations, minimise};

/// Relative decrease at which a descent ends: to compare starts, and of the best.
const ROUGH: f64 = 3e-3;
const FINE: f64 = 1e-5;
/// Starts that are followed to the end.
const FOLLOWED: usize = 4;

/// The best of the local minima that `starts` lead to: by `rough` equations first, the most
/// promising by `fine` ones.
pub fn lowest(
    rough: impl Fn(&DVector<f64>) -> NormalEquations,
    fine: impl Fn(&DVector<f64>) -> NormalEquations,
    starts: Vec<DVector<f64>>,
    bounds: &Bounds,
) -> Minimum {
    let mut found: Vec<Minimum> =
        starts.iter().map(|start| minimise(&rough, start, bounds, ROUGH)).collect();
    found.sort_by(|a, b| a.squares.total_cmp(&b.squares));
    found.truncate(FOLLOWED);
    let ends = found.iter().map(|start| further(&fine, &start.x, bounds, FINE));
    let best = ends.min_by(|a, b| a.squares.total_cmp(&b.squares));
    best.unwrap_or_else(|| further(&fine, &bounds.lower, bounds, FINE))
}

/// Descends again and again from where a descent ends, until that lowers Σ r² by less than ten
/// times `tolerance` of it: steps damped by a narrow valley end a descent early.
pub fn further(
    equations: impl Fn(&DVector<f64>) -> NormalEquations,
    start: &DVector<f64>,
    bounds: &Bounds,
    tolerance: f64,
) -> Minimum {
    const MOST: usize = 6;
    let mut best = minimise(&equations, start, bounds, tolerance);
    for _ in 0..MOST {
        let next = minimise(&equations, &best.x, bounds, tolerance);
        let gain = best.squares - next.squares;
        best = next;
        if gain <= 10.0 * tolerance * best.squares {
            break;
        }
    }
    best
}

/// The equations of a model whose derivatives are differences over small steps inside `bounds`.
/// `model` makes of unknowns what `f` evaluates at the pair of an index.
pub fn by_steps<M>(
    target: &MeasuredTarget,
    x: &DVector<f64>,
    bounds: &Bounds,
    model: impl Fn(&DVector<f64>) -> M,
    f: impl Fn(&M, usize) -> [f64; 3],
) -> NormalEquations {
    const STEP: f64 = 1e-5;
    let moved: Vec<(f64, M)> = (0..x.len())
        .map(|k| {
            let step = if x[k] + STEP > bounds.upper[k] { -STEP } else { STEP };
            let mut moved = x.clone();
            moved[k] += step;
            (step.recip(), model(&moved))
        })
        .collect();
    let here = model(x);
    target.equations(x.len(), |i, rows| {
        let at = f(&here, i);
        for (row, (per_step, model)) in rows.iter_mut().zip(&moved) {
            let next = f(model, i);
            *row = std::array::from_fn(|c| (next[c] - at[c]) * per_step);
        }
        at
    })
}
