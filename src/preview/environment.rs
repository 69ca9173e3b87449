//! Distant light from every direction: an equirectangular image, sampled where it is bright.

use std::f64::consts::{FRAC_1_PI, PI, TAU};
use std::path::{Path, PathBuf};

use glam::DVec3;
use rayon::prelude::*;

use crate::preview::colour::luminance;

/// Radiance from every direction, constant over each texel of an equirectangular image.
///
/// y points up; the image's first row is the zenith, its centre the direction −z, and its
/// columns turn to the right seen from inside.
///
/// # Example
///
/// ```
/// use sgdbake::{DVec3, Environment};
///
/// // A panorama of 2 × 1 texels, bright on one side.
/// let environment = Environment::new(2, &[[1.0; 3], [0.1; 3]])?;
/// let [left, right] = [DVec3::X, -DVec3::X].map(|towards| environment.look(towards).radiance[0]);
/// assert!(left != right);
/// # Ok::<(), sgdbake::preview::environment::EnvironmentError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Environment {
    width: usize,
    height: usize,
    texels: Vec<Texel>,
    /// cosθ of the rows' edges, from 1 at the zenith to −1.
    edges: Vec<f64>,
    rows: Steps,
    /// Per row, its columns.
    columns: Vec<Steps>,
}

#[derive(Clone, Copy, Debug)]
struct Texel {
    rgb: [f32; 3],
    /// Sampling density \[1/sr\].
    pdf: f32,
}

/// Light drawn from, or seen in, a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arriving {
    /// Unit direction to the light.
    pub direction: DVec3,
    /// Radiance from there.
    pub radiance: [f64; 3],
    /// Density of [`Environment::sample`] there \[1/sr\].
    pub pdf: f64,
}

/// An environment image that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum EnvironmentError {
    /// The file cannot be read or decoded.
    #[error("cannot read {}: {reason}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// Decoded, but no light: empty, black, negative or not finite everywhere.
    #[error("the environment gives no light; use an image with finite, positive radiance")]
    Dark,
}

impl Environment {
    /// The environment of an equirectangular image, `width` pixels a row.
    ///
    /// Radiance that is negative or not finite counts as 0.
    ///
    /// # Errors
    ///
    /// [`EnvironmentError::Dark`] where nothing is left, or the image is empty.
    pub fn new(width: usize, pixels: &[[f32; 3]]) -> Result<Self, EnvironmentError> {
        let height = pixels.len().checked_div(width).unwrap_or(0);
        let edges: Vec<f64> = (0..=height).map(|row| polar_cosine(row, height)).collect();
        // An incomplete last row is dropped; `pdf` holds the luminance until its scale is known.
        let mut texels: Vec<Texel> = pixels[..width * height]
            .iter()
            .map(|rgb| {
                let rgb = rgb.map(|c| if c.is_finite() { c.max(0.0) } else { 0.0 });
                Texel { rgb, pdf: luminance(rgb.map(f64::from)) as f32 }
            })
            .collect();
        let columns: Vec<Steps> = texels.par_chunks(width.max(1)).map(Steps::of_row).collect();
        // All texels of a row have the same solid angle, 2π/width times the difference of cosθ.
        let heights = edges.windows(2).map(|edge| edge[0] - edge[1]);
        let rows = Steps::new(columns.iter().zip(heights).map(|(row, height)| row.total * height));
        if !(rows.total > 0.0 && rows.total.is_finite()) {
            return Err(EnvironmentError::Dark);
        }
        // p = L/∫ L dω, ∫ L dω = 2π/width · Σ L Δcosθ.
        let scale = width as f64 / (TAU * rows.total);
        for texel in &mut texels {
            texel.pdf = (f64::from(texel.pdf) * scale) as f32;
        }
        Ok(Self { width, height, texels, edges, rows, columns })
    }

