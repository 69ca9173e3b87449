//! How far a model is from a measurement: in reflectance, in lightness, and in pictures.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use palette::color_difference::Ciede2000 as _;
use palette::white_point::D65;
use palette::{IntoColor as _, Lab, LinSrgb};
use serde::Serialize;

use crate::asset::Distances;
use crate::brdf::Reflectance;
use crate::fit::Metric;
use crate::fit::target::{Pair, Residuals, Resolution, pairs};
use crate::preview::ball::{TO_VIEWER, frame, normal_at, pixel_centre};

/// How far a model is from a measurement, over what was measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Distance {
    /// Mean ΔE2000 of a ball under suns at 15, 40, 70, 110 and 140° from the viewer.
    pub suns: f64,
    /// Mean ΔE2000 of the ball's highlights under small area lights.
    pub highlights: f64,
    /// ∫∫ |f − f_measured| cosθi cosθo dωi dωo/π², the mean of the three channels \[1/sr\].
    pub absolute: f64,
    /// The same over ∫∫ f_measured cosθi cosθo dωi dωo/π².
    pub relative: f64,
    /// √(∫∫ (Δ ∛x)²/∫∫ (∛x)²), x = π f cosθi with CIELAB's toe, weighted by cosθo: the relative
    /// error in lightness.
    pub lightness: f64,
}

impl From<Distance> for Distances {
    fn from(distance: Distance) -> Self {
        let Distance { suns, highlights, absolute, relative, lightness } = distance;
        Self { suns, highlights, absolute, relative, lightness }
    }
}

impl From<Distances> for Distance {
    fn from(distances: Distances) -> Self {
        let Distances { suns, highlights, absolute, relative, lightness } = distances;
        Self { suns, highlights, absolute, relative, lightness }
    }
}

/// A measurement to which models are compared.
pub struct Reference {
    suns: Picture,
    highlights: Picture,
    pairs: Vec<Pair>,
    f: Vec<[[f64; 3]; 2]>,
}

/// Suns by which fits are judged, in degrees from the viewer.
pub const SUNS: [f64; 5] = [15.0, 40.0, 70.0, 110.0, 140.0];
/// Pixels across the ball.
const SIZE: usize = 48;
/// Squared radius of the ball, and cosθi, that count.
const RIM: f64 = 0.94;
const LIT: f64 = 0.05;

/// Radius of the area lights \[degrees\], the points of each, and their irradiance over π: bright
/// enough to see a dielectric's highlight, not so bright as to clip it.
const LIGHT_RADIUS: f64 = 4.0;
const LIGHT_POINTS: usize = 24;
const LIGHT_IRRADIANCE: f64 = 1.0 / 16.0;
/// Angle from the mirror direction's half vector within which a pixel belongs to the highlight.
const HIGHLIGHT: f64 = 15.0;

/// Nodes of the integrals.
const RESOLUTION: Resolution = Resolution { theta_h: 40, theta_d: 10, phi_d: 6 };
/// tan²θh from which they are spaced.
const FINEST: f64 = 1e-6;

impl Reference {
    /// The comparison with a reflectance; pairs are left out where it is NaN.
    #[must_use]
    pub fn new(measured: &dyn Reflectance) -> Self {
        let pairs = pairs(FINEST, RESOLUTION);
        Self {
            suns: Picture::new(measured, suns()),
            highlights: Picture::new(measured, highlights()),
            f: pairs.iter().map(|pair| both(measured, pair)).collect(),
            pairs,
        }
    }

    /// How far `model` is.
    #[must_use]
    pub fn distance(&self, model: &dyn Reflectance) -> Distance {
        let [absolute, relative, lightness] = self.errors(model);
        Distance {
            suns: self.suns.difference(model),
            highlights: self.highlights.difference(model),
            absolute,
            relative,
            lightness,
        }
    }

