//! The material sheet: what the paper's supplement prints of a material, and what the fits make
//! of it, measured when the sheet is written.

use crate::brdf::batch::SgdBatch;
use crate::brdf::gltf::GltfBrdf;
use crate::brdf::{Brdf, MaskingKind, OneLobe, Reflectance, SgdBrdf};
use crate::fit::{Metric, gltf, one_lobe};
use crate::material::{Material, find};
use crate::microfacet::{Family, OneWidth};
use crate::preview::film::{DeltaE, FilmError};
use crate::preview::render::{Quality, drawn_from, render};
use crate::preview::{Environment, Film, Shape};
use crate::report::audit::{Audit, audit};
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
    /// Pictures of the measured material and of the fits.
    pub pictures: Pictures,
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
    /// The measured material.
    pub sgd: Film,
    /// Beckmann, GGX, glTF, each with its difference to the measured material.
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
    let sheet = Sheet::new(material, environment);
    Ok(Page {
        name: material.name.clone(),
        html: sheet_page::html(&sheet, &sheet_plots::plots(&sheet))?,
        thumbnail: sheet.pictures.sgd.halved().to_png()?,
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
            sgd: sgd.film,
        }
    }
}
