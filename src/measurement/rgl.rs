//! RGL `.bsdf`: an adaptive parameterisation (Dupuy and Jakob 2018), isotropic, in RGB.
//!
//! # Formula
//!
//! With u(θ) = √(2θ/π) and v(φ) = (φ + π)/2π, m the half vector and all azimuths counted from wi,
//!
//! ```text
//! s = warp of `vndf` at θi, inverted at (u(θm), v(φm))
//! f(wi, wo) cosθo = rgb(θi, s) · ndf(u(θm), v(φm)) / (4 · sigma(u(θi), v(0)))
//! ```
//!
//! The tables are linear in x, y and θi. A file thus holds f cosθo, which Mitsuba's plugin
//! `measured` returns as it is.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::io::{self, Read, Seek, Write};

use glam::{DVec2, DVec3};

use crate::brdf::Reflectance;
use crate::math::direction::{above_horizon, cos_theta, normalised, sin_theta, spherical};
use crate::measurement::Sample;
use crate::measurement::error::{Problem, TensorProblem};
use crate::measurement::tensor_file::{self, Data, Tensor, TensorFile};
use crate::measurement::warp::{Grid, Place, Warp};

/// The names of the fields.
mod field {
    pub const DESCRIPTION: &str = "description";
    pub const JACOBIAN: &str = "jacobian";
    pub const PHI_I: &str = "phi_i";
    pub const THETA_I: &str = "theta_i";
    pub const NDF: &str = "ndf";
    pub const SIGMA: &str = "sigma";
    pub const VNDF: &str = "vndf";
    pub const LUMINANCE: &str = "luminance";
    pub const RGB: &str = "rgb";
    /// Of spectral files.
    pub const WAVELENGTHS: &str = "wavelengths";
}

/// The most azimuths of incidence that count as isotropic, as in every reader.
const MAX_AZIMUTHS: u64 = 2;

/// Largest size along each axis of a table: no file comes near it.
const MAX_NODES: u64 = 1 << 16;

/// Two-dimensional layers of one colour each.
const COLOURS: usize = 3;

/// The tables of an isotropic RGB file.
///
/// # Example
///
/// ```no_run
/// use sgdbake::{MaskingKind, Rgl, SgdBrdf, named};
///
/// let brdf = SgdBrdf::new(named("gold-paint")?, MaskingKind::Fitted);
/// let rgl = Rgl::tabulate(&brdf, "gold paint".to_owned(), &|| ());
/// rgl.write_to(&mut std::fs::File::create("gold-paint.bsdf")?)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Rgl {
    /// Description in the file.
    pub description: String,
    /// Azimuths of incidence; the tables of the first are used.
    pub(super) phi_i: Vec<f32>,
    /// Angles of incidence, ascending \[rad\].
    pub(super) theta_i: Vec<f32>,
    pub(super) ndf: Grid,
    pub(super) sigma: Grid,
    pub(super) vndf: Warp,
    /// Density of s, for sampling only.
    pub(super) luminance: Grid,
    /// Layers of red, green and blue for each θi.
    pub(super) rgb: Grid,
    /// True if ndf/(4 sigma) is a factor.
    pub(super) jacobian: bool,
}

impl Rgl {
    /// Reads a file of `length` bytes.
    pub(super) fn read(reader: &mut (impl Read + Seek), length: u64) -> Result<Self, Problem> {
        let mut file = TensorFile::open(reader, length)?;
        // First, so that a spectral file is named as such and not by the `rgb` that it lacks.
        if file.has(field::WAVELENGTHS) {
            return Err(Problem::Spectral);
        }
        let description = String::from_utf8_lossy(&file.bytes(field::DESCRIPTION)?).into_owned();
        let [azimuths] = file.shape(field::PHI_I)?;
        if azimuths > MAX_AZIMUTHS {
            return Err(Problem::Anisotropic(azimuths));
        }
        let phi_i = ascending(&mut file, field::PHI_I)?;
        let theta_i = ascending(&mut file, field::THETA_I)?;
        let series = [azimuths, theta_i.len() as u64];
        let ndf = grid(&mut file, field::NDF, [])?;
        let sigma = grid(&mut file, field::SIGMA, [])?;
        positive(field::SIGMA, &sigma)?;
        let vndf = Warp::new(grid(&mut file, field::VNDF, series)?).ok_or_else(|| {
            let needed = "a positive number in each table";
            TensorProblem::Value { name: field::VNDF, found: "0".into(), index: 0, needed }
        })?;
        let luminance = grid(&mut file, field::LUMINANCE, series)?;
        let rgb = rgb(&mut file, series, &luminance)?;
        let jacobian = file.bytes(field::JACOBIAN)?.first().is_some_and(|byte| *byte != 0);
        Ok(Self { description, phi_i, theta_i, ndf, sigma, vndf, luminance, rgb, jacobian })
    }