    /// Reads an equirectangular `.hdr` or `.exr` image.
    ///
    /// # Errors
    ///
    /// [`EnvironmentError`]: the file cannot be read or decoded, or gives no light.
    pub fn load(path: &Path) -> Result<Self, EnvironmentError> {
        let is_exr = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
        let image = if is_exr { read_exr(path) } else { read_hdr(path) };
        let (width, pixels) = image
            .map_err(|reason| EnvironmentError::Unreadable { path: path.to_owned(), reason })?;
        Self::new(width, &pixels)
    }

    /// The built-in lights: a grey room brighter above, a large soft key light from the upper
    /// left, a fill from the right and a rim light from behind.
    #[must_use]
    pub fn studio() -> Self {
        const WIDTH: usize = 256;
        let pixels: Vec<[f32; 3]> = (0..WIDTH * WIDTH / 2)
            .map(|index| {
                let [u, v] = texel_centre(index, WIDTH, WIDTH / 2);
                studio_radiance(direction_at(u, v)).map(|c| c as f32)
            })
            .collect();
        Self::new(WIDTH, &pixels).expect("the lights are on")
    }

    /// Radiance and sampling density in a direction.
    #[must_use]
    pub fn look(&self, direction: DVec3) -> Arriving {
        let (u, v) = coordinates(direction);
        // u and v are 1 on the last edge.
        let column = ((u * self.width as f64) as usize).min(self.width - 1);
        let row = ((v * self.height as f64) as usize).min(self.height - 1);
        self.arriving(direction, row * self.width + column)
    }

    /// A direction of density proportional to the luminance, from two uniform numbers in [0, 1).
    #[must_use]
    pub fn sample(&self, u: [f64; 2]) -> Arriving {
        let (row, within_row) = self.rows.at(u[1]);
        let (column, within_column) = self.columns[row].at(u[0]);
        // Even in cosθ and azimuth, a texel is drawn evenly in solid angle.
        let cos_theta = self.edges[row] + within_row * (self.edges[row + 1] - self.edges[row]);
        let azimuth = azimuth((column as f64 + within_column) / self.width as f64);
        self.arriving(turned(cos_theta, azimuth), row * self.width + column)
    }

    fn arriving(&self, direction: DVec3, texel: usize) -> Arriving {
        let Texel { rgb, pdf } = self.texels[texel];
        Arriving { direction, radiance: rgb.map(f64::from), pdf: f64::from(pdf) }
    }
}

/// A distribution over indices that keeps the order of the uniform number, drawn in constant
/// expected time by the guide table of Chen and Asau (1974).
#[derive(Clone, Debug)]
struct Steps {
    /// Sum of the weights.
    total: f64,
    /// Share of the indices 0..=i; the last is 1.
    cumulative: Vec<f32>,
    /// For each of a power of two even parts of [0, 1), the first index that reaches beyond its
    /// start.
    guide: Vec<u32>,
}

impl Steps {
    fn new(weights: impl Iterator<Item = f64> + Clone) -> Self {
        let total: f64 = weights.clone().sum();
        let mut sum = 0.0;
        let cumulative: Vec<f32> = weights
            .map(|weight| {
                sum += weight;
                // A black row has no share, and none is ever drawn from it.
                (sum / total.max(f64::MIN_POSITIVE)) as f32
            })
            .collect();
        let parts = cumulative.len().next_power_of_two();
        let starts = (0..parts).map(|part| part as f64 / parts as f64);
        let guide = starts
            .map(|start| cumulative.partition_point(|share| f64::from(*share) <= start) as u32)
            .collect();
        Self { total, cumulative, guide }
    }

    fn of_row(row: &[Texel]) -> Self {
        Self::new(row.iter().map(|texel| f64::from(texel.pdf)))
    }

    /// The index that `u` in [0, 1) falls to, and where in its share, in [0, 1].
    fn at(&self, u: f64) -> (usize, f64) {
        let last = self.cumulative.len() - 1;
        // One look-up, then on the average less than two steps.
        let mut index = self.guide[(u * self.guide.len() as f64) as usize] as usize;
        // `<=` steps over indices without a share.
        while index < last && f64::from(self.cumulative[index]) <= u {
            index += 1;
        }
        let index = index.min(last);
        let below = index.checked_sub(1).map_or(0.0, |below| f64::from(self.cumulative[below]));
        (index, fraction(u, below, f64::from(self.cumulative[index])))
    }
}