    /// √(∫(g(x_model) − g(x))²/∫g(x)²) in each metric g per channel, as a fit to a material states
    /// its residuals.
    #[must_use]
    pub fn residuals(&self, model: &dyn Reflectance) -> Residuals {
        let values: Vec<[[f64; 3]; 2]> = self.pairs.iter().map(|pair| both(model, pair)).collect();
        let [cosine, cube_root, log] =
            Metric::ALL.map(|metric| std::array::from_fn(|c| self.residual(metric, c, &values)));
        Residuals { cosine, cube_root, log }
    }

    fn residual(&self, metric: Metric, c: usize, values: &[[[f64; 3]; 2]]) -> f64 {
        let (mut off, mut total) = (0.0, 0.0);
        for ((pair, measured), found) in self.pairs.iter().zip(&self.f).zip(values) {
            // A measurement may have a value one way round only.
            for side in (0..2).filter(|side| !measured[*side][c].is_nan()) {
                let [exact, found] =
                    [measured, found].map(|f| metric.transform(f[side][c], pair.cos_theta[side]).0);
                off += pair.weights[side] * (found - exact).powi(2);
                total += pair.weights[side] * exact * exact;
            }
        }
        // Nothing is relative to a black measurement.
        if total > 0.0 { (off / total).sqrt() } else { off.sqrt() }
    }

    /// ∫∫ |f − f_measured| cosθi cosθo dωi dωo/π² of each channel \[1/sr\].
    #[must_use]
    pub fn absolute(&self, model: &dyn Reflectance) -> [f64; 3] {
        let (mut off, mut weights) = ([0.0; 3], [0.0; 3]);
        for (pair, measured) in self.pairs.iter().zip(&self.f) {
            let found = both(model, pair);
            for (side, c) in (0..2).flat_map(|side| (0..3).map(move |c| (side, c))) {
                if !measured[side][c].is_nan() {
                    let weight = pair.weights[side] * pair.cos_theta[side];
                    off[c] += weight * (found[side][c] - measured[side][c]).abs();
                    weights[c] += weight;
                }
            }
        }
        std::array::from_fn(|c| off[c] / weights[c])
    }

    fn errors(&self, model: &dyn Reflectance) -> [f64; 3] {
        let [mut off, mut total, mut off2, mut total2, mut weights] = [0.0; 5];
        for (pair, measured) in self.pairs.iter().zip(&self.f) {
            let found = both(model, pair);
            for (side, c) in (0..2).flat_map(|side| (0..3).map(move |c| (side, c))) {
                let (exact, fitted) = (measured[side][c], found[side][c]);
                // Not measured.
                if exact.is_nan() {
                    continue;
                }
                let (cos, weight) = (pair.cos_theta[side], pair.weights[side]);
                let [exact_lightness, fitted_lightness] =
                    [exact, fitted].map(|f| Metric::CubeRoot.transform(f, cos).0);
                off += weight * cos * (fitted - exact).abs();
                total += weight * cos * exact;
                off2 += weight * (fitted_lightness - exact_lightness).powi(2);
                total2 += weight * exact_lightness.powi(2);
                weights += weight * cos;
            }
        }
        [off / weights, off / total, (off2 / total2).sqrt()]
    }
}

fn both(reflectance: &dyn Reflectance, pair: &Pair) -> [[f64; 3]; 2] {
    [reflectance.eval(pair.wi, pair.wo), reflectance.eval(pair.wo, pair.wi)]
}

/// Pixels that several lights shine on, as the measurement shows them.
struct Picture {
    pixels: Vec<Pixel>,
    seen: Vec<Lab<D65, f64>>,
}

/// A pixel: pairs of directions and the weight of f at each.
struct Pixel {
    pairs: Vec<[DVec3; 2]>,
    weights: Vec<f64>,
}

impl Picture {
    fn new(measured: &dyn Reflectance, pixels: Vec<Pixel>) -> Self {
        let seen = pixels.into_iter().filter_map(|pixel| {
            let radiance = pixel.radiance(measured);
            // A pixel with a gap in the measurement is left out for every model.
            radiance.iter().all(|x| x.is_finite()).then(|| (pixel, lab(radiance)))
        });
        let (pixels, seen) = seen.unzip();
        Self { pixels, seen }
    }

