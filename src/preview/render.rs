//! The picture of a shape under an environment, by Monte Carlo integration.

use glam::{DMat3, DVec3};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use crate::brdf::batch::{Draws, Pairs, SamplerBatch, SamplesMut};
use crate::brdf::{MaskingKind, Reflectance, SgdBrdf};
use crate::material::{Material, catalog};
use crate::math::direction::{above_horizon, spherical};
use crate::preview::ball::{TO_VIEWER, frame};
use crate::preview::colour::luminance;
use crate::preview::environment::{Arriving, Environment};
use crate::preview::film::{Film, Pixel};
use crate::preview::shape::{Hit, Shape};

/// How large a picture is and how much work goes into it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quality {
    /// Width and height in pixels.
    pub size: usize,
    /// Directions to the light per pixel, rounded up to a multiple of [`DIRECTIONS`]; at least two
    /// points of a pixel are looked at, so that its noise can be estimated.
    pub samples: usize,
    /// The same seed gives the same picture, on any number of threads.
    pub seed: u64,
}

/// A picture and how noisy it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Render {
    /// The picture.
    pub film: Film,
    /// Root mean square over the object of a pixel's standard error of luminance, relative to the
    /// object's mean luminance. An upper bound: it takes the points of a pixel for independent,
    /// while they are spread evenly.
    pub noise: f64,
}

/// Directions traced from one point of a pixel: half drawn where the environment is bright, half
/// where the surface reflects.
pub const DIRECTIONS: usize = 16;

/// One picture per model, `row_done` called after each row.
///
/// All models see the same directions, drawn from `surface`: their noise is nearly the same and
/// cancels in the difference of two pictures.
///
/// # Formula
///
/// L = ∫ f(wi, wo) L(wi) cosθi dωi ≈ 1/n Σ f L cosθi/q, with n/2 directions from each of two
/// densities and q = (p_environment + p_surface)/2: the balance heuristic of Veach and Guibas
/// (1995).
///
/// # Example
///
/// ```
/// use sgdbake::preview::render::{Quality, drawn_from};
/// use sgdbake::{Environment, MaskingKind, SgdBrdf, Shape, named, render};
///
/// let gold = named("gold-paint")?;
/// let brdf = SgdBrdf::new(gold, MaskingKind::Fitted);
/// let quality = Quality { size: 16, samples: 32, seed: 1 };
/// let [picture] = render(
///     &Shape::Ball, &Environment::studio(), &drawn_from(gold), [&brdf], quality, &|| (),
/// );
/// let centre = picture.film.pixels[8 * 16 + 8].rgb;
/// assert!(centre[0] > centre[2], "gold is yellow");
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
#[must_use]
pub fn render<const MODELS: usize>(
    shape: &Shape,
    environment: &Environment,
    surface: &SamplerBatch,
    models: [&dyn Reflectance; MODELS],
    quality: Quality,
    row_done: &(dyn Fn() + Sync),
) -> [Render; MODELS] {
    let view = View { shape, environment, surface, models, quality };
    let rows: Vec<Vec<[Seen; MODELS]>> = (0..quality.size)
        .into_par_iter()
        .map(|row| {
            // One memory for all pixels of a row.
            let mut paths = Paths::default();
            let seen =
                (0..quality.size).map(|column| view.pixel(column, row, &mut paths)).collect();
            row_done();
            seen
        })
        .collect();
    std::array::from_fn(|model| {
        // Summed row by row in order, so that the noise has the same bits on any number of threads.
        develop(quality.size, rows.iter().flatten().map(|seen| seen[model]))
    })
}

/// What the directions for a material are drawn from: its own visible normals.
#[must_use]
pub fn drawn_from(material: &Material) -> SamplerBatch {
    SamplerBatch::new(material, MaskingKind::Exact)
}

/// The sampler of directions for a reflectance without parameters: that of the material of
/// the catalogue whose values are nearest to its own.
///
/// # Panics
///
/// Never: the catalogue is not empty.
#[must_use]
pub fn drawn_like(reflectance: &dyn Reflectance) -> SamplerBatch {
    let seen = logarithms(reflectance);
    let materials = catalog().iter().map(|entry| {
        let known = logarithms(&SgdBrdf::new(&entry.material, MaskingKind::Fitted));
        let differences = known.iter().zip(&seen).filter(|(_, seen)| seen.is_finite());
        let distance = differences.map(|(known, seen)| (known - seen).powi(2)).sum::<f64>();
        (distance, &entry.material)
    });
    let nearest = materials.min_by(|a, b| a.0.total_cmp(&b.0));
    drawn_from(nearest.expect("the catalogue is not empty").1)
}

