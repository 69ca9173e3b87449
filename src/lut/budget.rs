//! The budget: from a stated error to the smallest textures that keep it.
//!
//! # The promise
//!
//! For every pair of directions, |f_lut − f|·cosθi ≤ e·(max over wi of |f|cosθi for that wo +
//! |f|cosθi), with the texels rounded to their depth and mixed either in f32 or with a texture
//! unit's 8-bit weights.

use rayon::prelude::*;

use crate::lut::bake::{BakeError, Depths, WIDTHS, tabulate};
use crate::lut::envelope::Envelope;
use crate::lut::probe::Probe;
use crate::lut::row::Row;
use crate::lut::table::{Depth, Filter, Table};
use crate::lut::term::Term;

/// What a search aims at, for what changes between one probe and the next.
const SEARCH_SHARE: f64 = 0.95;
/// Texels per axis at which a quantity's own error is measured to scale it.
const REFERENCE_WIDTH: usize = 65;
/// Widths are tried in steps of this factor.
const STEP: f64 = 1.09;
/// Beyond so many times the expected width it is rounding, not width, that limits the error.
const MOST_GROWTH: f64 = 16.0;

/// A material under test: its row, its exact values, and where its probes lie in the textures.
pub struct Subject {
    /// Its row.
    pub row: usize,
    /// D(0) per channel.
    pub ndf_peak: [f64; 3],
    /// Exact values.
    pub probes: Vec<Probe>,
    /// Which channels have a stored lobe.
    pub visible: [bool; 3],
    /// Coordinates of each probe in `ndf`, `masking` (light and viewer) and `fresnel`.
    coordinates: Vec<[f32; 4]>,
}

impl Subject {
    /// The subject of a material placed in `row` of textures that hold `rows`.
    #[must_use]
    pub fn new(rows: &[Row], row: usize, ndf_peak: [f64; 3], probes: Vec<Probe>) -> Self {
        let visible = rows[row].lobes.each_ref().map(Option::is_some);
        let warp = |term: Term| term.warp(&rows[row..=row]);
        let [ndf, masking, fresnel] = Term::ALL.map(warp);
        let coordinates = probes
            .iter()
            .map(|probe| {
                [
                    ndf.coordinate(0, probe.tan2_theta_h),
                    masking.coordinate(0, probe.cot_theta[0]),
                    masking.coordinate(0, probe.cot_theta[1]),
                    fresnel.coordinate(0, probe.cos_theta_d),
                ]
                .map(|u| u as f32)
            })
            .collect();
        Self { row, ndf_peak, probes, visible, coordinates }
    }

    /// The largest error of f decoded from `tables`; a factor without a table is exact.
    fn error(&self, tables: &[Table], filter: Filter) -> f64 {
        let find = |term: Term| tables.iter().find(|table| table.quantity == term.quantity());
        let [ndf, masking, fresnel] = Term::ALL.map(find);
        let errors = self.probes.iter().zip(&self.coordinates).map(|(probe, [h, i, o, d])| {
            let value = |table: Option<&Table>, u: f32, exact: [f64; 3]| {
                table.map_or(exact, |table| table.value(self.row, u, self.ndf_peak, filter))
            };
            let exact = &probe.exact;
            let g1_i = value(masking, *i, exact.map(|e| e.g1[0]));
            let g1_o = value(masking, *o, exact.map(|e| e.g1[1]));
            let f = value(fresnel, *d, exact.map(|e| e.fresnel));
            let inv_cos2 = 1.0 + probe.tan2_theta_h;
            let slope_density = ndf.map(|table| table.value(self.row, *h, self.ndf_peak, filter));
            let of_channel = |c: usize| {
                let d = slope_density.map_or(exact[c].ndf, |p22| p22[c] * inv_cos2 * inv_cos2);
                let decoded = exact[c].scale * f[c] * d * g1_i[c] * g1_o[c];
                exact[c].error(if self.visible[c] { decoded } else { 0.0 })
            };
            (0..3).map(of_channel).fold(0.0, f64::max)
        });
        errors.fold(0.0, f64::max)
    }
}

impl Subject {
    /// A bound on the error of f decoded from the tables of these envelopes, over the
    /// surroundings of every probe.
    ///
    /// # Formula
    ///
    /// With relative errors δ of D, G1(wi), G1(wo) and an absolute error ε of F,
    /// |Δf|cosθi ≤ ρs/(π cosθo) · D G1(wi) G1(wo) · \[|F|·((1+δ_D)(1+δ_i)(1+δ_o) − 1) +
    /// ε·(1+δ_D)(1+δ_i)(1+δ_o)\].
    fn bound(&self, envelopes: &[(Term, Envelope)]) -> f64 {
        let find = |term| envelopes.iter().find(|(of, _)| *of == term).map(|(_, e)| e);
        let [ndf, masking, fresnel] = Term::ALL.map(find);
        let at = |envelope: Option<&Envelope>, u| envelope.map_or([0.0; 3], |e| e.at(self.row, u));
        let bounds = self.probes.iter().zip(&self.coordinates).map(|(probe, [h, i, o, d])| {
            let [ndf, g1_i, g1_o] = [at(ndf, *h), at(masking, *i), at(masking, *o)];
            let fresnel = at(fresnel, *d);
            let of_channel = |c: usize| {
                let exact = &probe.exact[c];
                let grown = (1.0 + ndf[c]) * (1.0 + g1_i[c]) * (1.0 + g1_o[c]);
                let off = exact.fresnel.abs() * (grown - 1.0) + fresnel[c] * grown;
                exact.error_of(exact.scale * exact.ndf * exact.g1[0] * exact.g1[1] * off)
            };
            (0..3).filter(|c| self.visible[*c]).map(of_channel).fold(0.0, f64::max)
        });
        bounds.fold(0.0, f64::max)
    }
}

