//! The bake: from materials to tables.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::brdf::{MaskingKind, SgdBrdf};
use crate::lut::albedo::{self, Albedo};
use crate::lut::bend::Bends;
use crate::lut::covering::{Covering, Places, Verdict, warps};
use crate::lut::error::{BakeError, LeftOut};
use crate::lut::extremes::Extremes;
use crate::lut::factors::{Factors, Subject, attacked, cell_errors, measure, searched};
use crate::lut::memory;
use crate::lut::probe::{Probe, crossings, probes, probes_of_pair};
use crate::lut::quantity::Quantity;
use crate::lut::range::{MAX_ROWS, VOLUME_WIDTHS};
use crate::lut::request::{Extent, Request};
use crate::lut::row::{Placed, Row, Rows, sharing_key};
use crate::lut::search::{Judgement, Verified, smallest, verified};
use crate::lut::table::{ErrorNote, Filter, Proof, Table};
use crate::lut::term::Term;
use crate::lut::volume::{self, Volume};
use crate::material::{MAX_LOBES, Material};
use crate::microfacet::Accuracy;

/// The first seed of the longer searches, whose result is stated.
const SEARCHED: usize = 101;

/// The share of the tolerance that a search may find before it counts as broken, where no bound is
/// known: another search may find more.
const SAMPLED_SHARE: f64 = 0.92;

/// The share of the tolerance below which the lobes of a colour count as invisible.
const INVISIBLE: f64 = 0.5;

/// The result of a bake.
#[derive(Clone, Debug, PartialEq)]
pub struct Baked {
    /// One table per quantity; of `brdf3d`, one per row.
    pub tables: Vec<Table>,
    /// The place of each material, in the order given.
    pub placed: Vec<Placed>,
    /// The lobes that were left out, and why.
    pub left_out: Vec<LeftOut>,
}

impl Baked {
    /// The table of a quantity that all materials share.
    #[must_use]
    pub fn table(&self, quantity: Quantity) -> Option<&Table> {
        self.tables.iter().find(|table| table.quantity == quantity)
    }

    /// The 3D table of a row.
    #[must_use]
    pub fn volume(&self, row: usize) -> Option<&Table> {
        let mut volumes = self.tables.iter().filter(|table| table.quantity == Quantity::Brdf3d);
        volumes.find(|table| table.row == Some(row))
    }
}

/// A material with its exact values at the probes.
struct Sampled<'a> {
    material: &'a Material,
    brdf: SgdBrdf,
    probes: Vec<Probe>,
    visible: [bool; MAX_LOBES],
}

/// Bakes the materials into one table per quantity; materials with equal lobes share a row, and
/// every table carries the largest error of f that was measured.
///
/// # Errors
///
/// No material, a size that no texture has, a tolerance that is out of range or out of reach.
///
/// # Example
///
/// ```
/// use sgdbake::{Depths, Extent, MaskingKind, Quantity, Request, bake, named};
///
/// let request = Request {
///     quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
///     masking: MaskingKind::Exact,
///     extent: Extent::Size(32),
///     depths: Depths::Smallest,
/// };
/// let baked = bake(&[named("gold-paint")?], &request)?;
/// for table in &baked.tables {
///     println!("{}: {:?}, error {:?}", table.quantity.name(), table.size, table.error.measured);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn bake(materials: &[&Material], request: &Request) -> Result<Baked, BakeError> {
    bake_with_progress(materials, request, &|| ())
}

/// [`bake`], telling `progress` after each material sampled and each 3D table filled.
///
/// # Errors
///
/// Those of [`bake`].
pub fn bake_with_progress(
    materials: &[&Material],
    request: &Request,
    progress: &(dyn Fn() + Sync),
) -> Result<Baked, BakeError> {
    if materials.is_empty() {
        return Err(BakeError::NoMaterial);
    }
    request.check()?;
    let invisible = INVISIBLE * request.tolerance().unwrap_or(0.0);
    let sampled = materials.par_iter().map(|m| Sampled::new(m, request.masking, invisible));
    let sampled: Vec<Sampled<'_>> = sampled.inspect(|_| progress()).collect();
    let (rows, placed) = assign_rows(&sampled, request.masking);
    if rows.lobes.len() > MAX_ROWS || rows.fresnel.len() > MAX_ROWS {
        return Err(BakeError::Rows { found: rows.fresnel.len().max(rows.lobes.len()) });
    }
    memory::check(memory::of_bake(request, materials.len(), rows.lobes.len()))?;
    let left_out = sampled.iter().flat_map(|s| s.left_out(invisible)).collect();
    let mut tables = Vec::new();
    if !rows.lobes.is_empty() {
        tables.extend(fill_factors(&rows, &placed, &sampled, request)?);
        if request.wants(Quantity::Albedo) {
            tables.push(fill_albedo(&rows, request)?);
        }
        if request.wants(Quantity::Brdf3d) {
            for row in 0..rows.lobes.len() {
                tables.push(fill_volume(&rows, row, &placed, &sampled, request)?);
                progress();
            }
        }
    }
    Ok(Baked { tables, placed, left_out })
}

