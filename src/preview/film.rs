//! An image in linear RGB with coverage, its files, and the difference to another image.

use std::io::Cursor;

use crate::encode::GENERATOR;
use crate::preview::colour::{delta_e2000, to_srgb8};

/// A linear RGB image, rows from the top.
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
/// assert!(picture.film.to_png()?.starts_with(b"\x89PNG"));
/// assert_eq!(picture.film.delta_e(&picture.film).max, 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The pixels, row by row.
    pub pixels: Vec<Pixel>,
}

/// The light that a pixel received.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    /// Radiance of the covered part, not multiplied by the coverage.
    pub rgb: [f64; 3],
    /// The share of the pixel that the object covers, 0 to 1.
    pub alpha: f64,
}

impl Pixel {
    /// The mean of four pixels, each colour weighted by its coverage.
    fn mean(four: [Self; 4]) -> Self {
        let alpha = four.iter().map(|pixel| pixel.alpha).sum::<f64>();
        // Unweighted, the black of uncovered pixels would darken the rim.
        let rgb = [0, 1, 2].map(|c| match alpha > 0.0 {
            true => four.iter().map(|pixel| pixel.rgb[c] * pixel.alpha).sum::<f64>() / alpha,
            false => 0.0,
        });
        Self { rgb, alpha: 0.25 * alpha }
    }
}

/// An image could not be encoded.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// PNG.
    #[error("cannot encode the PNG: {0}")]
    Png(#[from] png::EncodingError),
    /// EXR.
    #[error("cannot encode the EXR: {0}")]
    Exr(#[from] exr::error::Error),
}

/// ΔE2000 of two images over the pixels that the object covers.
#[derive(Clone, Debug, PartialEq)]
pub struct DeltaE {
    /// Mean over the covered pixels.
    pub mean: f64,
    /// Largest of the covered pixels.
    pub max: f64,
    /// Per pixel; `None` off the object.
    pub map: Vec<Option<f64>>,
}

impl Film {
    /// Tone-mapped 8-bit sRGB with alpha, as PNG bytes.
    ///
    /// # Errors
    ///
    /// The encoder refuses the size.
    pub fn to_png(&self) -> Result<Vec<u8>, FilmError> {
        let rgba: Vec<u8> = self.pixels.iter().flat_map(|p| png_pixel(*p)).collect();
        encode_png(&rgba, self.width, self.height)
    }

    /// Linear radiance times coverage, and coverage, as EXR bytes (32-bit float, ZIP).
    ///
    /// # Errors
    ///
    /// The encoder refuses the size.
    pub fn to_exr(&self) -> Result<Vec<u8>, FilmError> {
        use exr::prelude::{Image, SpecificChannels, Text, WritableImage as _};
        let channels = SpecificChannels::rgba(|at: exr::math::Vec2<usize>| {
            let Pixel { rgb, alpha } = self.pixels[at.y() * self.width + at.x()];
            // OpenEXR colours are premultiplied; those of PNG are not.
            let [r, g, b] = rgb.map(|c| (c * alpha) as f32);
            (r, g, b, alpha as f32)
        });
        let mut image = Image::from_channels((self.width, self.height), channels);
        image.layer_data.attributes.software_name = Text::new_or_none(GENERATOR);
        image.layer_data.encoding.compression = exr::compression::Compression::ZIP16;
        let mut bytes = Cursor::new(Vec::new());
        image.write().non_parallel().to_buffered(&mut bytes)?;
        Ok(bytes.into_inner())
    }

    /// Images of one height, from left to right.
    #[must_use]
    pub fn beside(films: &[Self]) -> Self {
        // The least height: no film is read past its end.
        let height = films.iter().map(|film| film.height).min().unwrap_or(0);
        let rows = (0..height).flat_map(|row| {
            films.iter().flat_map(move |film| &film.pixels[row * film.width..][..film.width])
        });
        let width = films.iter().map(|film| film.width).sum();
        Self { width, height, pixels: rows.copied().collect() }
    }

    /// The image at half its size, each pixel the mean of four.
    #[must_use]
    pub fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        // The upper left of each four; an odd last row or column is dropped.
        let firsts = (0..width * height).map(|i| 2 * (i / width) * self.width + 2 * (i % width));
        let pixels = firsts
            .map(|i| Pixel::mean([0, 1, self.width, self.width + 1].map(|n| self.pixels[i + n])));
        Self { width, height, pixels: pixels.collect() }
    }

    /// ΔE2000 against another image of the same view.
    #[must_use]
    pub fn delta_e(&self, other: &Self) -> DeltaE {
        let pairs = self.pixels.iter().zip(&other.pixels);
        let map: Vec<Option<f64>> = pairs
            // Straight colours: at the rim coverage does not count as a difference.
            .map(|(a, b)| (a.alpha > 0.0 && b.alpha > 0.0).then(|| delta_e2000(a.rgb, b.rgb)))
            .collect();
        let covered = map.iter().flatten();
        DeltaE {
            mean: covered.clone().sum::<f64>() / covered.clone().count().max(1) as f64,
            max: covered.copied().fold(0.0, f64::max),
            map,
        }
    }
}

