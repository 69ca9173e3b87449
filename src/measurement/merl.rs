//! MERL `.binary`: a table over half and difference angles (Matusik et al. 2003).
//!
//! ```text
//! 3 × i32   90, 90, 180: cells along θh, θd, φd
//! 3 × 1458000 × f64   all red, all green, all blue; index φd + 180·(θd + 90·θh)
//! ```
//!
//! Little-endian. The value at index (i, j, k) belongs to
//!
//! ```text
//! θh = π/2 · (i/90)²,   θd = π/2 · j/90,   φd = π · k/180
//! ```
//!
//! and is the reflectance divided by 1/1500 (red), 1.15/1500 (green), 1.66/1500 (blue); a negative
//! value marks a cell without a measurement. φd and φd + π are the same cell: the table is
//! reciprocal by its form.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::io::{self, BufReader, BufWriter, Read, Write};

use glam::DVec3;
use rayon::prelude::*;

use crate::brdf::Reflectance;
use crate::math::direction::above_horizon;
use crate::measurement::error::Problem;
use crate::measurement::half_difference::HalfDifference;
use crate::measurement::{NOT_MEASURED, Sample};

/// Cells along θh, θd and φd.
pub const SIZE: [usize; 3] = [90, 90, 180];

const CELLS: usize = SIZE[0] * SIZE[1] * SIZE[2];

/// Bytes of a file.
pub const FILE_BYTES: u64 = 12 + 24 * CELLS as u64;

/// Reflectance per unit of a stored value, of red, green and blue: the format's own factors.
const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

/// Value of a cell without a measurement.
const INVALID: [f64; 3] = [-1.0; 3];

/// The share of the eight neighbours' weight that must be measured for a value between them.
const MIN_MEASURED: f64 = 0.5;

/// cosθ up to which a direction of a cell counts as below the horizon: the rounding of the angles.
const HORIZON: f64 = 1e-12;

/// A table of 90 × 90 × 180 cells.
///
/// # Example
///
/// ```no_run
/// use sgdbake::{MaskingKind, Merl, SgdBrdf, named};
///
/// let brdf = SgdBrdf::new(named("gold-paint")?, MaskingKind::Fitted);
/// let merl = Merl::tabulate(&brdf, &|| ());
/// merl.write_to(&mut std::fs::File::create("gold-paint.binary")?)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Merl {
    /// Values as stored, the colours of a cell side by side.
    cells: Vec<[f64; 3]>,
}

impl Merl {
    /// The table of a reflectance, `slab_done` called after each of the 90 θh.
    ///
    /// A negative f, which some fits have, is stored as 0; cells with a direction below the horizon
    /// or a NaN are marked as not measured.
    #[must_use]
    pub fn tabulate(reflectance: &dyn Reflectance, slab_done: &(dyn Fn() + Sync)) -> Self {
        let mut cells = vec![INVALID; CELLS];
        cells.par_chunks_mut(SIZE[1] * SIZE[2]).enumerate().for_each(|(theta_h, slab)| {
            fill(reflectance, theta_h, slab);
            slab_done();
        });
        Self { cells }
    }

    /// Reads the cells that follow the header; `length` is that of the whole file.
    pub(super) fn read(reader: &mut impl Read, length: u64) -> Result<Self, Problem> {
        if length != FILE_BYTES {
            return Err(Problem::Length { found: length, needed: FILE_BYTES });
        }
        let mut reader = BufReader::new(reader);
        // Only now: the length shows that the file has as many cells.
        let mut cells = vec![INVALID; CELLS];
        let mut bytes = [0; 8];
        // Planes in the file, side by side in memory: a lookup reads all colours of a cell.
        for (c, channel) in ["red", "green", "blue"].into_iter().enumerate() {
            for (i, cell) in cells.iter_mut().enumerate() {
                reader.read_exact(&mut bytes)?;
                let value = f64::from_le_bytes(bytes);
                if !value.is_finite() {
                    return Err(Problem::Cell { channel, cell: indices(i), value });
                }
                cell[c] = value;
            }
        }
        if !cells.iter().any(is_measured) {
            return Err(Problem::NothingMeasured);
        }
        Ok(Self { cells })
    }

    /// Writes the file.
    ///
    /// # Errors
    ///
    /// The writer's.
    pub fn write_to(&self, writer: &mut impl Write) -> io::Result<()> {
        let mut writer = BufWriter::new(writer);
        for size in SIZE {
            writer.write_all(&(size as u32).to_le_bytes())?;
        }
        for c in 0..3 {
            for cell in &self.cells {
                writer.write_all(&cell[c].to_le_bytes())?;
            }
        }
        writer.flush()
    }

    /// f at the angles of a pair, linear in the indices; [`NOT_MEASURED`] where more than half of
    /// the weight is on cells, of the eight around, without a measurement.
    #[must_use]
    pub fn value(&self, angles: HalfDifference) -> [f64; 3] {
        // Gaps leave the mean to the measured neighbours, with their weights scaled to a sum of 1.
        let (mut measured, mut sum) = (0.0, [0.0; 3]);
        for (i, weight_h) in theta_h_cells(angles.theta_h) {
            for (j, weight_d) in theta_d_cells(angles.theta_d) {
                for (k, weight_phi) in phi_d_cells(angles.phi_d) {
                    let weight = weight_h * weight_d * weight_phi;
                    let cell = &self.cells[index(i, j, k)];
                    if weight > 0.0 && is_measured(cell) {
                        measured += weight;
                        sum = std::array::from_fn(|c| sum[c] + weight * cell[c]);
                    }
                }
            }
        }
        if measured < MIN_MEASURED {
            return NOT_MEASURED;
        }
        std::array::from_fn(|c| sum[c] / measured * SCALE[c])
    }