/// ln f, the mean of the colours, at half vectors ever farther from the normal, beside the plane
/// of incidence.
fn logarithms(reflectance: &dyn Reflectance) -> Vec<f64> {
    const COUNT: i32 = 24;
    let values = (0..COUNT).map(|i| {
        // Squared: denser near the normal, where sharp lobes differ.
        let theta_h = 1.4 * (f64::from(i) / f64::from(COUNT)).powi(2);
        let (h, aside) = (spherical(theta_h, 0.0), DVec3::new(0.0, 0.3, 0.0));
        let [wi, wo] = [h + aside, h - aside].map(DVec3::normalize);
        let grey = reflectance.eval(wi, wo).iter().sum::<f64>() / 3.0;
        // f is 0 or negative where a curve F is.
        grey.max(1e-6).ln()
    });
    values.collect()
}

/// A pixel and the squared standard error of its luminance.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    pixel: Pixel,
    variance: f64,
}

fn develop(size: usize, seen: impl Iterator<Item = Seen> + Clone) -> Render {
    let covered = seen.clone().filter(|seen| seen.pixel.alpha > 0.0);
    let count = covered.clone().count().max(1) as f64;
    let mean = covered.clone().map(|seen| luminance(seen.pixel.rgb)).sum::<f64>() / count;
    let variance = covered.map(|seen| seen.variance).sum::<f64>() / count;
    let noise = if mean > 0.0 { variance.sqrt() / mean } else { 0.0 };
    Render {
        film: Film { width: size, height: size, pixels: seen.map(|s| s.pixel).collect() },
        noise,
    }
}

struct View<'a, const MODELS: usize> {
    shape: &'a Shape,
    environment: &'a Environment,
    surface: &'a SamplerBatch,
    models: [&'a dyn Reflectance; MODELS],
    quality: Quality,
}

/// The directions of one pixel; kept between pixels for its memory.
#[derive(Default)]
struct Paths {
    points: Vec<Point>,
    lit: Lit,
    drawn: Drawn,
    pairs: Vec<[DVec3; 2]>,
    /// L cosθi/q of a pair, and the point it belongs to.
    light: Vec<([f64; 3], usize)>,
    f: Vec<[f64; 3]>,
    reflected: Vec<DVec3>,
}

/// A point of the shape within a pixel.
#[derive(Clone, Copy)]
struct Point {
    hit: Hit,
    to_world: DMat3,
    /// The direction to the viewer in the point's frame.
    wo: DVec3,
}

/// A vector for each direction, a column per component.
type Columns = [Vec<f32>; 3];

/// Directions drawn where the environment is bright.
#[derive(Default)]
struct Lit {
    /// The point of each, wi and the light.
    lamps: Vec<(usize, DVec3, Arriving)>,
    wi: Columns,
    wo: Columns,
    /// The surface's densities.
    pdf: Vec<f32>,
}

/// Directions drawn where the surface reflects, [`OF_EACH`] of each point in turn.
#[derive(Default)]
struct Drawn {
    wo: Columns,
    u: Columns,
    wi: Columns,
    weight: Columns,
    pdf: Vec<f32>,
}

/// Directions of a point that either technique draws.
const OF_EACH: usize = DIRECTIONS / 2;

