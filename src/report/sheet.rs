//! The material sheet: what the paper's supplement prints of a material, and what the fits make
//! of it, measured when the sheet is written.

use crate::brdf::batch::SgdBatch;
use crate::brdf::gltf::GltfBrdf;
use crate::brdf::{Brdf, MaskingKind, OneLobe, Reflectance, SgdBrdf};
use crate::fit::target::Residuals;
use crate::fit::{Metric, gltf, gltf_measured, one_lobe, one_lobe_measured};
use crate::material::{Material, find};
use crate::measurement::Filled;
use crate::microfacet::{Family, OneWidth};
use crate::preview::film::{DeltaE, FilmError};
use crate::preview::render::{Quality, drawn_from, render};
use crate::preview::{Environment, Film, Shape};
use crate::report::audit::{Audit, audit};
use crate::report::distance::Distance;
use crate::report::surface::{Surface, evaluated};
use crate::report::{sheet_page, sheet_plots};

/// Everything that a sheet shows.
pub struct Sheet<'a> {
    /// The material.
    pub material: &'a Material,
    /// The fitting error that the paper states, of catalogue materials.
    pub printed_error: Option<[f64; 3]>,
    /// The measured reflectance.
    pub sgd: SgdBrdf,
    /// The best fits.
    pub fits: Fits,
    /// The laws and limits.
    pub audit: Audit,
    /// Pictures of the material and of the fits.
    pub pictures: Pictures,
    /// The measurement that the material was fitted to.
    pub measured: Option<OfMeasurement<'a>>,
}

/// A measurement beside the models of a sheet.
pub struct OfMeasurement<'a> {
    /// Its values, NaN where there is none.
    pub reflectance: &'a dyn Reflectance,
    /// The distances of SGD, Beckmann, GGX and glTF.
    pub distances: [Distance; 4],
    /// ∫∫ |f − f_measured| cosθi cosθo dωi dωo/π² of SGD, per channel \[1/sr\].
    pub absolute: [f64; 3],
}

/// The best fits that a sheet compares.
pub struct Fits {
    /// One Beckmann lobe per channel.
    pub beckmann: OneLobe,
    /// One GGX lobe per channel.
    pub ggx: OneLobe,
    /// A glTF material.
    pub gltf: GltfBrdf,
    /// Relative residuals of the three, per channel.
    pub residuals: [[f64; 3]; 3],
    /// The first two as reflectances.
    one_lobe: [Brdf<OneWidth>; 2],
}

/// Pictures of one ball under the same lights.
pub struct Pictures {
    /// The measurement, or the SGD material where there is none.
    pub reference: Film,
    /// SGD beside a measurement.
    pub sgd: Option<(Film, DeltaE)>,
    /// Beckmann, GGX, glTF, each with its difference to the reference.
    pub fits: [(Film, DeltaE); 3],
    /// The noise of the pictures.
    pub noise: f64,
}

/// A finished page.
pub struct Page {
    /// The material's name.
    pub name: String,
    /// The self-contained HTML.
    pub html: String,
    /// A small picture as PNG bytes.
    pub thumbnail: Vec<u8>,
    /// Mean ΔE2000 of Beckmann, GGX and glTF.
    pub delta_e: [f64; 3],
    /// The smallest angle from which a channel gains energy.
    pub gains_energy_from_deg: Option<f64>,
}

/// Names of the fits in the order of every `[T; 3]` of fits.
pub const FIT_NAMES: [&str; 3] = ["Beckmann", "GGX", "glTF"];

/// Pictures good enough for the page: 160 pixels on a phone's screen.
pub const QUALITY: Quality = Quality { size: 160, samples: 96, seed: 1 };

/// The page of a material, its pictures taken under `environment`.
///
/// # Errors
///
/// A picture cannot be encoded.
pub fn page(material: &Material, environment: &Environment) -> Result<Page, FilmError> {
    finished(&Sheet::new(material, environment))
}

/// The page of a measurement and the material that was fitted to it: Beckmann, GGX and glTF are
/// fitted to the measurement too, and everything is compared with it.
///
/// # Errors
///
/// A picture cannot be encoded.
pub fn measured_page(
    material: &Material,
    measured: &dyn Reflectance,
    surface: &Surface,
    environment: &Environment,
) -> Result<Page, FilmError> {
    finished(&Sheet::of_measurement(material, measured, surface, environment))
}

fn finished(sheet: &Sheet<'_>) -> Result<Page, FilmError> {
    Ok(Page {
        name: sheet.material.name.clone(),
        html: sheet_page::html(sheet, &sheet_plots::plots(sheet))?,
        thumbnail: sheet.pictures.reference.halved().to_png()?,
        delta_e: sheet.pictures.fits.each_ref().map(|(_, difference)| difference.mean),
        gains_energy_from_deg: sheet
            .audit
            .channels
            .iter()
            .filter_map(|channel| channel.gains_energy_from_deg)
            .reduce(f64::min),
    })
}

