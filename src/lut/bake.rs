//! The bake: from materials to tables.

use std::collections::HashMap;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::brdf::ChannelBrdf;
use crate::lut::axis::Axis;
use crate::lut::budget::{self, Subject, measure};
use crate::lut::probe::{Probe, probes};
use crate::lut::quantity::Quantity;
use crate::lut::row::{MASKING_ACCURACY, Placed, Row, sharing_key};
use crate::lut::table::{Depth, ErrorNote, Filter, Table, Texels};
use crate::lut::term::Term;
use crate::lut::{albedo, volume};
use crate::material::{Channel, Material};
use crate::microfacet::masking::MaskingKind;

/// Texels along the first axis that a texture may have: what GPUs take.
pub const WIDTHS: std::ops::RangeInclusive<usize> = 2..=16384;

/// Rows that a texture may have.
pub const MOST_ROWS: usize = 16384;

/// Tolerances that a bake accepts.
pub const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-6..=0.5;

/// The share of the tolerance below which a lobe counts as invisible.
const INVISIBLE: f64 = 0.5;

/// What to bake.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// The quantities, one texture each.
    pub quantities: Vec<Quantity>,
    /// Which masking is stored.
    pub masking: MaskingKind,
    /// How large the textures become.
    pub extent: Extent,
    /// The texels' number format.
    pub depths: Depths,
}

impl Request {
    fn wants(&self, quantity: Quantity) -> bool {
        self.quantities.contains(&quantity)
    }

    /// Refuses an error above the tolerance, if there is one.
    fn keeps(&self, error: f64) -> Result<(), BakeError> {
        match self.extent {
            Extent::Tolerance(tolerance) if error > tolerance => {
                Err(BakeError::NotReached { tolerance, best: error })
            }
            _ => Ok(()),
        }
    }
}

/// How large textures become.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extent {
    /// So many texels along every axis that is not a row.
    Size(usize),
    /// As few as keep this error.
    Tolerance(f64),
}

/// Which number formats a bake may use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Depths {
    /// The smallest that keeps the tolerance; half for a fixed size.
    #[default]
    Smallest,
    /// This one.
    Only(Depth),
}

impl Depths {
    /// The depths to try, in that order.
    #[must_use]
    pub fn candidates(&self) -> &[Depth] {
        match self {
            Self::Smallest => &[Depth::Half, Depth::Float],
            Self::Only(depth) => std::slice::from_ref(depth),
        }
    }
}

/// What a bake produced.
#[derive(Clone, Debug, PartialEq)]
pub struct Baked {
    /// One table per quantity.
    pub tables: Vec<Table>,
    /// Where each material ended up, in the order given.
    pub placed: Vec<Placed>,
    /// Which lobes were left out, and why.
    pub left_out: Vec<LeftOut>,
}

/// A channel whose lobe is not stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// The material.
    pub material: String,
    /// Its channel.
    pub channel: Channel,
    /// Why, with the numbers that decided.
    pub reason: String,
}

/// Why nothing was baked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BakeError {
    /// There is nothing to bake.
    #[error("no material was given")]
    NoMaterial,
    /// The size is outside what textures can have.
    #[error("a texture cannot be {found} texels wide; accepted are {} to {}", WIDTHS.start(), WIDTHS.end())]
    Size {
        /// The size asked for.
        found: usize,
    },
    /// The size is outside what a 3D table can have.
    #[error("a 3D table cannot have {found} texels along an axis; accepted are {} to {}", volume::AXIS.start(), volume::AXIS.end())]
    Volume {
        /// The size asked for.
        found: usize,
    },
    /// The tolerance is not a number that a bake can aim at.
    #[error("the tolerance {found} is out of range; accepted are {} to {}", TOLERANCES.start(), TOLERANCES.end())]
    Tolerance {
        /// The tolerance asked for.
        found: f64,
    },
    /// More distinct materials than a texture has rows.
    #[error("{found} distinct materials do not fit one texture; accepted are up to {MOST_ROWS}")]
    Rows {
        /// The distinct materials.
        found: usize,
    },
    /// 16-bit integers cannot hold a quantity that spans hundreds of decades.
    #[error("'{quantity}' does not fit 16-bit integers; only masking, fresnel and albedo do", quantity = .0.name())]
    Range(Quantity),
    /// The largest textures do not keep the tolerance.
    #[error("the tolerance {tolerance} cannot be kept: the best error reached is {best:.3e}")]
    NotReached {
        /// The tolerance asked for.
        tolerance: f64,
        /// The smallest error found.
        best: f64,
    },
}

/// A material with its exact values at the probes.
struct Sampled<'a> {
    material: &'a Material,
    channels: [ChannelBrdf; 3],
    probes: Vec<Probe>,
    visible: [bool; 3],
}