impl<'a> Sampled<'a> {
    /// Evaluates a material at its probes. A lobe is visible if leaving it out would err by more
    /// than its part of `invisible` anywhere.
    fn new(material: &'a Material, kind: MaskingKind, invisible: f64) -> Self {
        let brdf = SgdBrdf::with_accuracy(material, kind, Accuracy::Table).tabulated();
        let probes = probes(&brdf, 0);
        let parts = [0, 1, 2].map(|c| {
            let colouring = brdf.lobes.iter().filter(|lobe| lobe.rho_s[c] > 0.0).count();
            invisible / colouring.max(1) as f64
        });
        let visible = std::array::from_fn(|j| {
            j < brdf.lobes.len() && probes.iter().any(|probe| shows(probe, j, parts))
        });
        Self { material, brdf, probes, visible }
    }

    /// The reasons why the invisible lobes of a material are not stored.
    fn left_out(&self, invisible: f64) -> impl Iterator<Item = LeftOut> {
        let lobes = self.material.lobes().iter().enumerate();
        lobes.filter(|(j, _)| !self.visible[*j]).map(move |(j, lobe)| LeftOut {
            material: self.material.name.clone(),
            lobe: j,
            reason: format!(
                "rho_s {:e}: without this lobe f errs by less than {invisible:e}",
                lobe.rho_s().into_iter().fold(0.0, f64::max)
            ),
        })
    }
}

/// Returns whether f at a probe would err by more than its parts without lobe `j`.
fn shows(probe: &Probe, j: usize, parts: [f64; 3]) -> bool {
    let specular = probe.lobes[j].specular();
    (0..3).any(|c| probe.colours[c].error_of(specular[c].abs()) > parts[c])
}

/// The distinct rows, and the place of each material.
fn assign_rows(sampled: &[Sampled<'_>], kind: MaskingKind) -> (Rows, Vec<Placed>) {
    let mut rows = Rows::default();
    let mut known = HashMap::new();
    let placed = sampled
        .iter()
        .map(|Sampled { material, brdf, visible, .. }| {
            let row = visible.contains(&true).then(|| {
                *known.entry(sharing_key(material, kind, *visible)).or_insert_with(|| {
                    rows.push(&material.name, brdf, *visible);
                    rows.lobes.len() - 1
                })
            });
            Placed::new(material, row, &rows)
        })
        .collect();
    (rows, placed)
}

/// The albedo table, its error the largest difference of a moment from quadrature.
fn fill_albedo(rows: &Rows, request: &Request) -> Result<Table, BakeError> {
    let checks = albedo::Checks::new(&rows.lobes);
    let table = match request.extent {
        Extent::Size(width) => albedo::tabulate(&rows.lobes, width, request.depths.candidates()[0]),
        Extent::Tolerance(tolerance) => {
            let search = Albedo::new(&rows.lobes, &checks, tolerance);
            smallest(&search, &[], tolerance, request.depths)?
        }
    };
    let error = checks.measure(&table);
    Ok(noted(table, request, [error, 0.0], Proof::Sampled))
}

/// A table with its errors: by the texture units that the promise covers, and by those that cut
/// weights down; 0 where that was not measured.
fn noted(table: Table, request: &Request, [measured, truncated]: [f64; 2], proof: Proof) -> Table {
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
fn fill_volume(
    rows: &Rows,
    row: usize,
    placed: &[Placed],
    sampled: &[Sampled<'_>],
    request: &Request,
) -> Result<Table, BakeError> {
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
fn fill_factors(
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
        let broken = |error: f64| tolerance.is_some_and(|tolerance| error > tolerance);
        let (found, mut worst) = attacked(&self.unseen(1 + round), tables, &Filter::COVERED);
        let mut error = measure(seen, tables, &Filter::COVERED).max(found);
        if !broken(error) {
            let unseen = self.unseen(SEARCHED + round);
            let (found, longer) = searched(&unseen, tables, &Filter::COVERED);
            (error, worst) = (error.max(found), longer);
        }
        let mut refuting = tolerance.map_or_else(Vec::new, |e| self.refuting(tables, e));
        if broken(error) {
            refuting.extend(worst);
        }
        Judgement { error, refuting }
    }

    /// The materials with the probes of a seed.
    fn unseen(&self, seed: usize) -> Vec<(&SgdBrdf, Subject)> {
        let of_material = |(sampled, placed): (&Sampled<'_>, &Placed)| {
            let mut probes = probes(&sampled.brdf, seed);
            if seed >= SEARCHED {
                probes.extend(crossings(&sampled.brdf));
            }
            Subject::new(self.rows, placed, probes)
        };
        let subjects = self.sampled.par_iter().zip(self.placed).map(of_material);
        let subjects: Vec<Option<Subject>> = subjects.collect();
        let brdfs = self.sampled.iter().map(|sampled| &sampled.brdf);
        brdfs.zip(subjects).filter_map(|(brdf, subject)| Some((brdf, subject?))).collect()
    }

    /// The largest error found of texture units that cut weights down.
    fn truncated(&self, tables: &[Table]) -> f64 {
        searched(&self.unseen(SEARCHED), tables, &[Filter::Truncating]).0
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
