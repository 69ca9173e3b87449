//! The 2D factors of f: the smallest tables of D, G1 and F that keep a tolerance.
//!
//! # The promise
//!
//! For every pair of directions, |f_lut − f|·cosθi ≤ e·(max over wi of |f|cosθi for that wo +
//! |f|cosθi), with the texels rounded to their depth and mixed either in f32 or with a texture
//! unit's 8-bit weights.

use std::sync::Arc;

use rayon::prelude::*;

use crate::brdf::SgdBrdf;
use crate::lut::attack::{attack, scatter};
use crate::lut::axis::Warp;
use crate::lut::bend::Bends;
use crate::lut::cell_error::{CellErrors, ROUNDED_WEIGHTS, growth};
use crate::lut::interval::{Interval, times};
use crate::lut::probe::{Probe, Viewers, probes_of_pair};
use crate::lut::range::WIDTHS;
use crate::lut::row::{Placed, Rows};
use crate::lut::search::Sizable;
use crate::lut::table::{Depth, Filter, Table};
use crate::lut::term::Term;
use crate::material::MAX_LOBES;

/// Texels per axis at which a quantity's own error is measured to scale it.
const REFERENCE_WIDTH: usize = 65;
/// How far a texture unit's weights may be off.
const WEIGHTS: Interval = ROUNDED_WEIGHTS;
/// Beyond so many times the expected width it is rounding, not width, that limits the error.
const MAX_GROWTH: f64 = 16.0;

/// How the largest error is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Attack {
    /// A climb from the worst probe, by all texture units at once.
    Climb,
    /// Climbs of random moves from the worst probe of each viewer, by one texture unit after another.
    Search,
}

/// A material under test: its rows, its exact values, and the places of its probes in the textures.
pub struct Subject {
    /// Its row of `ndf` and `masking`.
    row: usize,
    /// Its row of `fresnel` for each lobe.
    fresnel_rows: [usize; MAX_LOBES],
    /// D(0) of each lobe.
    ndf_peaks: [f64; MAX_LOBES],
    /// Exact values.
    probes: Vec<Probe>,
    /// The lobes that are stored.
    visible: [bool; MAX_LOBES],
    /// How a probe's angles become coordinates.
    places: Warps,
    /// Coordinates of each probe.
    coordinates: Vec<Coordinates>,
}

/// The warps of the textures in one row.
#[derive(Clone)]
struct Warps {
    row: usize,
    /// Shared: each attack hands back a subject of its own.
    warps: Arc<[Warp; 3]>,
}

impl Warps {
    fn coordinates(&self, Probe { angles, .. }: &Probe) -> Coordinates {
        // In f32, as a shader has them, so that their rounding counts in the error.
        let [ndf, masking, fresnel] = &*self.warps;
        Coordinates {
            half: ndf.coordinate(self.row, angles.tan2_h) as f32,
            masking: angles.cot.map(|cot| masking.coordinate(self.row, cot) as f32),
            // The identity has no constants, hence no row.
            difference: fresnel.coordinate(0, angles.cos_d) as f32,
        }
    }
}

/// The coordinates of a probe in `ndf`, `masking` (light and viewer) and `fresnel`.
struct Coordinates {
    half: f32,
    masking: [f32; 2],
    difference: f32,
}

impl Subject {
    /// The subject of a placed material; `None` where nothing of it is stored.
    #[must_use]
    pub fn new(rows: &Rows, placed: &Placed, probes: Vec<Probe>) -> Option<Self> {
        let row = placed.row?;
        let places = Warps { row, warps: Arc::new(Term::ALL.map(|term| term.warp(rows))) };
        let coordinates = probes.iter().map(|probe| places.coordinates(probe)).collect();
        Some(Self {
            row,
            places,
            fresnel_rows: rows.lobes[row].fresnel_rows,
            ndf_peaks: placed.ndf_peaks(),
            probes,
            visible: rows.lobes[row].lobes.each_ref().map(Option::is_some),
            coordinates,
        })
    }

    /// The same material at another probe.
    fn at(&self, probe: &Probe) -> Self {
        let coordinates = vec![self.places.coordinates(probe)];
        let probes = vec![probe.clone()];
        Self { probes, coordinates, places: self.places.clone(), ..*self }
    }

    /// The largest error of f decoded from `tables`; a factor without a table is exact.
    fn error(&self, tables: &[Table], filter: Filter) -> f64 {
        let tables = in_order(tables);
        let probes = self.probes.iter().zip(&self.coordinates);
        probes.map(|(probe, at)| self.probe_error(probe, at, tables, filter)).fold(0.0, f64::max)
    }