impl<const MODELS: usize> View<'_, MODELS> {
    fn pixel(&self, column: usize, row: usize, paths: &mut Paths) -> [Seen; MODELS] {
        let index = (row * self.quality.size + column) as u64;
        // A stream for each pixel: its directions do not depend on the thread that draws them.
        let mut rng = Pcg64Mcg::seed_from_u64(self.quality.seed ^ (index + 1).wrapping_mul(STREAM));
        // A standard error takes two.
        let points = self.quality.samples.div_ceil(DIRECTIONS).max(2);
        paths.clear();
        // A random start for each pixel turns the regularity of one sequence into noise.
        let start = Start { point: rng.random(), light: rng.random(), surface: rng.random() };
        for point in 0..points {
            let [x, y] = self.picture_point(column, row, spread(start.point, R2, point));
            if let Some(hit) = self.shape.seen_at(x, y) {
                self.trace(&hit, &start, point, paths);
            }
        }
        self.connect_lit(paths);
        self.connect_drawn(paths);
        let alpha = paths.points.len() as f64 / points as f64;
        self.models.map(|model| paths.seen(model, alpha))
    }

    /// The picture plane's point at `offset` in [0, 1)² of a pixel.
    fn picture_point(&self, column: usize, row: usize, offset: [f64; 2]) -> [f64; 2] {
        let scale = 2.0 / self.quality.size as f64;
        [(column as f64 + offset[0]) * scale - 1.0, 1.0 - (row as f64 + offset[1]) * scale]
    }

    /// Directions to light from one point, and numbers for as many along which it reflects.
    fn trace(&self, hit: &Hit, start: &Start, point: usize, paths: &mut Paths) {
        let to_world = frame(hit.normal);
        let to_local = to_world.transpose();
        let wo = to_local * TO_VIEWER;
        let place = paths.points.len();
        paths.points.push(Point { hit: *hit, to_world, wo });
        // On from the last point: the sequences fill the whole pixel evenly, not each point.
        for index in point * OF_EACH..(point + 1) * OF_EACH {
            let lamp = self.environment.sample(spread(start.light, R2, index));
            let wi = to_local * lamp.direction;
            if above_horizon(wi) && !self.shape.shadows(hit, lamp.direction) {
                paths.lit.lamps.push((place, wi, lamp));
                push(&mut paths.lit.wi, wi.to_array());
                push(&mut paths.lit.wo, wo.to_array());
            }
            push(&mut paths.drawn.u, spread(start.surface, R3, index));
            push(&mut paths.drawn.wo, wo.to_array());
        }
    }

    /// Light along the directions that the environment drew.
    fn connect_lit(&self, paths: &mut Paths) {
        let Lit { lamps, wi, wo, pdf } = &mut paths.lit;
        pdf.resize(lamps.len(), 0.0);
        let weighed = self.surface.pdf(&Pairs { wi: slices(wi), wo: slices(wo) }, pdf);
        weighed.expect("all columns have one length");
        for ((point, wi, lamp), pdf) in lamps.iter().zip(&*pdf) {
            let light = lamp.shared_with((*pdf).into(), wi.z);
            paths.pairs.push([*wi, paths.points[*point].wo]);
            paths.light.push((light, *point));
        }
    }

    /// Light along directions that the surface draws.
    fn connect_drawn(&self, paths: &mut Paths) {
        let Drawn { wo, u, wi, weight, pdf } = &mut paths.drawn;
        let count = u[0].len();
        wi.iter_mut().chain(&mut *weight).chain([&mut *pdf]).for_each(|c| c.resize(count, 0.0));
        let drawn = self.surface.sample(
            &Draws { wo: slices(wo), u: slices(u) },
            &mut SamplesMut {
                wi: wi.each_mut().map(Vec::as_mut_slice),
                weight: weight.each_mut().map(Vec::as_mut_slice),
                pdf,
            },
        );
        drawn.expect("all columns have one length");
        let directions = pdf.chunks(OF_EACH).zip(&paths.points).enumerate();
        for (place, (densities, Point { hit, to_world, wo })) in directions {
            for (index, pdf) in (place * OF_EACH..).zip(densities) {
                let wi = DVec3::from(wi.each_ref().map(|column| f64::from(column[index])));
                let to_light = *to_world * wi;
                if *pdf > 0.0 && !self.shape.shadows(hit, to_light) {
                    let lamp = self.environment.look(to_light);
                    paths.pairs.push([wi, *wo]);
                    paths.light.push((lamp.shared_with((*pdf).into(), wi.z), place));
                }
            }
        }
    }
}

impl Arriving {
    /// L cosθi/q, q the mean of this light's density and the surface's: both techniques count,
    /// whichever drew the direction (the balance heuristic).
    fn shared_with(&self, pdf: f64, cos_theta_i: f64) -> [f64; 3] {
        let scale = cos_theta_i / (0.5 * (self.pdf + pdf));
        self.radiance.map(|radiance| radiance * scale)
    }
}

fn push(columns: &mut Columns, vector: [f64; 3]) {
    for (column, component) in columns.iter_mut().zip(vector) {
        column.push(component as f32);
    }
}

fn slices(columns: &Columns) -> [&[f32]; 3] {
    columns.each_ref().map(Vec::as_slice)
}

impl Paths {
    fn clear(&mut self) {
        self.points.clear();
        self.lit.lamps.clear();
        let Self { lit, drawn, .. } = self;
        let columns = [&mut lit.wi, &mut lit.wo, &mut drawn.wo, &mut drawn.u];
        columns.into_iter().flatten().for_each(Vec::clear);
        self.pairs.clear();
        self.light.clear();
    }