    /// The measured cells.
    ///
    /// A cell's weight is its share of ∫∫ dωi dωo = (2π)²:
    /// 2π · 2 · sinθh dθh · 4 cosθd sinθd dθd · dφd, integrated between the midpoints to the next
    /// cells; the 2π is the azimuth of h, the 2 stands for φd + π.
    pub fn samples(&self) -> impl Iterator<Item = Sample> + '_ {
        let measured = self.cells.iter().enumerate().filter(|(_, cell)| is_measured(cell));
        measured.filter_map(|(i, cell)| {
            let [i, j, k] = indices(i);
            // Below the horizon there is no pair, whatever the file holds.
            let [wi, wo] = above(i, j, k)?;
            let f = std::array::from_fn(|c| cell[c] * SCALE[c]);
            Some(Sample { wi, wo, f, weight: solid_angles(i, j) })
        })
    }
}

impl Reflectance for Merl {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !(above_horizon(wi) && above_horizon(wo)) {
            return [0.0; 3];
        }
        self.value(HalfDifference::of(wi, wo))
    }
}

/// f of every cell of one θh, stored where both directions are above the horizon.
fn fill(reflectance: &dyn Reflectance, theta_h: usize, slab: &mut [[f64; 3]]) {
    // All pairs of a slab at once: a batch evaluator takes them side by side.
    let (places, pairs): (Vec<usize>, Vec<[DVec3; 2]>) = (0..slab.len())
        .filter_map(|place| Some((place, above(theta_h, place / SIZE[2], place % SIZE[2])?)))
        .unzip();
    let mut values = vec![[0.0; 3]; pairs.len()];
    reflectance.eval_all(&pairs, &mut values);
    for (place, f) in places.into_iter().zip(values) {
        if f.iter().all(|f| f.is_finite()) {
            slab[place] = std::array::from_fn(|c| f[c].max(0.0) / SCALE[c]);
        }
    }
}

/// The pair of a cell, if both directions are above the horizon.
fn above(theta_h: usize, theta_d: usize, phi_d: usize) -> Option<[DVec3; 2]> {
    let angles = HalfDifference {
        theta_h: theta_h_of(theta_h as f64),
        theta_d: theta_d_of(theta_d as f64),
        phi_d: PI * phi_d as f64 / SIZE[2] as f64,
    };
    Some(angles.directions()).filter(|pair| pair.iter().all(|w| w.z > HORIZON))
}

/// θh = π/2 · (i/90)².
fn theta_h_of(index: f64) -> f64 {
    FRAC_PI_2 * (index / SIZE[0] as f64).powi(2)
}

/// θd = π/2 · j/90.
fn theta_d_of(index: f64) -> f64 {
    FRAC_PI_2 * index / SIZE[1] as f64
}

fn theta_h_cells(theta_h: f64) -> [(usize, f64); 2] {
    between((theta_h / FRAC_PI_2).sqrt() * SIZE[0] as f64, SIZE[0])
}

fn theta_d_cells(theta_d: f64) -> [(usize, f64); 2] {
    between(theta_d / FRAC_PI_2 * SIZE[1] as f64, SIZE[1])
}

/// The two cells around φd, which is periodic in π.
fn phi_d_cells(phi_d: f64) -> [(usize, f64); 2] {
    let place = phi_d / PI * SIZE[2] as f64;
    let share = place - place.floor();
    // φd and φd + π are one cell, and the last cell's upper neighbour is the first.
    let lower = place.floor() as usize % SIZE[2];
    [(lower, 1.0 - share), ((lower + 1) % SIZE[2], share)]
}

/// The two cells around a place along an axis, and their weights; the last beyond the end.
fn between(place: f64, size: usize) -> [(usize, f64); 2] {
    let place = place.clamp(0.0, (size - 1) as f64);
    // At the end of the axis the last interval, with its upper end's weight 1.
    let lower = (place as usize).min(size - 2);
    let share = place - lower as f64;
    [(lower, 1.0 - share), (lower + 1, share)]
}

/// Where a cell starts and ends along an axis: halfway to its neighbours, or at the axis's end.
fn ends(index: usize, size: usize) -> [f64; 2] {
    let upper = if index + 1 == size { size as f64 } else { index as f64 + 0.5 };
    [(index as f64 - 0.5).max(0.0), upper]
}

/// dωi dωo of a cell.
fn solid_angles(theta_h: usize, theta_d: usize) -> f64 {
    let [a, b] = ends(theta_h, SIZE[0]).map(theta_h_of);
    let [c, d] = ends(theta_d, SIZE[1]).map(theta_d_of);
    let of_h = a.cos() - b.cos();
    // ∫ 4 cosθ sinθ dθ = 2 sin²θ.
    let of_d = 2.0 * (d.sin().powi(2) - c.sin().powi(2));
    TAU * 2.0 * of_h * of_d * PI / SIZE[2] as f64
}

fn index(theta_h: usize, theta_d: usize, phi_d: usize) -> usize {
    phi_d + SIZE[2] * (theta_d + SIZE[1] * theta_h)
}

fn indices(index: usize) -> [usize; 3] {
    let row = index / SIZE[2];
    [row / SIZE[1], row % SIZE[1], index % SIZE[2]]
}

fn is_measured(cell: &[f64; 3]) -> bool {
    // One negative colour marks the whole cell.
    cell.iter().all(|value| *value >= 0.0)
}