fn png_pixel(pixel: Pixel) -> [u8; 4] {
    let [r, g, b] = to_srgb8(pixel.rgb);
    [r, g, b, (pixel.alpha * 255.0).round() as u8]
}

/// An RGBA image as PNG bytes.
///
/// # Errors
///
/// The encoder refuses the size.
pub fn encode_png(rgba: &[u8], width: usize, height: usize) -> Result<Vec<u8>, FilmError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.add_text_chunk("Software".to_owned(), GENERATOR.to_owned())?;
    encoder.write_header()?.write_image_data(rgba)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(rgb: [f64; 3]) -> Film {
        let mut pixels = vec![Pixel { rgb, alpha: 1.0 }; 16];
        pixels[3] = Pixel::default();
        Film { width: 4, height: 4, pixels }
    }

    #[test]
    fn off_the_object_nothing_differs() {
        let difference = film([0.2; 3]).delta_e(&film([0.3; 3]));
        assert_eq!(difference.map.iter().flatten().count(), 15);
        assert!((difference.mean - difference.max).abs() < 1e-12 && difference.max > 1.0);
        assert_eq!(film([0.2; 3]).delta_e(&film([0.2; 3])).max, 0.0);
    }

    #[test]
    fn halving_keeps_the_light() {
        let half = film([0.2; 3]).halved();
        assert_eq!((half.width, half.pixels.len()), (2, 4));
        assert_eq!(half.pixels[1].alpha, 0.75);
        assert!((half.pixels[1].rgb[0] - 0.2).abs() < 1e-15);
    }

    #[test]
    fn the_exr_reads_back_what_was_seen() {
        let bytes = film([0.25, 7.0, 0.5]).to_exr().expect("encodes");
        let decoder = image_from_exr(&bytes);
        assert_eq!(decoder[0], [0.25, 7.0, 0.5, 1.0]);
        assert_eq!(decoder[3], [0.0; 4]);
        assert!(bytes.windows(8).any(|window| window == b"sgdbake "));
    }

    fn image_from_exr(bytes: &[u8]) -> Vec<[f32; 4]> {
        use exr::prelude::{ReadChannels as _, ReadLayers as _, read};
        let image = read()
            .no_deep_data()
            .largest_resolution_level()
            .rgba_channels(
                |size, _| (size.width(), vec![[0.0; 4]; size.area()]),
                |(width, pixels): &mut (usize, Vec<[f32; 4]>),
                 at,
                 (r, g, b, a): (f32, f32, f32, f32)| {
                    pixels[at.y() * *width + at.x()] = [r, g, b, a];
                },
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .expect("reads back");
        image.layer_data.channel_data.pixels.1
    }

    #[test]
    fn the_png_has_the_tone_mapped_colour() {
        let bytes = film([0.25, 7.0, 0.5]).to_png().expect("encodes");
        let decoded = image::load_from_memory(&bytes).expect("reads back").to_rgba8();
        let [r, g, b] = to_srgb8([0.25, 7.0, 0.5]);
        assert_eq!(decoded.get_pixel(0, 0).0, [r, g, b, 255]);
        assert_eq!(decoded.get_pixel(3, 0).0[3], 0);
    }
}