    /// The largest error by any of the filters.
    fn worst_error(&self, tables: &[Table], filters: &[Filter]) -> f64 {
        filters.iter().map(|filter| self.error(tables, *filter)).fold(0.0, f64::max)
    }

    /// The error at another probe by one filter.
    fn error_at(&self, probe: &Probe, tables: &[Table], filter: Filter) -> f64 {
        self.probe_error(probe, &self.places.coordinates(probe), in_order(tables), filter)
    }

    /// The error at another probe by the worst of the filters.
    fn worst_error_at(&self, probe: &Probe, tables: &[Table], filters: &[Filter]) -> f64 {
        let errors = filters.iter().map(|filter| self.error_at(probe, tables, *filter));
        errors.fold(0.0, f64::max)
    }

    /// The largest error that an attack finds, and the subject of its probe alone.
    fn attacked(
        &self,
        attack: Attack,
        brdf: &SgdBrdf,
        tables: &[Table],
        filters: &[Filter],
    ) -> Option<(f64, Self)> {
        let (error, probe) = match attack {
            Attack::Climb => self.climbed(brdf, tables, filters)?,
            Attack::Search => {
                let viewers = Viewers::new(brdf);
                // The worst pair of one filter is seldom another's: each gets climbs of its own.
                let found = filters
                    .iter()
                    .filter_map(|filter| self.climbs(brdf, &viewers, tables, *filter));
                found.max_by(|a, b| a.0.total_cmp(&b.0))?
            }
        };
        Some((error, self.at(&probe)))
    }

    /// Where the climb from the worst probe ends.
    fn climbed(
        &self,
        brdf: &SgdBrdf,
        tables: &[Table],
        filters: &[Filter],
    ) -> Option<(f64, Probe)> {
        let errors = self.probes.iter().map(|probe| self.worst_error_at(probe, tables, filters));
        let worst = errors.zip(&self.probes).max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(attack(brdf, worst.1, |probe| self.worst_error_at(probe, tables, filters)))
    }

    /// The worst probe that climbs find for a filter.
    ///
    /// Each pair of cells has a maximum of its own, so climbs start from every viewer of the probes;
    /// the best of their ends climb on, the last of them with each viewer's brightest light searched.
    fn climbs(
        &self,
        brdf: &SgdBrdf,
        viewers: &Viewers,
        tables: &[Table],
        filter: Filter,
    ) -> Option<(f64, Probe)> {
        const FIRST_MOVES: u32 = 400;
        const BEST: usize = 6;
        const MOVES: u32 = 2000;
        const LAST: usize = 2;
        const LAST_MOVES: u32 = 600;
        let by_viewer = self.probes.chunk_by(|a, b| a.pair[1] == b.pair[1]);
        let starts = by_viewer.filter_map(|probes| {
            let errors = probes.iter().map(|probe| self.error_at(probe, tables, filter));
            errors.zip(probes).max_by(|a, b| a.0.total_cmp(&b.0))
        });
        let ends = starts.map(|(_, start)| {
            scatter(brdf, Some(viewers), start, FIRST_MOVES, |probe| {
                self.error_at(probe, tables, filter)
            })
        });
        let ends = best(ends.collect(), BEST);
        let ends = ends.iter().map(|(_, end)| {
            scatter(brdf, Some(viewers), end, MOVES, |probe| self.error_at(probe, tables, filter))
        });
        let ends = best(ends.collect(), LAST);
        let last = ends.iter().map(|(_, end)| {
            // Its own viewer's light, not one between its neighbours'.
            let own = probes_of_pair(brdf, end.pair).into_iter().next();
            let start = own.as_ref().unwrap_or(end);
            scatter(brdf, None, start, LAST_MOVES, |probe| self.error_at(probe, tables, filter))
        });
        last.max_by(|a, b| a.0.total_cmp(&b.0))
    }

    fn probe_error(
        &self,
        probe: &Probe,
        at: &Coordinates,
        [ndf, masking, fresnel]: [Option<&Table>; 3],
        filter: Filter,
    ) -> f64 {
        // Only the encoding of `ndf` makes use of the peaks.
        let peaks = self.ndf_peaks;
        let slope_density = ndf.map(|table| table.value(self.row, at.half, peaks, filter));
        let g1 = masking.map(|table| at.masking.map(|u| table.value(self.row, u, peaks, filter)));
        // `ndf` stores D cos⁴θh.
        let inv_cos2 = 1.0 + probe.angles.tan2_h;
        let mut decoded = [0.0; 3];
        // A lobe that is left out is missing here, so what it reflects counts as error.
        for (j, exact) in probe.lobes.iter().enumerate().filter(|(j, _)| self.visible[*j]) {
            let f = fresnel.map_or(exact.fresnel, |table| {
                table.value(self.fresnel_rows[j], at.difference, peaks, filter)
            });
            let d = slope_density.map_or(exact.ndf, |p22| p22[j] * inv_cos2 * inv_cos2);
            let [g1_i, g1_o] = g1.map_or(exact.g1, |g1| g1.map(|g1| g1[j]));
            for c in (0..3).filter(|c| exact.scale[*c] > 0.0) {
                decoded[c] += exact.scale[c] * f[c] * d * g1_i * g1_o;
            }
        }
        (0..3).map(|c| probe.colours[c].error(decoded[c])).fold(0.0, f64::max)
    }

