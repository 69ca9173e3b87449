//! A table of samples at any pairs of directions, as `.csv`.
//!
//! The header names the columns: `theta_i, phi_i, theta_o, phi_o` in degrees, or
//! `wi_x, wi_y, wi_z, wo_x, wo_y, wo_z`; then `r, g, b`, the reflectance in 1/sr. Their order is
//! free, other columns are passed over; commas, semicolons or tabs part them, `#` begins a comment.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::io::BufRead;

use csv::{ReaderBuilder, StringRecord};
use glam::{DVec3, Vec3};
use kd_tree::KdTree4;

use crate::brdf::Reflectance;
use crate::math::direction::{above_horizon, normalised, spherical};
use crate::measurement::error::{Problem, RowProblem};
use crate::measurement::half_difference::HalfDifference;
use crate::measurement::{NOT_MEASURED, Sample};

/// Samples that a value is made of.
const NEIGHBOURS: usize = 8;

/// How far the nearest sample may be, in the coordinates of [`place`]: 10° in θd, or 1.3° of θh at
/// the mirror direction.
const FARTHEST: f32 = 0.12;

/// Samples at any pairs of directions.
///
/// # Formula
///
/// Between samples, inverse distances with the radius of the eighth-nearest (Renka's form of
/// Shepard's method, 1988), in coordinates where pairs that differ by a turn about the normal
/// coincide, and φd counts for nothing where θh or θd is 0:
///
/// ```text
/// a = √(2θh/π),  b = 2θd/π:   (a, b, ab cosφd, ab sinφd)
/// f = Σ w f / Σ w,  w = ((R − d)/(R d))²
/// ```
#[derive(Clone, Debug)]
pub struct Scattered {
    rows: KdTree4<Row>,
}

/// One sample, in single precision: measurements have fewer digits, and the list is the tree.
#[derive(Clone, Copy, Debug)]
struct Row {
    place: [f32; 4],
    wi: Vec3,
    wo: Vec3,
    f: Vec3,
}

impl Scattered {
    /// Reads the table; its header is line 1.
    pub(super) fn read(reader: impl BufRead, delimiter: u8) -> Result<Self, Problem> {
        let mut csv = ReaderBuilder::new()
            .delimiter(delimiter)
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(reader);
        let columns = Columns::of(csv.headers().map_err(|error| unreadable(error, 1))?)?;
        let mut rows = Vec::new();
        let mut record = StringRecord::new();
        loop {
            // An error need not hold a line: that of the record's start is kept for it.
            let next = csv.position().line();
            match csv.read_record(&mut record) {
                Ok(true) => {}
                Ok(false) => break,
                Err(error) => return Err(unreadable(error, next)),
            }
            let line = record.position().map_or(next, csv::Position::line);
            rows.push(columns.row(&record).map_err(|problem| Problem::Row { line, problem })?);
        }
        if rows.is_empty() {
            return Err(Problem::NothingMeasured);
        }
        let rows = KdTree4::build_by(rows, |a, b, axis| a.place[axis].total_cmp(&b.place[axis]));
        Ok(Self { rows })
    }

    /// f at the angles of a pair; [`NOT_MEASURED`] far from every sample.
    #[must_use]
    pub fn value(&self, angles: HalfDifference) -> [f64; 3] {
        let found = self.rows.nearests_by(&place(angles), NEIGHBOURS, |row, axis| row.place[axis]);
        let near: Vec<(f32, DVec3)> = found
            .into_iter()
            .map(|near| (near.squared_distance.sqrt(), near.item.f.as_dvec3()))
            .collect();
        match near[..] {
            [] => NOT_MEASURED,
            [(nearest, _), ..] if nearest > FARTHEST => NOT_MEASURED,
            _ => shepard(&near).to_array(),
        }
    }

