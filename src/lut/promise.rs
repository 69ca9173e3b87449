//! The promise of a tolerance: the search for tables that keep it, and its verification at pairs of
//! directions that the search has not seen.

use rayon::prelude::*;

use crate::brdf::SgdBrdf;
use crate::lut::bend::Bends;
use crate::lut::covering::{Covering, Places, Verdict, warps};
use crate::lut::error::BakeError;
use crate::lut::extremes::Extremes;
use crate::lut::factors::{Attack, Factors, Subject, attacked, cell_errors, measure};
use crate::lut::probe::{Probe, crossings, probes, probes_of_pair};
use crate::lut::range::VOLUME_WIDTHS;
use crate::lut::request::{Extent, Request};
use crate::lut::row::{Placed, Row, Rows};
use crate::lut::sampled::Sampled;
use crate::lut::search::{Judgement, Verified, smallest, verified};
use crate::lut::table::{ErrorNote, Filter, Proof, Table};
use crate::lut::term::Term;
use crate::lut::volume::{self, Volume};

/// The first seed of the longer searches, whose result is stated: far above those of the other
/// searches, so that no probe is met twice.
const SEARCHED: usize = 101;

/// The share of the tolerance that a search may find before it counts as broken, where no bound is
/// known: another search may find more.
const SAMPLED_SHARE: f64 = 0.92;

/// A table with its errors: by the texture units that the promise covers, and by those that cut
/// weights down; 0 where that was not measured.
pub(super) fn noted(
    table: Table,
    request: &Request,
    [measured, truncated]: [f64; 2],
    proof: Proof,
) -> Table {
    let proof = request.tolerance().map(|_| proof);
    let error = ErrorNote {
        tolerance: request.tolerance(),
        measured: Some(measured),
        measured_truncated: (truncated > 0.0).then_some(truncated),
        proof,
    };
    Table { error, ..table }
}

/// The 3D table of a row, verified for every material that uses it.
pub(super) fn fill_volume(
    rows: &Rows,
    row: usize,
    placed: &[Placed],
    sampled: &[Sampled<'_>],
    request: &Request,
) -> Result<Table, BakeError> {
    // Materials that share a row differ in ρd and Σρs, which the bound of an error depends on.
    let users = sampled.iter().zip(placed).filter(|(_, placed)| placed.row == Some(row));
    let promise = VolumePromise {
        row: &rows.lobes[row],
        index: row,
        users: users.map(|(sampled, _)| sampled).collect(),
        request,
    };
    let seen: Vec<Probe> = promise.users.iter().flat_map(|user| user.probes.clone()).collect();
    let verified = verified(
        request.tolerance(),
        seen,
        |seen, _| promise.search(seen),
        |table, seen, round| promise.judge(table, seen, round),
    )?;
    Ok(noted(verified.tables, request, [verified.error, 0.0], Proof::Sampled))
}

/// The promise of a row's 3D table to every material that uses it.
struct VolumePromise<'a> {
    row: &'a Row,
    index: usize,
    users: Vec<&'a Sampled<'a>>,
    request: &'a Request,
}

impl VolumePromise<'_> {
    /// The table of the size asked for, or the smallest that keeps the tolerance at the probes.
    fn search(&self, seen: &[Probe]) -> Result<Table, BakeError> {
        let Self { row, index, request, .. } = *self;
        match request.extent {
            Extent::Size(n) if !VOLUME_WIDTHS.contains(&n) => Err(BakeError::Volume { found: n }),
            Extent::Size(n) => {
                Ok(volume::tabulate(row, index, [n; 3], request.depths.candidates()[0]))
            }
            Extent::Tolerance(e) => {
                smallest(&Volume::new(row, index, seen, e), seen, e, request.depths)
            }
        }
    }

    /// The largest error at probes seen, unseen, and climbed to from either.
    fn judge(&self, table: &Table, seen: &[Probe], round: usize) -> Judgement<Probe> {
        // New probes each round: those that a search was sized on would flatter its result.
        let mut unseen = self.unseen(round);
        let climbs = self
            .users
            .iter()
            .map(|user| volume::attacked(table, &user.brdf, unseen.iter().chain(seen)));
        let found: Vec<Probe> = climbs.flatten().collect();
        let error = [seen, &unseen, &found].map(|probes| volume::measure(table, probes));
        let error = error.into_iter().fold(0.0, f64::max);
        let refuted = self.request.tolerance().is_some_and(|e| error > SAMPLED_SHARE * e);
        unseen.extend(found);
        Judgement { error, refuting: if refuted { unseen } else { Vec::new() } }
    }

    /// The probes of a round, which no round before has seen.
    fn unseen(&self, round: usize) -> Vec<Probe> {
        const SEEDS: usize = 3;
        // Seed 0 made the probes of the first search.
        let seeds = 1 + round * SEEDS..=(round + 1) * SEEDS;
        let mut unseen = Vec::new();
        for user in &self.users {
            for seed in seeds.clone() {
                unseen.extend(probes(&user.brdf, seed));
            }
            unseen.extend(crossings(&user.brdf));
        }
        unseen
    }
}