    /// Writes the file.
    ///
    /// # Errors
    ///
    /// The writer's.
    pub fn write_to(&self, writer: &mut impl Write) -> io::Result<()> {
        let series = [self.phi_i.len(), self.theta_i.len()];
        let description = self.description.as_bytes();
        let jacobian = [u8::from(self.jacobian)];
        let of_colours = [series[0], series[1], COLOURS];
        tensor_file::write(
            writer,
            &[
                Tensor {
                    name: field::DESCRIPTION,
                    shape: vec![description.len()],
                    data: Data::U8(description),
                },
                Tensor { name: field::JACOBIAN, shape: vec![1], data: Data::U8(&jacobian) },
                series_tensor(field::PHI_I, &self.phi_i),
                series_tensor(field::THETA_I, &self.theta_i),
                grid_tensor(field::NDF, &[], &self.ndf),
                grid_tensor(field::SIGMA, &[], &self.sigma),
                grid_tensor(field::VNDF, &series, &self.vndf.density),
                grid_tensor(field::LUMINANCE, &series, &self.luminance),
                grid_tensor(field::RGB, &of_colours, &self.rgb),
            ],
        )
    }

    /// The nodes of the file whose half vector reflects wi above the horizon.
    ///
    /// A sample's weight is dωi dωo: the ring of its θi, up to the midpoints to the next, times
    /// the solid angle of wo that its part of the square s is mapped to.
    pub fn samples(&self) -> impl Iterator<Item = Sample> + '_ {
        (0..self.theta_i.len()).flat_map(move |i| {
            let ring = self.ring(i);
            let [columns, rows] = self.rgb.size;
            (0..rows * columns).filter_map(move |node| self.sample(i, node, ring))
        })
    }

    fn sample(&self, incidence: usize, node: usize, ring: f64) -> Option<Sample> {
        let columns = self.rgb.size[0];
        let (column, row) = (node % columns, node / columns);
        let theta_i = f64::from(self.theta_i[incidence]);
        let place = Place::of(theta_i, &self.theta_i);
        // An isotropic table depends on azimuths relative to wi alone: any will do.
        let wi = spherical(theta_i, 0.0);
        let s = self.rgb.node(column, row);
        let (at, density) = self.vndf.sample(s, place);
        let m = half_vector_at(at);
        let wo = 2.0 * wi.dot(m) * m - wi;
        // From the square's unit to that of solid angle; negative where m faces away from wi.
        let density = density / solid_angle_of_wo(at, wi, m);
        (above_horizon(wi) && above_horizon(wo) && density > 0.0).then(|| Sample {
            wi,
            wo,
            f: self.eval(wi, wo),
            weight: ring * share_of_square(self.rgb.size, column, row) / density,
        })
    }

    /// 2π (cos a − cos b) between the midpoints to the angles of incidence before and after.
    fn ring(&self, incidence: usize) -> f64 {
        let last = self.theta_i.len() - 1;
        // The first and the last ring reach to the normal and to the horizon.
        let a = if incidence == 0 { 0.0 } else { self.midpoint(incidence - 1) };
        let b = if incidence == last { FRAC_PI_2 } else { self.midpoint(incidence) };
        TAU * (a.cos() - b.cos()).max(0.0)
    }

    /// The middle between an angle of incidence and the next.
    fn midpoint(&self, incidence: usize) -> f64 {
        0.5 * (f64::from(self.theta_i[incidence]) + f64::from(self.theta_i[incidence + 1]))
    }

    /// ndf/(4 sigma), or 1 where the file has it in its values.
    pub(super) fn jacobian(&self, at: DVec2, theta_i: f64) -> f64 {
        if !self.jacobian {
            return 1.0;
        }
        let sigma = self.sigma.eval(DVec2::new(u_of(theta_i), 0.5), Place::ONLY);
        self.ndf.eval(at, Place::ONLY) / (4.0 * sigma)
    }
}

impl Reflectance for Rgl {
    /// f(wi, wo) \[1/sr\]; 0 below the horizon. Negative values, which colours outside the gamut
    /// have, are 0.
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let m = normalised(wi + wo).filter(|_| above_horizon(wi) && above_horizon(wo));
        let Some(m) = m else { return [0.0; 3] };
        let theta_i = theta(wi);
        let place = Place::of(theta_i, &self.theta_i);
        let at = half_vector(m, wi.y.atan2(wi.x));
        let (s, _) = self.vndf.invert(at, place);
        let scale = self.jacobian(at, theta_i) / cos_theta(wo);
        std::array::from_fn(|c| self.rgb.layer(s, place, c, COLOURS).max(0.0) * scale)
    }
}