    /// The samples, in the order of the tree.
    ///
    /// Where they are dense each stands for a smaller part of ∫∫ dωi dωo: that of its box in
    /// (√θh, θd, φd) over the samples in it.
    pub fn samples(&self) -> impl Iterator<Item = Sample> + '_ {
        let boxes: Vec<usize> = self.rows.iter().map(Row::bin).collect();
        let mut count = vec![0_u32; BINS.iter().product()];
        boxes.iter().for_each(|bin| count[*bin] += 1);
        self.rows.iter().zip(boxes).map(move |(row, bin)| Sample {
            wi: row.wi.as_dvec3(),
            wo: row.wo.as_dvec3(),
            f: row.f.as_dvec3().to_array(),
            weight: solid_angles(bin) / f64::from(count[bin]),
        })
    }
}

impl Reflectance for Scattered {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !(above_horizon(wi) && above_horizon(wo)) {
            return [0.0; 3];
        }
        self.value(HalfDifference::of(wi, wo))
    }
}

/// The weighted mean of samples by their distances, ascending.
fn shepard(near: &[(f32, DVec3)]) -> DVec3 {
    let (nearest, exact) = near[0];
    // The farthest has no weight, so that the value changes smoothly as another takes its place.
    let radius = f64::from(near[near.len() - 1].0);
    // At a sample, or with all equally far, the weights are ∞ or 0: the mean of the nearest.
    if nearest < 1e-6 || radius <= f64::from(nearest) {
        let same = near.iter().filter(|(distance, _)| *distance <= nearest.max(1e-6));
        let count = same.clone().count();
        return if count > 0 { same.map(|(_, f)| *f).sum::<DVec3>() / count as f64 } else { exact };
    }
    let weighted = near.iter().map(|(distance, f)| {
        let distance = f64::from(*distance);
        (((radius - distance) / (radius * distance)).powi(2), *f)
    });
    let (total, sum) =
        weighted.fold((0.0, DVec3::ZERO), |(total, sum), (w, f)| (total + w, sum + w * f));
    sum / total
}

/// The coordinates in which samples are near each other.
fn place(angles: HalfDifference) -> [f32; 4] {
    // The root spreads the highlight, as MERL's cells do.
    let a = (angles.theta_h / FRAC_PI_2).sqrt();
    let b = angles.theta_d / FRAC_PI_2;
    [a, b, a * b * angles.phi_d.cos(), a * b * angles.phi_d.sin()].map(|x| x as f32)
}

/// Boxes along √θh, θd and φd.
const BINS: [usize; 3] = [18, 18, 24];

impl Row {
    /// The box that the sample lies in.
    fn bin(&self) -> usize {
        let angles = HalfDifference::of(self.wi.as_dvec3(), self.wo.as_dvec3());
        let shares =
            [(angles.theta_h / FRAC_PI_2).sqrt(), angles.theta_d / FRAC_PI_2, angles.phi_d / TAU];
        let [h, d, phi] =
            [0, 1, 2].map(|i| ((shares[i] * BINS[i] as f64) as usize).min(BINS[i] - 1));
        phi + BINS[2] * (d + BINS[1] * h)
    }
}

/// 2π sinθh dθh · 4 cosθd sinθd dθd · dφd over a box.
fn solid_angles(bin: usize) -> f64 {
    let row = bin / BINS[2];
    let [a, b] = ends(row / BINS[1], BINS[0]).map(|x| (FRAC_PI_2 * x * x).cos());
    let [c, d] = ends(row % BINS[1], BINS[1]).map(|x| (FRAC_PI_2 * x).sin().powi(2));
    TAU * (a - b) * 2.0 * (d - c) * TAU / BINS[2] as f64
}

/// Where one of `count` boxes starts and ends in [0, 1].
fn ends(index: usize, count: usize) -> [f64; 2] {
    [index, index + 1].map(|edge| edge as f64 / count as f64)
}

/// Where the columns of a row are.
struct Columns {
    directions: Directions,
    rgb: [usize; 3],
}

enum Directions {
    /// θi, φi, θo, φo.
    Degrees([usize; 4]),
    /// wi, wo.
    Vectors([usize; 6]),
}