/// Bakes the materials into one table per quantity; materials with equal lobes share a row, and
/// every table carries the largest error of f that was measured.
///
/// # Errors
///
/// No material, a size that no texture has, a tolerance that is out of range or out of reach.
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
    check(materials, request)?;
    let invisible = match request.extent {
        Extent::Size(_) => 0.0,
        Extent::Tolerance(tolerance) => INVISIBLE * tolerance,
    };
    let sampled = materials.par_iter().map(|m| sample(m, request.masking, invisible));
    let sampled: Vec<Sampled<'_>> = sampled.inspect(|_| progress()).collect();
    let (rows, placed) = assign_rows(&sampled, request.masking);
    if rows.len() > MOST_ROWS {
        return Err(BakeError::Rows { found: rows.len() });
    }
    let left_out = sampled.iter().flat_map(|s| left_out(s, invisible)).collect();
    let mut tables = Vec::new();
    if !rows.is_empty() {
        if request.wants(Quantity::Albedo) {
            tables.push(fill_albedo(&rows, request)?);
        }
        if request.wants(Quantity::Brdf3d) {
            for row in 0..rows.len() {
                tables.push(fill_volume(&rows, row, &placed, &sampled, request)?);
                progress();
            }
        }
        tables.splice(0..0, fill_factors(&rows, &placed, sampled, request)?);
    }
    for table in &mut tables {
        table.error.tolerance = match request.extent {
            Extent::Size(_) => None,
            Extent::Tolerance(tolerance) => Some(tolerance),
        };
    }
    Ok(Baked { tables, placed, left_out })
}

fn check(materials: &[&Material], request: &Request) -> Result<(), BakeError> {
    if materials.is_empty() {
        return Err(BakeError::NoMaterial);
    }
    let integers = request.depths == Depths::Only(Depth::Unorm16);
    let unbounded = request.quantities.iter().find(|quantity| !quantity.fits_a_range());
    if let (true, Some(quantity)) = (integers, unbounded) {
        return Err(BakeError::Range(*quantity));
    }
    match request.extent {
        Extent::Size(found) if !WIDTHS.contains(&found) => Err(BakeError::Size { found }),
        Extent::Tolerance(found) if !TOLERANCES.contains(&found) => {
            Err(BakeError::Tolerance { found })
        }
        _ => Ok(()),
    }
}

/// Evaluates a material at its probes; a channel is visible if leaving its lobe out would err by
/// more than `invisible` anywhere.
fn sample(material: &Material, kind: MaskingKind, invisible: f64) -> Sampled<'_> {
    let evaluator = |params| ChannelBrdf::with_accuracy(params, kind, MASKING_ACCURACY).tabulated();
    let channels = material.channels.each_ref().map(evaluator);
    let probes = probes(&channels, 0);
    let visible =
        std::array::from_fn(|c| probes.iter().any(|probe| probe.exact[c].error(0.0) > invisible));
    Sampled { material, channels, probes, visible }
}