/// A bound on the error of f over all subjects, decoded from `tables` of `rows`.
fn bound(subjects: &[Subject], rows: &[Row], terms: &[Term], tables: &[Table]) -> f64 {
    let envelope = |(term, table): (&Term, &Table)| (*term, Envelope::new(*term, table, rows));
    let envelopes: Vec<(Term, Envelope)> = terms.iter().zip(tables).map(envelope).collect();
    subjects.par_iter().map(|subject| subject.bound(&envelopes)).reduce(|| 0.0, f64::max)
}

/// The largest error of f measured over all subjects.
#[must_use]
pub fn measure(subjects: &[Subject], tables: &[Table], filters: &[Filter]) -> f64 {
    let tables: Vec<Table> = tables.iter().map(Table::widened).collect();
    let of_subject = |subject: &Subject| {
        filters.iter().map(|filter| subject.error(&tables, *filter)).fold(0.0, f64::max)
    };
    subjects.par_iter().map(of_subject).reduce(|| 0.0, f64::max)
}

/// Tables of `terms` that keep `tolerance` over the search's probes, in the smallest of the
/// depths that can.
///
/// # Errors
///
/// [`BakeError::NotReached`] with the best error, where the largest textures do not keep it.
pub fn smallest(
    rows: &[Row],
    subjects: &[Subject],
    terms: &[Term],
    tolerance: f64,
    depths: Depths,
) -> Result<Vec<Table>, BakeError> {
    let widths = expected_widths(rows, subjects, terms, SEARCH_SHARE * tolerance);
    let build = |growth: f64, depth: Depth| -> Vec<Table> {
        let table =
            |(term, width): (&Term, &f64)| tabulate(*term, rows, admissible(width * growth), depth);
        terms.iter().zip(&widths).map(table).collect()
    };
    let widest = widths.iter().copied().fold(0.0, f64::max);
    let largest = MOST_GROWTH.min(*WIDTHS.end() as f64 / widest);
    let mut best = f64::INFINITY;
    for depth in depths.candidates() {
        let mut keeps = |growth: f64| {
            let tables = build(growth, *depth);
            let error = bound(subjects, rows, terms, &tables);
            best = best.min(error);
            (error <= SEARCH_SHARE * tolerance).then_some(tables)
        };
        if let Some(tables) = least(largest, &mut keeps) {
            return Ok(tables);
        }
    }
    Err(BakeError::NotReached { tolerance, best })
}

/// The result for the smallest growth in steps of [`STEP`], at most `largest`, that `keeps`
/// accepts: first doubled until accepted, then halved in between.
pub fn least<T>(largest: f64, keeps: &mut impl FnMut(f64) -> Option<T>) -> Option<T> {
    let (mut refused, mut accepted) = (0.25, largest.min(1.0));
    let mut result = keeps(accepted);
    while result.is_none() && accepted < largest {
        refused = accepted;
        accepted = (2.0 * accepted).min(largest);
        result = keeps(accepted);
    }
    let mut result = result?;
    while accepted / refused > STEP {
        let middle = (accepted * refused).sqrt();
        match keeps(middle) {
            Some(better) => (accepted, result) = (middle, better),
            None => refused = middle,
        }
    }
    Some(result)
}

/// The widths with the least sum whose interpolation errors add up to `tolerance`.
///
/// # Derivation
///
/// Linear interpolation over n texels errs by c_q/n², c_q measured at a reference width. The sum
/// Σ n_q under Σ c_q/n_q² = e is least for n_q = √(C/e)·c_q^{1/3}, C = Σ c_q^{1/3}.
fn expected_widths(rows: &[Row], subjects: &[Subject], terms: &[Term], tolerance: f64) -> Vec<f64> {
    let cube_root = |term: &Term| {
        let table = tabulate(*term, rows, REFERENCE_WIDTH, Depth::Float);
        let error = bound(subjects, rows, &[*term], &[table]);
        (error * (REFERENCE_WIDTH - 1).pow(2) as f64).cbrt()
    };
    let roots: Vec<f64> = terms.iter().map(cube_root).collect();
    let sum: f64 = roots.iter().sum();
    roots.iter().map(|root| 1.0 + (sum / tolerance).sqrt() * root).collect()
}

/// The whole number of texels that a texture may have, nearest above `width`.
fn admissible(width: f64) -> usize {
    (width.ceil() as usize).clamp(*WIDTHS.start(), *WIDTHS.end())
}