    /// Mean ΔE2000.
    fn difference(&self, model: &dyn Reflectance) -> f64 {
        let differences = self.pixels.iter().zip(&self.seen);
        let sum: f64 =
            differences.map(|(pixel, seen)| lab(pixel.radiance(model)).difference(*seen)).sum();
        sum / self.pixels.len().max(1) as f64
    }
}

impl Pixel {
    fn radiance(&self, reflectance: &dyn Reflectance) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for ([wi, wo], weight) in self.pairs.iter().zip(&self.weights) {
            let f = reflectance.eval(*wi, *wo);
            for c in 0..3 {
                sum[c] += weight * f[c];
            }
        }
        sum
    }
}

/// CIELAB of a radiance relative to white, clipped at white.
fn lab(radiance: [f64; 3]) -> Lab<D65, f64> {
    // A display shows no more, and a fit may be negative.
    let [r, g, b] = radiance.map(|x| x.clamp(0.0, 1.0));
    LinSrgb::new(r, g, b).into_color()
}

fn normals() -> impl Iterator<Item = DVec3> {
    let centres = (0..SIZE * SIZE).map(|i| pixel_centre(SIZE, i % SIZE, i / SIZE));
    let inside = centres.filter(|[x, y]| x * x + y * y < RIM);
    inside.filter_map(|[x, y]| normal_at(x, y))
}

fn towards(angle: f64) -> DVec3 {
    let (sin, cos) = angle.to_radians().sin_cos();
    DVec3::new(sin, 0.0, cos)
}

fn suns() -> Vec<Pixel> {
    SUNS.into_iter().map(towards).flat_map(under_sun).collect()
}

fn highlights() -> Vec<Pixel> {
    SUNS.into_iter().map(towards).flat_map(under_area_light).collect()
}

/// The pixels that a sun lights.
fn under_sun(sun: DVec3) -> impl Iterator<Item = Pixel> {
    normals().filter(move |normal| normal.dot(sun) > LIT).map(move |normal| {
        let to_local = frame(normal).transpose();
        let wi = to_local * sun;
        Pixel { pairs: vec![[wi, to_local * TO_VIEWER]], weights: vec![PI * wi.z] }
    })
}

/// The pixels of the highlight of a small area light about a direction.
fn under_area_light(light: DVec3) -> impl Iterator<Item = Pixel> {
    let near = HIGHLIGHT.to_radians().cos();
    let h = (light + TO_VIEWER).normalize();
    // cosθi > 0.1 is 5.7° above the horizon: the whole light, of 4° radius, is visible.
    let lit = normals().filter(move |n| n.dot(light) > 2.0 * LIT && n.dot(h) > near);
    lit.map(move |normal| {
        let to_local = frame(normal).transpose();
        let wo = to_local * TO_VIEWER;
        let pairs: Vec<[DVec3; 2]> = disc(light).map(|point| [to_local * point, wo]).collect();
        let scale = LIGHT_IRRADIANCE * PI / LIGHT_POINTS as f64;
        Pixel { weights: pairs.iter().map(|[wi, _]| scale * wi.z.max(0.0)).collect(), pairs }
    })
}

/// Points spread evenly over a disc about a direction (a sunflower's).
fn disc(centre: DVec3) -> impl Iterator<Item = DVec3> {
    let to_world = frame(centre);
    // Turns of the golden section, and radii by the root of the area within.
    let golden = TAU * (0.5 * (5.0_f64.sqrt() - 1.0));
    (0..LIGHT_POINTS).map(move |i| {
        let radius = LIGHT_RADIUS.to_radians() * ((i as f64 + 0.5) / LIGHT_POINTS as f64).sqrt();
        let (sin, cos) = (golden * i as f64).sin_cos();
        (to_world * DVec3::new(radius * cos, radius * sin, 1.0)).normalize()
    })
}