impl<'a> Sheet<'a> {
    fn new(material: &'a Material, environment: &Environment) -> Self {
        let published = find(&material.name).ok().filter(|entry| entry.material == *material);
        let fits = Fits::new(material);
        Self {
            material,
            printed_error: published.map(|entry| entry.printed.map(|row| row.error)),
            sgd: SgdBrdf::new(material, MaskingKind::Exact),
            pictures: Pictures::new(material, &fits, environment),
            audit: audit(material),
            fits,
            measured: None,
        }
    }

    fn of_measurement(
        material: &'a Material,
        reflectance: &'a dyn Reflectance,
        surface: &Surface,
        environment: &Environment,
    ) -> Self {
        let fits = Fits::to_measurement(surface);
        let sgd = evaluated(material);
        let [beckmann, ggx, gltf] = fits.reflectances();
        let models = [&sgd as &dyn Reflectance, beckmann, ggx, gltf];
        let measured = OfMeasurement {
            reflectance,
            distances: models.map(|model| surface.reference.distance(model)),
            absolute: surface.reference.absolute(&sgd),
        };
        Self {
            material,
            printed_error: None,
            sgd: SgdBrdf::new(material, MaskingKind::Exact),
            pictures: Pictures::of_measurement(material, reflectance, &fits, environment),
            audit: audit(material),
            fits,
            measured: Some(measured),
        }
    }
}

impl Fits {
    fn new(material: &Material) -> Self {
        let beckmann = one_lobe::fit(material, Family::Beckmann);
        let ggx = one_lobe::fit(material, Family::Ggx);
        let gltf = gltf::fit(material);
        Self {
            residuals: [beckmann.per_channel_residuals, ggx.per_channel_residuals, gltf.residuals]
                .map(|residuals| residuals.in_metric(Metric::default())),
            one_lobe: [beckmann.per_channel.brdf(), ggx.per_channel.brdf()],
            beckmann: beckmann.per_channel,
            ggx: ggx.per_channel,
            gltf: gltf.material,
        }
    }

    /// The fits to a measurement, the lobes with one width for all channels.
    fn to_measurement(surface: &Surface) -> Self {
        let [beckmann, ggx] = [Family::Beckmann, Family::Ggx]
            .map(|family| one_lobe_measured::fit(&surface.target, family));
        let gltf = gltf_measured::fit(&surface.target).material;
        let one_lobe = [beckmann.brdf(), ggx.brdf()];
        let residuals =
            |model: &dyn Reflectance| -> Residuals { surface.reference.residuals(model) };
        Self {
            residuals: [residuals(&one_lobe[0]), residuals(&one_lobe[1]), residuals(&gltf)]
                .map(|residuals| residuals.in_metric(Metric::default())),
            one_lobe,
            beckmann,
            ggx,
            gltf,
        }
    }

    /// The fits as reflectances, in the order of [`FIT_NAMES`].
    #[must_use]
    pub fn reflectances(&self) -> [&dyn Reflectance; 3] {
        [&self.one_lobe[0], &self.one_lobe[1], &self.gltf]
    }
}

impl Pictures {
    fn new(material: &Material, fits: &Fits, environment: &Environment) -> Self {
        let sgd = SgdBatch::new(material, MaskingKind::Exact);
        let [beckmann, ggx, gltf] = fits.reflectances();
        let models = [&sgd, beckmann, ggx, gltf];
        let surface = drawn_from(material);
        let [sgd, fits @ ..] = render(&Shape::Ball, environment, &surface, models, QUALITY, &|| ());
        Self {
            fits: fits.map(|fit| {
                let difference = fit.film.delta_e(&sgd.film);
                (fit.film, difference)
            }),
            noise: sgd.noise,
            reference: sgd.film,
            sgd: None,
        }
    }

    fn of_measurement(
        material: &Material,
        measured: &dyn Reflectance,
        fits: &Fits,
        environment: &Environment,
    ) -> Self {
        let (sgd, filled) = (SgdBatch::new(material, MaskingKind::Exact), Filled(measured));
        let [beckmann, ggx, gltf] = fits.reflectances();
        let models: [&dyn Reflectance; 5] = [&filled, &sgd, beckmann, ggx, gltf];
        let surface = drawn_from(material);
        let [reference, models @ ..] =
            render(&Shape::Ball, environment, &surface, models, QUALITY, &|| ());
        let [sgd, fits @ ..] = models.map(|model| {
            let difference = model.film.delta_e(&reference.film);
            (model.film, difference)
        });
        Self { noise: reference.noise, reference: reference.film, sgd: Some(sgd), fits }
    }
}