    /// A bound on the error of f decoded from the tables of these cell errors, over the
    /// surroundings of every probe.
    ///
    /// # Formula
    ///
    /// With relative errors δ of D, G1(wi), G1(wo) and an absolute error ε of F, each between two
    /// values,
    ///
    /// ```text
    /// Δf cosθi = Σ_lobes ρs/(π cosθo) · D G1(wi) G1(wo) · [F·(g − 1) + ε·g]
    /// g = (1+δ_D)(1+δ_i)(1+δ_o)
    /// ```
    ///
    /// and a lobe that is not stored has g = 0.
    fn bound(&self, errors: &[(Term, CellErrors)]) -> f64 {
        let errors = by_term(errors);
        let probes = self.probes.iter().zip(&self.coordinates);
        probes.map(|(probe, at)| self.probe_bound(probe, at, errors)).fold(0.0, f64::max)
    }

    fn probe_bound(
        &self,
        probe: &Probe,
        at: &Coordinates,
        [ndf, masking, fresnel]: [Option<&CellErrors>; 3],
    ) -> f64 {
        let ndf = errors_at(ndf, self.row, at.half);
        let [g1_i, g1_o] = at.masking.map(|u| errors_at(masking, self.row, u));
        // The interval of (f_lut − f) cosθi: errors of opposite sign do not add up.
        let mut off = [[0.0; 2]; 3];
        for (j, exact) in probe.lobes.iter().enumerate() {
            let growth =
                if self.visible[j] { growth([ndf[j], g1_i[j], g1_o[j]]) } else { [0.0; 2] };
            let fresnel = errors_at(fresnel, self.fresnel_rows[j], at.difference);
            let product = exact.ndf * exact.g1[0] * exact.g1[1];
            for c in (0..3).filter(|c| exact.scale[*c] > 0.0) {
                let by_growth = growth.map(|g| exact.fresnel[c] * (g - 1.0));
                let by_fresnel = times(fresnel[c], growth);
                let scale = exact.scale[c] * product;
                off[c][0] += scale * (by_growth[0].min(by_growth[1]) + by_fresnel[0]);
                off[c][1] += scale * (by_growth[0].max(by_growth[1]) + by_fresnel[1]);
            }
        }
        (0..3).map(|c| probe.colours[c].error_of(off[c][1].max(-off[c][0]))).fold(0.0, f64::max)
    }
}

/// The ends of so many climbs with the largest errors.
fn best(mut ends: Vec<(f64, Probe)>, count: usize) -> Vec<(f64, Probe)> {
    ends.sort_by(|a, b| b.0.total_cmp(&a.0));
    ends.truncate(count);
    ends
}

/// The tables of D, G1 and F, where there is one.
fn in_order(tables: &[Table]) -> [Option<&Table>; 3] {
    Term::ALL.map(|term| tables.iter().find(|table| table.quantity == term.quantity()))
}

/// A bound on the error of f over all subjects, decoded from `tables` of `terms`.
fn bound(subjects: &[Subject], errors: &[(Term, CellErrors)]) -> f64 {
    subjects.par_iter().map(|subject| subject.bound(errors)).reduce(|| 0.0, f64::max)
}

/// The errors of a factor at a coordinate of a row; 0 where it has no table.
fn errors_at(errors: Option<&CellErrors>, row: usize, u: f32) -> [Interval; 3] {
    errors.map_or([[0.0; 2]; 3], |errors| *errors.at(row, f64::from(u)))
}

/// The cell errors of each factor, where it has a table.
fn by_term(errors: &[(Term, CellErrors)]) -> [Option<&CellErrors>; 3] {
    Term::ALL.map(|term| errors.iter().find(|(of, _)| *of == term).map(|(_, errors)| errors))
}

/// The largest error of f that an attack on each subject finds, and the subjects of those probes
/// alone.
#[must_use]
pub fn attacked(
    attack: Attack,
    subjects: &[(&SgdBrdf, Subject)],
    tables: &[Table],
    filters: &[Filter],
) -> (f64, Vec<Subject>) {
    // A climb fetches thousands of times: half floats are converted once.
    let tables: Vec<Table> = tables.iter().map(Table::widened).collect();
    let found: Vec<(f64, Subject)> = subjects
        .par_iter()
        .filter_map(|(brdf, subject)| subject.attacked(attack, brdf, &tables, filters))
        .collect();
    let largest = found.iter().map(|(error, _)| *error).fold(0.0, f64::max);
    (largest, found.into_iter().map(|(_, subject)| subject).collect())
}

