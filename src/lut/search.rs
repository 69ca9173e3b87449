//! The search for the smallest tables that keep a tolerance, and its verification.

use crate::lut::error::BakeError;
use crate::lut::memory;
use crate::lut::request::Depths;
use crate::lut::table::Depth;

/// Sizes are tried in steps of this factor.
const STEP: f64 = 1.09;

/// Tables of one quantity or several whose size is searched.
pub trait Sizable: Sync {
    /// The tables.
    type Tables;
    /// A point at which the tables are held against exact values.
    type Probe;

    /// Shares of the tolerance that a search aims at, in this order; below 1 by what changes between
    /// one set of probes and the next.
    const AIMS: &'static [f64];

    /// The largest growth that textures have room for; `None` if none has.
    fn largest_growth(&self) -> Option<f64>;

    /// The bytes that building these tables takes; 0 where they are few.
    fn bytes(&self, _growth: f64, _depth: Depth) -> usize {
        0
    }

    /// The tables of the expected size times `growth`.
    fn build(&self, growth: f64, depth: Depth) -> Self::Tables;

    /// The largest error of the tables measured at the probes.
    fn measure(&self, tables: &Self::Tables, probes: &[Self::Probe]) -> f64;

    /// The error that the search holds against its aim: measured, or bounded where a bound is known.
    fn bound(&self, tables: &Self::Tables, probes: &[Self::Probe]) -> f64 {
        self.measure(tables, probes)
    }
}

/// The smallest tables that keep `tolerance` at the probes, in the first of the depths that can.
///
/// # Errors
///
/// [`BakeError::NotReached`] with the best error, where the largest tables do not keep it;
/// [`BakeError::Memory`] where there is too little to try.
pub fn smallest<S: Sizable>(
    sizable: &S,
    probes: &[S::Probe],
    tolerance: f64,
    depths: Depths,
) -> Result<S::Tables, BakeError> {
    let mut best = f64::INFINITY;
    let largest = sizable.largest_growth().ok_or(BakeError::NotReached { tolerance, best })?;
    // Every depth is tried with one aim before the next: a margin is worth wider texels.
    for aim in S::AIMS {
        for depth in depths.candidates() {
            let found = least(largest, |growth| {
                // Before each trial, as other programs take memory too.
                memory::check(sizable.bytes(growth, *depth))?;
                let tables = sizable.build(growth, *depth);
                let error = sizable.bound(&tables, probes);
                best = best.min(error);
                Ok((error <= aim * tolerance).then_some(tables))
            })?;
            if let Some(tables) = found {
                return Ok(tables);
            }
        }
    }
    Err(BakeError::NotReached { tolerance, best })
}

/// The result for the smallest growth in steps of [`STEP`], at most `largest`, that `keeps`
/// accepts: first doubled until accepted, then halved in between.
fn least<T, E>(
    largest: f64,
    mut keeps: impl FnMut(f64) -> Result<Option<T>, E>,
) -> Result<Option<T>, E> {
    // A quarter of the expected size counts as refused untried.
    let (mut refused, mut accepted) = (0.25, largest.min(1.0));
    let mut result = keeps(accepted)?;
    while result.is_none() && accepted < largest {
        refused = accepted;
        accepted = (2.0 * accepted).min(largest);
        result = keeps(accepted)?;
    }
    let Some(mut result) = result else { return Ok(None) };
    while accepted / refused > STEP {
        // By factors: the error follows a power of the size.
        let middle = (accepted * refused).sqrt();
        match keeps(middle)? {
            Some(better) => (accepted, result) = (middle, better),
            None => refused = middle,
        }
    }
    Ok(Some(result))
}

/// The judgement of tables at points that their search has not seen.
pub struct Judgement<P> {
    /// The largest error found.
    pub error: f64,
    /// Points at which the tables break their tolerance; none where they keep it.
    pub refuting: Vec<P>,
}

/// The tables that a search finds.
pub struct Verified<T> {
    /// The tables.
    pub tables: T,
    /// The largest error found.
    pub error: f64,
    /// True if no point refutes them. After the last search, tables are taken whose largest error
    /// found is within the tolerance.
    pub unrefuted: bool,
}

/// The tables that a search finds at the probes it has `seen`; probes that refute the tables count
/// in the next search, which is told its number.
///
/// # Errors
///
/// Those of the search, or [`BakeError::NotReached`] after the last one.
pub fn verified<T, P>(
    tolerance: Option<f64>,
    mut seen: Vec<P>,
    search: impl Fn(&[P], usize) -> Result<T, BakeError>,
    judge: impl Fn(&T, &[P], usize) -> Judgement<P>,
) -> Result<Verified<T>, BakeError> {
    const SEARCHES: usize = 4;
    let (mut round, mut kept) = (0, None);
    loop {
        let tables = match search(&seen, round) {
            Ok(tables) => tables,
            // Points that refute a bound may be beyond any size, where a search finds no fault.
            Err(error) => return kept.ok_or(error),
        };
        let Judgement { error, refuting } = judge(&tables, &seen, round);
        round += 1;
        match tolerance {
            Some(tolerance) if !refuting.is_empty() && round < SEARCHES => {
                // No pair found breaks the tolerance: these serve where a later search fails.
                if error <= tolerance {
                    kept = Some(Verified { tables, error, unrefuted: false });
                }
                seen.extend(refuting);
            }
            // After the last search; before it, such an error leads to another.
            Some(tolerance) if error > tolerance => {
                return Err(BakeError::NotReached { tolerance, best: error });
            }
            _ => return Ok(Verified { tables, error, unrefuted: refuting.is_empty() }),
        }
    }
}
