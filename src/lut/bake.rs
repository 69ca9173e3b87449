//! The bake: from materials to tables.

use std::collections::HashMap;

use rayon::prelude::*;
use serde::Serialize;

use crate::lut::axis::Axis;
use crate::lut::quantity::Quantity;
use crate::lut::row::{Placed, Row, sharing_key};
use crate::lut::table::{Depth, ErrorNote, Table, Texels};
use crate::material::{Channel, Material};
use crate::microfacet::masking::MaskingKind;

/// Texels along the first axis that a texture may have: what GPUs take.
pub const WIDTHS: std::ops::RangeInclusive<usize> = 2..=16384;

/// Rows that a texture may have.
pub const MOST_ROWS: usize = 16384;

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
    pub depth: Depth,
}

/// How large textures become.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extent {
    /// So many texels along every axis that is not a row.
    Size(usize),
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
#[derive(Clone, Debug, PartialEq, Serialize)]
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
    /// More distinct materials than a texture has rows.
    #[error("{found} distinct materials do not fit one texture; accepted are up to {MOST_ROWS}")]
    Rows {
        /// The distinct materials.
        found: usize,
    },
}

/// Bakes the materials into one table per quantity; materials with equal lobes share a row.
///
/// # Errors
///
/// No material, or a size that no texture has.
pub fn bake(materials: &[&Material], request: &Request) -> Result<Baked, BakeError> {
    let Extent::Size(width) = request.extent;
    if materials.is_empty() {
        return Err(BakeError::NoMaterial);
    }
    if !WIDTHS.contains(&width) {
        return Err(BakeError::Size { found: width });
    }
    let (rows, placed) = assign_rows(materials, request.masking);
    if rows.len() > MOST_ROWS {
        return Err(BakeError::Rows { found: rows.len() });
    }
    let tables = request
        .quantities
        .iter()
        .map(|quantity| tabulate(*quantity, &rows, width, request.depth))
        .collect();
    Ok(Baked { tables, placed, left_out: Vec::new() })
}

/// The distinct rows, and the row of each material.
fn assign_rows(materials: &[&Material], kind: MaskingKind) -> (Vec<Row>, Vec<Placed>) {
    let visible = [true; 3];
    let mut rows = Vec::new();
    let mut known = HashMap::new();
    let placed = materials
        .iter()
        .map(|material| {
            let row = *known.entry(sharing_key(material, kind, visible)).or_insert_with(|| {
                rows.push(Row::new(material, kind, visible));
                rows.len() - 1
            });
            Placed::new(material, Some(row))
        })
        .collect();
    (rows, placed)
}

/// One quantity of all rows, `width` texels each.
fn tabulate(quantity: Quantity, rows: &[Row], width: usize, depth: Depth) -> Table {
    let axes = quantity.axes(rows);
    let texels: Vec<[f64; 3]> = (0..rows.len() * width)
        .into_par_iter()
        .map(|i| {
            texel(quantity, &axes[0], rows, i / width, (i % width) as f64 / (width - 1) as f64)
        })
        .collect();
    Table {
        quantity,
        size: vec![width, rows.len()],
        encoding: quantity.encoding(),
        texels: Texels::rounded(depth, texels.into_iter()),
        rows: rows.iter().map(|row| row.name.clone()).collect(),
        error: ErrorNote::default(),
        axes,
    }
}

/// The texel of a row at coordinate `u`, per channel.
fn texel(quantity: Quantity, axis: &Axis, rows: &[Row], row: usize, u: f64) -> [f64; 3] {
    rows[row].lobes.each_ref().map(|lobe| match (lobe, &axis.warp) {
        (Some(lobe), Some(warp)) => quantity.texel(lobe, warp, row, u),
        _ => quantity.absent_texel(),
    })
}