/// The largest error of f measured over all subjects.
#[must_use]
pub fn measure(subjects: &[Subject], tables: &[Table], filters: &[Filter]) -> f64 {
    let tables: Vec<Table> = tables.iter().map(Table::widened).collect();
    let errors = subjects.par_iter().map(|subject| subject.worst_error(&tables, filters));
    errors.reduce(|| 0.0, f64::max)
}

/// The errors of every cell of the tables, by each texture unit that the promise covers.
#[must_use]
pub fn cell_errors(
    rows: &Rows,
    terms: &[Term],
    bends: &[Bends],
    tables: &[Table],
) -> Vec<(Term, CellErrors)> {
    let factors = terms.iter().zip(bends).zip(tables);
    factors
        .map(|((term, bends), table)| (*term, CellErrors::new(*term, table, rows, bends, WEIGHTS)))
        .collect()
}

/// The tables of some factors, in search of their sizes.
pub struct Factors<'a> {
    rows: &'a Rows,
    terms: &'a [Term],
    /// How the texels of each factor bend.
    bends: &'a [Bends],
    /// The widths at which interpolation alone would keep the aim.
    widths: Vec<f64>,
}

impl<'a> Factors<'a> {
    /// The factors of `terms`, of widths about right for `tolerance` at the subjects' probes.
    #[must_use]
    pub fn new(
        rows: &'a Rows,
        terms: &'a [Term],
        bends: &'a [Bends],
        subjects: &[Subject],
        tolerance: f64,
    ) -> Self {
        let aim = Self::AIMS[0] * tolerance;
        let mut factors = Self { rows, terms, bends, widths: Vec::new() };
        factors.widths = factors.expected_widths(subjects, aim);
        factors
    }

    /// The widths with the least sum whose interpolation errors add up to `tolerance`.
    ///
    /// # Derivation
    ///
    /// Linear interpolation over n texels errs by c_q/n², c_q measured at a reference width. The
    /// sum Σ n_q under Σ c_q/n_q² = e is least for n_q = √(C/e)·c_q^{1/3}, C = Σ c_q^{1/3}.
    fn expected_widths(&self, subjects: &[Subject], tolerance: f64) -> Vec<f64> {
        let factors = self.terms.iter().zip(self.bends);
        let coefficients =
            factors.map(|(term, bends)| interpolation(*term, self.rows, bends, subjects));
        let roots: Vec<f64> = coefficients.map(f64::cbrt).collect();
        let sum: f64 = roots.iter().sum();
        roots.iter().map(|root| 1.0 + (sum / tolerance).sqrt() * root).collect()
    }
}

impl Sizable for Factors<'_> {
    type Tables = Vec<Table>;
    type Probe = Subject;
    const AIMS: &'static [f64] = &[0.95];

    fn largest_growth(&self) -> Option<f64> {
        let widest = self.widths.iter().copied().fold(0.0, f64::max);
        // Beyond the largest width a texture would stop growing while others went on.
        Some(MAX_GROWTH.min(*WIDTHS.end() as f64 / widest))
    }

    fn build(&self, growth: f64, depth: Depth) -> Vec<Table> {
        let factors = self.terms.iter().zip(&self.widths);
        factors
            .map(|(term, width)| term.tabulate(self.rows, admissible(width * growth), depth))
            .collect()
    }

    fn measure(&self, tables: &Vec<Table>, subjects: &[Subject]) -> f64 {
        measure(subjects, tables, &Filter::COVERED)
    }

    fn bound(&self, tables: &Vec<Table>, subjects: &[Subject]) -> f64 {
        bound(subjects, &cell_errors(self.rows, self.terms, self.bends, tables))
    }
}

/// The coefficient c of a factor's interpolation error c/n².
fn interpolation(term: Term, rows: &Rows, bends: &Bends, subjects: &[Subject]) -> f64 {
    let table = term.tabulate(rows, REFERENCE_WIDTH, Depth::Float);
    let errors = CellErrors::new(term, &table, rows, bends, WEIGHTS);
    // The other factors have no table, so they are exact.
    bound(subjects, &[(term, errors)]) * (REFERENCE_WIDTH - 1).pow(2) as f64
}

/// The whole number of texels that a texture may have, nearest above `width`.
fn admissible(width: f64) -> usize {
    (width.ceil() as usize).clamp(*WIDTHS.start(), *WIDTHS.end())
}