/// Where `u` lies between two cumulative shares, in [0, 1].
fn fraction(u: f64, below: f64, above: f64) -> f64 {
    if above > below { ((u - below) / (above - below)).clamp(0.0, 1.0) } else { 0.5 }
}

/// (u, v) of texel `index`'s centre, row by row.
fn texel_centre(index: usize, width: usize, height: usize) -> [f64; 2] {
    let (column, row) = (index % width, index / width);
    [(column as f64 + 0.5) / width as f64, (row as f64 + 0.5) / height as f64]
}

/// cosθ of a row's upper edge.
fn polar_cosine(row: usize, height: usize) -> f64 {
    (PI * row as f64 / height as f64).cos()
}

/// The azimuth of a column's coordinate u, from −z.
fn azimuth(u: f64) -> f64 {
    TAU * (u - 0.5)
}

/// The direction at a polar angle from +y of the given cosine, and an azimuth.
fn turned(cos_theta: f64, azimuth: f64) -> DVec3 {
    // 1 − cos² would cancel near the poles.
    let sin_theta = ((1.0 - cos_theta) * (1.0 + cos_theta)).max(0.0).sqrt();
    let (sin_phi, cos_phi) = azimuth.sin_cos();
    DVec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi)
}

/// The direction of image coordinates: polar angle πv from +y.
fn direction_at(u: f64, v: f64) -> DVec3 {
    turned((PI * v).cos(), azimuth(u))
}

/// Image coordinates (u, v) in [0, 1] of a unit direction.
fn coordinates(direction: DVec3) -> (f64, f64) {
    let u = 0.5 + direction.x.atan2(-direction.z) / TAU;
    // Rounding may leave [−1, 1], where acos is NaN.
    (u, direction.y.clamp(-1.0, 1.0).acos() * FRAC_1_PI)
}

/// The built-in lights: (direction, cosine of the light's half angle, radiance).
const STUDIO: [(DVec3, f64, f64); 3] = [
    (DVec3::new(-0.5, 0.6, 0.62), 0.93, 9.0),
    (DVec3::new(0.9, 0.1, 0.42), 0.90, 1.6),
    (DVec3::new(0.35, 0.75, -0.56), 0.96, 12.0),
];

fn studio_radiance(direction: DVec3) -> [f64; 3] {
    let room = 0.18 + 0.17 * direction.y;
    let lamps = STUDIO.into_iter().map(|(to_lamp, cos_edge, radiance)| {
        let cos = direction.dot(to_lamp.normalize());
        // A soft edge, so that its mirror image shows no staircase.
        radiance * ((cos - cos_edge) / (0.1 * (1.0 - cos_edge))).clamp(0.0, 1.0)
    });
    [room + lamps.sum::<f64>(); 3]
}

/// Larger sides than any panorama in use; sizes are checked before pixels are allocated.
const LARGEST_SIDE: u32 = 32768;

fn read_hdr(path: &Path) -> Result<(usize, Vec<[f32; 3]>), String> {
    let mut reader = image::ImageReader::open(path)
        .and_then(image::ImageReader::with_guessed_format)
        .map_err(|error| error.to_string())?;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(LARGEST_SIDE);
    limits.max_image_height = Some(LARGEST_SIDE);
    // The default of 512 MiB refuses a panorama of 16384 × 8192 pixels, 1.6 GB as floats.
    limits.max_alloc = Some(4 << 30);
    reader.limits(limits);
    let image = reader.decode().map_err(|error| error.to_string())?.into_rgb32f();
    Ok((image.width() as usize, image.pixels().map(|pixel| pixel.0).collect()))
}