/// The tables of the factors of f, of the size asked for or of the smallest that keeps the
/// tolerance, proven where a bound is known.
pub(super) fn fill_factors(
    rows: &Rows,
    placed: &[Placed],
    sampled: &[Sampled<'_>],
    request: &Request,
) -> Result<Vec<Table>, BakeError> {
    let terms: Vec<Term> =
        Term::ALL.into_iter().filter(|term| request.wants(term.quantity())).collect();
    if terms.is_empty() {
        return Ok(Vec::new());
    }
    let bends: Vec<Bends> = terms.iter().map(|term| Bends::new(*term, rows)).collect();
    let promise = Promise { rows, placed, sampled, terms: &terms, bends: &bends };
    let Verified { tables, error, unrefuted } = verified(
        request.tolerance(),
        promise.seen(),
        |seen, round| promise.search(seen, round, request),
        |tables, seen, round| promise.judge(tables, seen, round, request.tolerance()),
    )?;
    let proof = if unrefuted { Proof::Bounded } else { Proof::Sampled };
    let error = [error, promise.truncated(&tables)];
    Ok(tables.into_iter().map(|table| noted(table, request, error, proof)).collect())
}

/// The promise of the factors' tables, material by material.
struct Promise<'a> {
    rows: &'a Rows,
    placed: &'a [Placed],
    sampled: &'a [Sampled<'a>],
    terms: &'a [Term],
    bends: &'a [Bends],
}

impl Promise<'_> {
    /// The materials with the probes of the first search.
    fn seen(&self) -> Vec<Subject> {
        let materials = self.sampled.iter().zip(self.placed);
        materials.filter_map(|(s, p)| Subject::new(self.rows, p, s.probes.clone())).collect()
    }

    /// The tables of the size asked for, or the smallest that keep the tolerance at the probes.
    fn search(
        &self,
        seen: &[Subject],
        round: usize,
        request: &Request,
    ) -> Result<Vec<Table>, BakeError> {
        let Self { rows, terms, bends, .. } = *self;
        match request.extent {
            Extent::Size(width) => {
                let depth = request.depths.candidates()[0];
                Ok(terms.iter().map(|term| term.tabulate(rows, width, depth)).collect())
            }
            Extent::Tolerance(e) => {
                // A proof may ask for a little more than the probes that refuted the last one.
                let aim = e * 0.97_f64.powi(round as i32);
                smallest(&Factors::new(rows, terms, bends, seen, aim), seen, aim, request.depths)
            }
        }
    }

    /// The largest error of the tables at probes seen and unseen, and the pairs of directions at
    /// which their bound breaks the tolerance.
    fn judge(
        &self,
        tables: &[Table],
        seen: &[Subject],
        round: usize,
        tolerance: Option<f64>,
    ) -> Judgement<Subject> {
        let unseen = self.unseen(1 + round);
        let (found, mut worst) = attacked(Attack::Climb, &unseen, tables, &Filter::COVERED);
        let mut error = measure(seen, tables, &Filter::COVERED).max(found);
        // The longer search costs many times the short one: only tables that pass the first get it.
        if !is_broken_by(error, tolerance) {
            let unseen = self.unseen(SEARCHED + round);
            let (found, longer) = attacked(Attack::Search, &unseen, tables, &Filter::COVERED);
            (error, worst) = (error.max(found), longer);
        }
        // No pair found does not make a proof: the tables need their bound as well.
        let mut refuting = tolerance.map_or_else(Vec::new, |e| self.refuting(tables, e));
        if is_broken_by(error, tolerance) {
            refuting.extend(worst);
        }
        Judgement { error, refuting }
    }

    /// The materials with the probes of a seed.
    fn unseen(&self, seed: usize) -> Vec<(&SgdBrdf, Subject)> {
        let materials = self.sampled.par_iter().zip(self.placed);
        let subjects = materials.filter_map(|(sampled, placed)| {
            let mut probes = probes(&sampled.brdf, seed);
            if seed >= SEARCHED {
                // The cases that broke a promise: a curve F that is 0 in the mirror direction.
                probes.extend(crossings(&sampled.brdf));
            }
            Some((&sampled.brdf, Subject::new(self.rows, placed, probes)?))
        });
        subjects.collect()
    }

    /// The largest error found of texture units that cut weights down.
    fn truncated(&self, tables: &[Table]) -> f64 {
        // Stated, not promised: the sizes do not depend on it.
        attacked(Attack::Search, &self.unseen(SEARCHED), tables, &[Filter::Truncating]).0
    }

    /// The materials whose bound breaks the tolerance, with probes around where it does.
    fn refuting(&self, tables: &[Table], tolerance: f64) -> Vec<Subject> {
        let errors = cell_errors(self.rows, self.terms, self.bends, tables);
        let extremes: Vec<(Term, Extremes)> = errors
            .iter()
            .map(|(term, errors)| (*term, Extremes::new(errors, term.row_count(self.rows))))
            .collect();
        let extremes =
            Term::ALL.map(|term| extremes.iter().find(|(of, _)| *of == term).map(|(_, e)| e));
        let warps = warps(self.rows);
        let materials = self.sampled.par_iter().zip(self.placed);
        materials
            .filter_map(|(s, placed)| {
                let places = Places::new(self.rows, placed.row?);
                let covering = Covering::new(&s.brdf, self.rows, places, &warps, extremes);
                match covering.verdict(tolerance) {
                    Verdict::Kept => None,
                    Verdict::Broken(pair) => {
                        Subject::new(self.rows, placed, probes_of_pair(&s.brdf, pair))
                    }
                }
            })
            .collect()
    }
}

/// Returns whether an error that was found breaks the promise.
fn is_broken_by(error: f64, tolerance: Option<f64>) -> bool {
    tolerance.is_some_and(|tolerance| error > tolerance)
}
