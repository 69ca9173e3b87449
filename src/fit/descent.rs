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
    // Few of the starts are followed with the fine equations, which cost several times as much.
    let mut found: Vec<Minimum> =
        starts.iter().map(|start| minimise(&rough, start, bounds, ROUGH)).collect();
    found.sort_by(|a, b| a.squares.total_cmp(&b.squares));
    found.truncate(FOLLOWED);
    // The order of the rough minima is not that of the fine ones: several are followed.
    let ends = found.iter().map(|start| further(&fine, &start.x, bounds, FINE));
    let best = ends.min_by(|a, b| a.squares.total_cmp(&b.squares));
    // Without a start, any point of the box will do.
    best.unwrap_or_else(|| further(&fine, &bounds.lower, bounds, FINE))
}

/// Descends again and again from where a descent ends, until that lowers Σ r² by less than ten
/// times `tolerance` of it: a descent that damps its steps much ends early.
pub fn further(
    equations: impl Fn(&DVector<f64>) -> NormalEquations,
    start: &DVector<f64>,
    bounds: &Bounds,
    tolerance: f64,
) -> Minimum {
    const MAX_DESCENTS: usize = 6;
    let mut best = minimise(&equations, start, bounds, tolerance);
    for _ in 0..MAX_DESCENTS {
        // A new descent starts with the small damping that the last one had given up.
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
/// `model` turns unknowns into a model, and `f` evaluates it at the pair of an index.
pub fn by_steps<M>(
    target: &MeasuredTarget,
    x: &DVector<f64>,
    bounds: &Bounds,
    model: impl Fn(&DVector<f64>) -> M,
    f: impl Fn(&M, usize) -> [f64; 3],
) -> NormalEquations {
    // One step serves all unknowns: each is a logarithm or a share, at most of order 1.
    const STEP: f64 = 1e-5;
    // Every moved model is made once; the pairs below only evaluate it.
    let moved: Vec<(f64, M)> = (0..x.len())
        .map(|k| {
            // At the upper bound the step goes down: a model may not exist outside.
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