const ANGLES: [&str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];
const VECTORS: [&str; 6] = ["wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z"];
const COLOURS: [&str; 3] = ["r", "g", "b"];

impl Columns {
    fn of(header: &StringRecord) -> Result<Self, Problem> {
        let degrees = find(header, ANGLES).map(Directions::Degrees);
        let directions = degrees.or_else(|| find(header, VECTORS).map(Directions::Vectors));
        match (directions, find(header, COLOURS)) {
            (Some(directions), Some(rgb)) => Ok(Self { directions, rgb }),
            _ => {
                let text: String = header.iter().collect::<Vec<_>>().join(",");
                Err(Problem::Header(text.chars().take(80).collect()))
            }
        }
    }

    fn row(&self, record: &StringRecord) -> Result<Row, RowProblem> {
        let (wi, wo) = match self.directions {
            Directions::Degrees(columns) => {
                let [theta_i, phi_i, theta_o, phi_o] = numbers(record, ANGLES, columns)?;
                (degrees(theta_i, phi_i), degrees(theta_o, phi_o))
            }
            Directions::Vectors(columns) => {
                let [a, b, c, d, e, f] = numbers(record, VECTORS, columns)?;
                (normalised(DVec3::new(a, b, c)), normalised(DVec3::new(d, e, f)))
            }
        };
        let rgb = numbers(record, COLOURS, self.rgb)?;
        for (column, found) in COLOURS.into_iter().zip(rgb) {
            if found < 0.0 {
                return Err(RowProblem::Negative { column, found });
            }
        }
        let wi = kept(wi).ok_or(RowProblem::Direction("wi"))?;
        let wo = kept(wo).ok_or(RowProblem::Direction("wo"))?;
        // Of the directions as they are kept, so that a sample is found at its own pair.
        let place = place(HalfDifference::of(wi.as_dvec3(), wo.as_dvec3()));
        Ok(Row { place, wi, wo, f: DVec3::from(rgb).as_vec3() })
    }
}

/// The direction in the precision that it is kept in, if it is above the horizon in that.
fn kept(w: Option<DVec3>) -> Option<Vec3> {
    w.map(DVec3::as_vec3).filter(|w| above_horizon(w.as_dvec3()))
}

/// The columns with these names, if all are there.
fn find<const N: usize>(header: &StringRecord, names: [&str; N]) -> Option<[usize; N]> {
    let mut columns = [0; N];
    for (column, name) in columns.iter_mut().zip(names) {
        *column = header.iter().position(|found| found.eq_ignore_ascii_case(name))?;
    }
    Some(columns)
}

fn numbers<const N: usize>(
    record: &StringRecord,
    names: [&'static str; N],
    columns: [usize; N],
) -> Result<[f64; N], RowProblem> {
    let mut numbers = [0.0; N];
    for (i, (column, name)) in columns.into_iter().zip(names).enumerate() {
        let found = record.get(column).unwrap_or("");
        // A NaN fails the comparison; what f32 cannot hold would become infinite in a row.
        let number = found.parse::<f64>().ok().filter(|number| number.abs() <= f64::from(f32::MAX));
        numbers[i] = number.ok_or_else(|| RowProblem::NotANumber {
            column: name,
            found: found.chars().take(40).collect(),
        })?;
    }
    Ok(numbers)
}

/// A direction in degrees; a negative θ lies on the other side of the normal.
fn degrees(theta: f64, phi: f64) -> Option<DVec3> {
    (theta.abs() < 90.0).then(|| spherical(theta.to_radians(), phi.to_radians()))
}

fn unreadable(error: csv::Error, line: u64) -> Problem {
    let line = error.position().map_or(line, csv::Position::line);
    match error.into_kind() {
        csv::ErrorKind::Io(error) => Problem::Unreadable(error),
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            let problem = format!("{len} columns, where the header has {expected_len}");
            Problem::Row { line, problem: RowProblem::Malformed(problem) }
        }
        _ => Problem::Row { line, problem: RowProblem::Malformed("not UTF-8 text".into()) },
    }
}