/// The point of the square of a half vector, its azimuth counted from that of wi.
pub(super) fn half_vector(m: DVec3, phi_i: f64) -> DVec2 {
    let turns = (m.y.atan2(m.x) - phi_i + PI) / TAU;
    DVec2::new(u_of(theta(m)), turns - turns.floor())
}

/// The half vector at a point of the square, for wi in the half plane φ = 0.
pub(super) fn half_vector_at(at: DVec2) -> DVec3 {
    spherical(FRAC_PI_2 * at.x * at.x, TAU * at.y - PI)
}

/// dωo/d(u, v) = 4 wi·m · 2π² u sinθm, bounded below as in every reader.
pub(super) fn solid_angle_of_wo(at: DVec2, wi: DVec3, m: DVec3) -> f64 {
    (2.0 * PI * PI * at.x * sin_theta(m)).max(1e-6) * 4.0 * wi.dot(m)
}

/// u = √(2θ/π).
pub(super) fn u_of(theta: f64) -> f64 {
    (theta / FRAC_PI_2).sqrt()
}

/// The polar angle, accurate at the normal.
fn theta(w: DVec3) -> f64 {
    // acos(cosθ) loses half of the digits at the normal.
    sin_theta(w).atan2(w.z)
}

/// A node's share of the unit square: half as wide on an edge.
fn share_of_square([columns, rows]: [usize; 2], column: usize, row: usize) -> f64 {
    share_of_side(columns, column) * share_of_side(rows, row)
}

/// A node's share of a side with `count` nodes.
fn share_of_side(count: usize, node: usize) -> f64 {
    let width = if node == 0 || node + 1 == count { 0.5 } else { 1.0 };
    width / (count - 1) as f64
}

/// The field that holds the angles of a series.
fn series_tensor<'a>(name: &'static str, angles: &'a [f32]) -> Tensor<'a> {
    Tensor { name, shape: vec![angles.len()], data: Data::F32(angles) }
}

/// The field that holds a grid for each member of a series.
fn grid_tensor<'a>(name: &'static str, series: &[usize], grid: &'a Grid) -> Tensor<'a> {
    let [columns, rows] = grid.size;
    Tensor { name, shape: [series, &[rows, columns]].concat(), data: Data::F32(&grid.values) }
}

/// A field of angles in ascending order.
fn ascending<R: Read + Seek>(
    file: &mut TensorFile<'_, R>,
    name: &'static str,
) -> Result<Vec<f32>, Problem> {
    let shape: [u64; 1] = file.shape(name)?;
    // f32::MIN as the least value lets every finite number pass.
    let angles = file.floats(name, &shape, f32::MIN)?;
    if angles.is_empty() || angles.windows(2).any(|pair| pair[0] >= pair[1]) {
        let needed = "f32 angles, at least one, in ascending order".into();
        let found = format!("f32 {shape:?} in another order");
        return Err(TensorProblem::Shape { name, found, needed }.into());
    }
    Ok(angles)
}

/// A field of tables ≥ 0, one for each of `series`.
fn grid<R: Read + Seek, const SERIES: usize>(
    file: &mut TensorFile<'_, R>,
    name: &'static str,
    series: [u64; SERIES],
) -> Result<Grid, Problem> {
    let [rows, columns] = if SERIES == 0 {
        file.shape::<2>(name)?
    } else {
        let [_, _, rows, columns] = file.shape::<4>(name)?;
        [rows, columns]
    };
    // Two nodes make a cell; interpolation would have none of a single one.
    if ![rows, columns].iter().all(|n| (2..=MAX_NODES).contains(n)) {
        let found = format!("tables of {rows} × {columns}");
        let needed = format!("tables of 2 to {MAX_NODES} nodes along each axis");
        return Err(TensorProblem::Shape { name, found, needed }.into());
    }
    let shape = [&series[..], &[rows, columns]].concat();
    let values = file.floats(name, &shape, 0.0)?;
    Ok(Grid { size: [columns as usize, rows as usize], values })
}

/// The layers of red, green and blue, on the nodes of `luminance`.
fn rgb<R: Read + Seek>(
    file: &mut TensorFile<'_, R>,
    [azimuths, angles]: [u64; 2],
    luminance: &Grid,
) -> Result<Grid, Problem> {
    let [columns, rows] = luminance.size;
    let shape = [azimuths, angles, COLOURS as u64, rows as u64, columns as u64];
    let values = file.floats(field::RGB, &shape, f32::MIN)?;
    Ok(Grid { size: luminance.size, values })
}

/// Refuses a divisor of f that is 0.
fn positive(name: &'static str, grid: &Grid) -> Result<(), TensorProblem> {
    let zero = grid.values.iter().position(|value| *value <= 0.0);
    zero.map_or(Ok(()), |index| {
        let (found, needed) = (grid.values[index].to_string(), "a positive number");
        Err(TensorProblem::Value { name, found, index, needed })
    })
}