/// The distinct rows, and where each material ended up.
fn assign_rows(sampled: &[Sampled<'_>], kind: MaskingKind) -> (Vec<Row>, Vec<Placed>) {
    let mut rows = Vec::new();
    let mut known = HashMap::new();
    let placed = sampled
        .iter()
        .map(|Sampled { material, channels, visible, .. }| {
            let row = visible.contains(&true).then(|| {
                *known.entry(sharing_key(material, kind, *visible)).or_insert_with(|| {
                    rows.push(Row::new(&material.name, channels, *visible));
                    rows.len() - 1
                })
            });
            Placed::new(material, row)
        })
        .collect();
    (rows, placed)
}

/// Why the invisible channels of a material are not stored.
fn left_out(sampled: &Sampled<'_>, invisible: f64) -> Vec<LeftOut> {
    let without = Channel::ALL.into_iter().zip(sampled.visible).filter(|(_, visible)| !visible);
    without
        .map(|(channel, _)| LeftOut {
            material: sampled.material.name.clone(),
            channel,
            reason: format!(
                "rho_s {:e}: without its lobe f errs by less than {invisible:e}",
                sampled.material.channels[channel as usize].rho_s
            ),
        })
        .collect()
}

/// The albedo table, its error the largest difference of a moment from quadrature.
fn fill_albedo(rows: &[Row], request: &Request) -> Result<Table, BakeError> {
    let checks = albedo::Checks::new(rows);
    let mut table = match request.extent {
        Extent::Size(width) => albedo::tabulate(rows, width, request.depths.candidates()[0]),
        Extent::Tolerance(e) => albedo::smallest(rows, &checks, e, request.depths)?,
    };
    table.error.measured = Some(checks.measure(&table));
    Ok(table)
}

/// What a search finds at the probes it has `seen`, with its largest error there and at probes it
/// has not seen; where these refuse it, they count in the next search.
fn verified<T, P>(
    request: &Request,
    mut seen: Vec<P>,
    unseen: impl Fn(usize) -> Vec<P>,
    search: impl Fn(&[P]) -> Result<T, BakeError>,
    measure: impl Fn(&T, &[P]) -> f64,
) -> Result<(T, f64), BakeError> {
    const SEARCHES: usize = 4;
    let mut round = 0;
    loop {
        let unseen = unseen(round);
        let found = search(&seen)?;
        let error = measure(&found, &seen).max(measure(&found, &unseen));
        round += 1;
        match request.keeps(error) {
            Ok(()) => return Ok((found, error)),
            Err(refused) if round == SEARCHES => return Err(refused),
            Err(_) => seen.extend(unseen),
        }
    }
}

/// The 3D table of a row, verified for every material that uses it.
fn fill_volume(
    rows: &[Row],
    row: usize,
    placed: &[Placed],
    sampled: &[Sampled<'_>],
    request: &Request,
) -> Result<Table, BakeError> {
    const SEEDS: usize = 3;
    let users = || sampled.iter().zip(placed).filter(|(_, p)| p.row == Some(row)).map(|(s, _)| s);
    let seen: Vec<Probe> = users().flat_map(|s| s.probes.clone()).collect();
    let unseen = |round: usize| -> Vec<Probe> {
        let seeds = 1 + round * SEEDS..=(round + 1) * SEEDS;
        users().flat_map(|s| seeds.clone().flat_map(|seed| probes(&s.channels, seed))).collect()
    };
    let search = |seen: &[Probe]| match request.extent {
        Extent::Size(n) if !volume::AXIS.contains(&n) => Err(BakeError::Volume { found: n }),
        Extent::Size(n) => {
            Ok(volume::tabulate(&rows[row], row, [n; 3], request.depths.candidates()[0]))
        }
        Extent::Tolerance(e) => volume::smallest(&rows[row], row, seen, e, request.depths),
    };
    let (mut table, error) = verified(request, seen, unseen, search, volume::measure)?;
    table.error.measured = Some(error);
    Ok(table)
}

/// The tables of the factors of f, of the size asked for or of the smallest that keeps the
/// tolerance, verified.
fn fill_factors(
    rows: &[Row],
    placed: &[Placed],
    sampled: Vec<Sampled<'_>>,
    request: &Request,
) -> Result<Vec<Table>, BakeError> {
    let asked = |term: &Term| request.wants(term.quantity());
    let terms: Vec<Term> = Term::ALL.into_iter().filter(asked).collect();
    if terms.is_empty() {
        return Ok(Vec::new());
    }
    let subject = |placed: &Placed, probes| {
        placed.row.map(|row| Subject::new(rows, row, placed.ndf_peak, probes))
    };
    let (channels, sampled): (Vec<_>, Vec<_>) =
        sampled.into_iter().map(|s| (s.channels, s.probes)).unzip();
    let seen = sampled.into_iter().zip(placed).filter_map(|(probes, p)| subject(p, probes));
    let unseen = |round: usize| -> Vec<Subject> {
        let of_material = |(c, p): (_, &Placed)| subject(p, probes(c, 1 + round));
        channels.par_iter().zip(placed).map(of_material).flatten_iter().collect()
    };
    let search = |seen: &[Subject]| match request.extent {
        Extent::Size(width) => {
            let depth = request.depths.candidates()[0];
            Ok(terms.iter().map(|term| tabulate(*term, rows, width, depth)).collect())
        }
        Extent::Tolerance(e) => budget::smallest(rows, seen, &terms, e, request.depths),
    };
    let filters = [Filter::Fetched, Filter::Hardware];
    let largest = |tables: &Vec<Table>, subjects: &[Subject]| measure(subjects, tables, &filters);
    let (mut tables, error) = verified(request, seen.collect(), unseen, search, largest)?;
    for table in &mut tables {
        table.error.measured = Some(error);
    }
    Ok(tables)
}

/// One factor of all rows, `width` texels each.
#[must_use]
pub fn tabulate(term: Term, rows: &[Row], width: usize, depth: Depth) -> Table {
    let axes = term.axes(rows);
    let texels: Vec<[f64; 3]> = (0..rows.len() * width)
        .into_par_iter()
        .map(|i| texel(term, &axes[0], rows, i / width, (i % width) as f64 / (width - 1) as f64))
        .collect();
    Table {
        quantity: term.quantity(),
        size: vec![width, rows.len()],
        encoding: term.encoding(),
        texels: Texels::rounded(depth, &texels),
        rows: rows.iter().map(|row| row.name.clone()).collect(),
        row: None,
        error: ErrorNote::default(),
        axes,
    }
}

/// The texel of a row at coordinate `u`, per channel.
fn texel(term: Term, axis: &Axis, rows: &[Row], row: usize, u: f64) -> [f64; 3] {
    rows[row].lobes.each_ref().map(|lobe| match (lobe, &axis.warp) {
        (Some(lobe), Some(warp)) => term.texel(lobe, warp, row, u),
        _ => term.absent_texel(),
    })
}