fn read_exr(path: &Path) -> Result<(usize, Vec<[f32; 3]>), String> {
    use exr::prelude::{ReadChannels as _, ReadLayers as _, read};
    let meta = exr::meta::MetaData::read_from_file(path, false).map_err(|e| e.to_string())?;
    if meta
        .headers
        .iter()
        .any(|header| header.layer_size.0.max(header.layer_size.1) > LARGEST_SIDE as usize)
    {
        return Err(format!("a side is longer than {LARGEST_SIDE} pixels"));
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.width(), vec![[0.0_f32; 3]; size.area()]),
            |(width, pixels): &mut (usize, Vec<[f32; 3]>), at, (r, g, b): (f32, f32, f32)| {
                pixels[at.y() * *width + at.x()] = [r, g, b];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .map_err(|error| error.to_string())?;
    Ok(image.layer_data.channel_data.pixels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    fn uneven() -> Environment {
        let pixels: Vec<[f32; 3]> = (0..16 * 8)
            .map(|i| [((i * 37) % 11) as f32, if i == 40 { 500.0 } else { 0.3 }, 0.1])
            .collect();
        Environment::new(16, &pixels).expect("gives light")
    }

    #[test]
    fn directions_and_coordinates_are_inverse() {
        for [u, v] in [[0.1, 0.2], [0.5, 0.5], [0.9, 0.7]] {
            let (u2, v2) = coordinates(direction_at(u, v));
            assert!((u - u2).abs() < 1e-12 && (v - v2).abs() < 1e-12);
        }
        assert!((direction_at(0.5, 0.5) - DVec3::NEG_Z).length() < 1e-12);
        assert!(direction_at(0.75, 0.5).x > 0.99, "columns turn to the right");
    }

    #[test]
    fn what_is_drawn_has_the_density_that_is_seen() {
        let environment = uneven();
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        for _ in 0..2000 {
            let drawn = environment.sample(rng.random());
            let seen = environment.look(drawn.direction);
            assert!((drawn.direction.length() - 1.0).abs() < 1e-12);
            assert!((seen.pdf / drawn.pdf - 1.0).abs() < 1e-6 && seen.radiance == drawn.radiance);
        }
    }

    #[test]
    fn the_density_integrates_to_one_and_the_light_to_its_sum() {
        let environment = uneven();
        let (mut pdf, mut light) = (0.0, 0.0);
        let (width, height) = (320, 320);
        for index in 0..width * height {
            let [u, v] = texel_centre(index, width, height);
            let seen = environment.look(direction_at(u, v));
            let solid_angle = 2.0 * PI * PI * (PI * v).sin() / (width * height) as f64;
            pdf += seen.pdf * solid_angle;
            light += luminance(seen.radiance) * solid_angle;
        }
        assert!((pdf - 1.0).abs() < 1e-4, "{pdf}");
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        let draws = 20_000;
        let estimate: f64 = (0..draws)
            .map(|_| environment.sample(rng.random()))
            .map(|drawn| luminance(drawn.radiance) / drawn.pdf / f64::from(draws))
            .sum();
        assert!((estimate / light - 1.0).abs() < 0.02, "{estimate} {light}");
    }

    #[test]
    fn the_guide_finds_what_a_search_finds() {
        for weights in [&[1.0, 0.0, 3.0, 1e-9, 0.0, 2.0, 0.0][..], &[5.0], &[0.0, 0.0, 1.0]] {
            let steps = Steps::new(weights.iter().copied());
            for i in 0..1000 {
                let u = f64::from(i) / 1000.0;
                let (index, within) = steps.at(u);
                assert_eq!(index, steps.cumulative.partition_point(|s| f64::from(*s) <= u));
                assert!(weights[index] > 0.0 && (0.0..=1.0).contains(&within), "{u}");
            }
        }
    }

    #[test]
    fn no_light_is_an_error() {
        assert!(matches!(Environment::new(4, &[[0.0; 3]; 8]), Err(EnvironmentError::Dark)));
        assert!(matches!(Environment::new(0, &[]), Err(EnvironmentError::Dark)));
        assert!(Environment::new(2, &[[f32::NAN, -1.0, 1.0]; 2]).is_ok());
    }
}