    /// The pixel if `model` reflects the light of these paths.
    fn seen(&mut self, model: &dyn Reflectance, alpha: f64) -> Seen {
        if self.points.is_empty() {
            return Seen::default();
        }
        self.f.resize(self.pairs.len(), [0.0; 3]);
        model.eval_all(&self.pairs, &mut self.f);
        self.reflected.clear();
        self.reflected.resize(self.points.len(), DVec3::ZERO);
        for (f, (light, point)) in self.f.iter().zip(&self.light) {
            // Directions below the horizon or in shadow have no pair and count as 0.
            self.reflected[*point] += DVec3::from(*f) * DVec3::from(*light);
        }
        let (mut sum, mut squares) = (DVec3::ZERO, 0.0);
        for reflected in &self.reflected {
            let reflected = *reflected / DIRECTIONS as f64;
            sum += reflected;
            squares += luminance(reflected.to_array()).powi(2);
        }
        // Points are the independent samples; the paths of one share its normal.
        let points = self.points.len() as f64;
        let mean = sum / points;
        let spread = squares / points - luminance(mean.to_array()).powi(2);
        // The difference of squares may round below 0.
        let variance = spread.max(0.0) / (points - 1.0).max(1.0);
        Seen { pixel: Pixel { rgb: mean.to_array(), alpha }, variance }
    }
}

/// An odd constant that tells the random streams of pixels apart (2⁶⁴/golden ratio).
const STREAM: u64 = 0x9e37_79b9_7f4a_7c15;

/// The start of a pixel's sequences.
struct Start {
    point: [f64; 2],
    light: [f64; 2],
    surface: [f64; 3],
}

/// Steps of Roberts' sequences: powers of the inverse of the root of xᵈ⁺¹ = x + 1, for d = 2 and 3.
const R2: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
const R3: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_97];

/// Term `index` of a sequence that fills the unit cube evenly whatever its length (Roberts 2018),
/// from a random start.
fn spread<const N: usize>(start: [f64; N], step: [f64; N], index: usize) -> [f64; N] {
    std::array::from_fn(|axis| {
        let term = start[axis] + index as f64 * step[axis];
        // As `fract`, which is a call on machines without SSE 4.1.
        term - term as u64 as f64
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::find;
    use std::f64::consts::FRAC_1_PI;

    /// Reflects half of all light, evenly.
    struct Matte;

    impl Reflectance for Matte {
        fn eval(&self, _: DVec3, _: DVec3) -> [f64; 3] {
            [0.5 * FRAC_1_PI; 3]
        }
    }

    const QUALITY: Quality = Quality { size: 24, samples: 64, seed: 7 };

    fn gold() -> (SamplerBatch, SgdBrdf) {
        let material = &find("gold-paint").expect("in the catalogue").material;
        (drawn_from(material), SgdBrdf::new(material, MaskingKind::Fitted))
    }

    #[test]
    fn a_matte_ball_in_an_even_room_has_its_albedo() {
        let room = Environment::new(8, &[[2.0; 3]; 32]).expect("lit");
        let [matte] = render(&Shape::Ball, &room, &gold().0, [&Matte], QUALITY, &|| ());
        let covered: Vec<&Pixel> = matte.film.pixels.iter().filter(|p| p.alpha == 1.0).collect();
        let mean = covered.iter().map(|p| p.rgb[1]).sum::<f64>() / covered.len() as f64;
        assert!(
            (mean - 1.0).abs() < 3.0 * matte.noise / (covered.len() as f64).sqrt() + 1e-3,
            "{mean}"
        );
        assert!(matte.noise < 0.2, "{}", matte.noise);
    }

    #[test]
    fn threads_do_not_change_the_picture() {
        let (surface, gold) = gold();
        let room = Environment::studio();
        let [one, three] = [1, 3].map(|threads| {
            let pool =
                rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| render(&Shape::Ball, &room, &surface, [&gold], QUALITY, &|| ()))
        });
        assert!(one == three);
        let other = Quality { seed: 8, ..QUALITY };
        assert!(one != render(&Shape::Ball, &room, &surface, [&gold], other, &|| ()));
    }

    /// The standard error that is stated against the scatter of pictures with other seeds.
    #[test]
    fn the_noise_is_as_stated() {
        let (surface, gold) = gold();
        let room = Environment::studio();
        let pictures: Vec<Render> = (0..8)
            .map(|seed| {
                let [picture] = render(
                    &Shape::Ball,
                    &room,
                    &surface,
                    [&gold],
                    Quality { seed, ..QUALITY },
                    &|| (),
                );
                picture
            })
            .collect();
        let (mut count, mut average, mut variance) = (0.0, 0.0, 0.0);
        for i in (0..24 * 24).filter(|i| pictures[0].film.pixels[*i].alpha == 1.0) {
            let values = pictures.iter().map(|p| luminance(p.film.pixels[i].rgb));
            let mean = values.clone().sum::<f64>() / 8.0;
            variance += values.map(|v| (v - mean).powi(2)).sum::<f64>() / 7.0;
            (average, count) = (average + mean, count + 1.0);
        }
        let measured = (variance / count).sqrt() / (average / count);
        let stated = pictures.iter().map(|p| p.noise).sum::<f64>() / 8.0;
        assert!(measured < 1.1 * stated && stated < 10.0 * measured, "{measured} {stated}");
    }
}
