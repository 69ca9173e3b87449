//! The bake: from materials to tables.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::brdf::MaskingKind;
use crate::lut::albedo::{self, Albedo};
use crate::lut::error::{BakeError, LeftOut};
use crate::lut::memory;
use crate::lut::promise::{fill_factors, fill_volume, noted};
use crate::lut::quantity::Quantity;
use crate::lut::range::MAX_ROWS;
use crate::lut::request::{Extent, Request};
use crate::lut::row::{Placed, Rows, sharing_key};
use crate::lut::sampled::Sampled;
use crate::lut::search::smallest;
use crate::lut::table::{Proof, Table};
use crate::material::Material;

/// The share of the tolerance below which the lobes of a colour count as invisible; the rest is
/// left to the errors of the lobes that are stored.
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
    // A bake of a given size has no tolerance: it stores every lobe that changes f at all.
    let invisible = INVISIBLE * request.tolerance().unwrap_or(0.0);
    let sampled = materials.par_iter().map(|m| Sampled::new(m, request.masking, invisible));
    let sampled: Vec<Sampled<'_>> = sampled.inspect(|_| progress()).collect();
    let (rows, placed) = assign_rows(&sampled, request.masking);
    if rows.lobes.len() > MAX_ROWS || rows.fresnel.len() > MAX_ROWS {
        return Err(BakeError::Rows { found: rows.fresnel.len().max(rows.lobes.len()) });
    }
    // The rows, known only after sampling, decide how much is allocated from here on.
    memory::check(memory::of_bake(request, materials.len(), rows.lobes.len()))?;
    let left_out = sampled.iter().flat_map(|s| s.left_out(invisible)).collect();
    let mut tables = Vec::new();
    if !rows.lobes.is_empty() {
        tables.extend(fill_factors(&rows, &placed, &sampled, request)?);
        if request.wants(Quantity::Albedo) {
            tables.push(fill_albedo(&rows, request)?);
        }
        if request.wants(Quantity::Brdf3d) {
            // One after the other: each fills all threads, and one search's tables are held.
            for row in 0..rows.lobes.len() {
                tables.push(fill_volume(&rows, row, &placed, &sampled, request)?);
                progress();
            }
        }
    }
    Ok(Baked { tables, placed, left_out })
}

/// The distinct rows, and the place of each material.
fn assign_rows(sampled: &[Sampled<'_>], kind: MaskingKind) -> (Rows, Vec<Placed>) {
    let mut rows = Rows::default();
    let mut known = HashMap::new();
    // Not in parallel: rows come in the order of the materials, the first of which names each.
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
    // The moments do not depend on the size: every trial is held against the same values.
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
