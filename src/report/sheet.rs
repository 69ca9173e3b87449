//! The numbers and pictures of a material sheet: those that the paper's supplement prints of a
//! material, and those of the best fits, measured when the sheet is written.

use crate::asset::{DirectFits, Distances, GltfAt, direct_fits_of};
use crate::brdf::batch::SgdBatch;
use crate::brdf::gltf::GltfBrdf;
use crate::brdf::{Brdf, MaskingKind, OneLobe, Reflectance, SgdBrdf};
use crate::fit::target::Residuals;
use crate::fit::{Metric, Target, gltf, gltf_measured, one_lobe, one_lobe_measured};
use crate::material::{Edition, Material, find};
use crate::measurement::Filled;
use crate::microfacet::{Family, OneWidth};
use crate::preview::film::DeltaE;
use crate::preview::render::{Quality, Render, drawn_from, render};
use crate::preview::{Environment, Film, Shape};
use crate::report::audit::{Audit, audit};
use crate::report::surface::{Surface, evaluated};

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
    /// How far each model is from the measured surface, where that is known.
    pub distances: Vec<(&'static str, Distances)>,
    /// The measurement that the material was fitted to.
    pub measured: Option<OfMeasurement<'a>>,
}

/// The measurement that the models of a sheet are compared with.
pub struct OfMeasurement<'a> {
    /// Its values, NaN where there is none.
    pub reflectance: &'a dyn Reflectance,
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
    /// What the reference is.
    pub of: &'static str,
    /// Every other: SGD beside a measurement, the catalogue's editions, then the fits.
    pub models: Vec<Picture>,
    /// The noise of the pictures.
    pub noise: f64,
}

/// The picture of a model.
pub struct Picture {
    /// The model's name.
    pub name: &'static str,
    /// The picture.
    pub film: Film,
    /// Its difference to the reference.
    pub difference: DeltaE,
}

/// Names of the fits in the order of every `[T; 3]` of fits.
pub const FIT_NAMES: [&str; 3] = ["Beckmann", "GGX", "glTF"];

/// Pictures good enough for the page: 160 pixels on a phone's screen.
pub const QUALITY: Quality = Quality { size: 160, samples: 96, seed: 1 };

impl<'a> Sheet<'a> {
    /// The sheet of a material, its pictures taken under `environment`.
    #[must_use]
    pub fn new(material: &'a Material, environment: &Environment) -> Self {
        let published = find(&material.name).ok().filter(|entry| entry.material == *material);
        let edition = Edition::of(material);
        // The catalogue holds the fits to its own measurement; others are fitted to the material.
        let fits = direct_fits_of(material)
            .map_or_else(|| Fits::new(material), |direct| Fits::of_catalogue(material, direct));
        let mut pictures = Pictures::new(material, edition, &fits, environment);
        if let Some(other) = edition.map(Edition::other) {
            pictures.add_edition(0, other, material, environment);
        }
        Self {
            material,
            printed_error: published.map(|entry| entry.printed.map(|row| row.error)),
            sgd: SgdBrdf::new(material, MaskingKind::Exact),
            pictures,
            distances: edition.map(|edition| stated(edition, material)).unwrap_or_default(),
            audit: audit(material),
            fits,
            measured: None,
        }
    }

    /// The sheet of a measurement and the material that was fitted to it: Beckmann, GGX and glTF are
    /// fitted to the measurement too, and everything is compared with it.
    #[must_use]
    pub fn of_measurement(
        material: &'a Material,
        reflectance: &'a dyn Reflectance,
        surface: &Surface,
        environment: &Environment,
    ) -> Self {
        let fits = Fits::to_measurement(surface);
        let sgd = evaluated(material);
        let mut distances = vec![("SGD", surface.distances(&sgd))];
        let mut pictures = Pictures::of_measurement(material, reflectance, &fits, environment);
        // A measurement with the name of a catalogue material is compared with the paper's fit too.
        if let Some(published) = Edition::Published.material(&material.name) {
            let distance = surface.distances(&evaluated(published));
            distances.push((sgd_name(Edition::Published), distance));
            pictures.add_edition(1, Edition::Published, material, environment);
        }
        let of_fits = fits.reflectances().map(|fit| surface.distances(fit));
        distances.extend(FIT_NAMES.into_iter().zip(of_fits));
        Self {
            material,
            printed_error: None,
            measured: Some(OfMeasurement {
                reflectance,
                absolute: surface.reference.absolute(&sgd),
            }),
            sgd: SgdBrdf::new(material, MaskingKind::Exact),
            pictures,
            distances,
            audit: audit(material),
            fits,
        }
    }
}

/// How a page names the SGD material of an edition.
fn sgd_name(edition: Edition) -> &'static str {
    match edition {
        Edition::Published => "SGD as published",
        Edition::Refit => "SGD refitted",
    }
}

/// The distances of both editions and of the fits to one of them from the measured surface, as the
/// catalogue states them.
fn stated(edition: Edition, material: &Material) -> Vec<(&'static str, Distances)> {
    let direct = Edition::Refit.material(&material.name).and_then(direct_fits_of);
    let rows = direct.map(|DirectFits { published, refit, beckmann, ggx, gltf, .. }| {
        let fits = match edition {
            Edition::Published => {
                [beckmann.of_published.error, ggx.of_published.error, gltf.of_published.error]
            }
            Edition::Refit => [beckmann.measured.error, ggx.measured.error, gltf.measured.error],
        };
        let editions = [(Edition::Published, *published), (Edition::Refit, *refit)];
        let editions = editions.map(|(edition, distances)| (sgd_name(edition), distances));
        editions.into_iter().chain(FIT_NAMES.into_iter().zip(fits)).collect()
    });
    rows.unwrap_or_default()
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

    /// The fits to the measurement of a refitted material, as the catalogue holds them, with their
    /// residuals to the material.
    fn of_catalogue(material: &Material, direct: &DirectFits) -> Self {
        let target = Target::new(material);
        let [beckmann, ggx] = [&direct.beckmann, &direct.ggx].map(|fits| fits.measured.lobe);
        let GltfAt { material: gltf, .. } = direct.gltf.measured;
        Self::with(beckmann, ggx, gltf, |model| target.residuals(model))
    }

    /// The fits to a measurement, the lobes with one width for all channels.
    fn to_measurement(surface: &Surface) -> Self {
        let [beckmann, ggx] = [Family::Beckmann, Family::Ggx]
            .map(|family| one_lobe_measured::fit(&surface.target, family));
        let gltf = gltf_measured::fit(&surface.target).material;
        Self::with(beckmann, ggx, gltf, |model| surface.reference.residuals(model))
    }

    fn with(
        beckmann: OneLobe,
        ggx: OneLobe,
        gltf: GltfBrdf,
        residuals: impl Fn(&dyn Reflectance) -> Residuals,
    ) -> Self {
        let one_lobe = [beckmann.brdf(), ggx.brdf()];
        let models: [&dyn Reflectance; 3] = [&one_lobe[0], &one_lobe[1], &gltf];
        let residuals = models.map(|model| residuals(model).in_metric(Metric::default()));
        Self { residuals, one_lobe, beckmann, ggx, gltf }
    }

    /// The fits as reflectances, in the order of [`FIT_NAMES`].
    #[must_use]
    pub fn reflectances(&self) -> [&dyn Reflectance; 3] {
        [&self.one_lobe[0], &self.one_lobe[1], &self.gltf]
    }
}

impl Pictures {
    fn new(
        material: &Material,
        edition: Option<Edition>,
        fits: &Fits,
        environment: &Environment,
    ) -> Self {
        let sgd = SgdBatch::new(material, MaskingKind::Exact);
        let [beckmann, ggx, gltf] = fits.reflectances();
        let models = [&sgd, beckmann, ggx, gltf];
        let surface = drawn_from(material);
        let [sgd, fits @ ..] = render(&Shape::Ball, environment, &surface, models, QUALITY, &|| ());
        Self::beside(edition.map_or("SGD", sgd_name), sgd, FIT_NAMES.into_iter().zip(fits))
    }

    fn of_measurement(
        material: &Material,
        measured: &dyn Reflectance,
        fits: &Fits,
        environment: &Environment,
    ) -> Self {
        // A picture has no gaps: NaN would spread over its pixel.
        let (sgd, filled) = (SgdBatch::new(material, MaskingKind::Exact), Filled(measured));
        let [beckmann, ggx, gltf] = fits.reflectances();
        let models: [&dyn Reflectance; 5] = [&filled, &sgd, beckmann, ggx, gltf];
        let surface = drawn_from(material);
        let [reference, models @ ..] =
            render(&Shape::Ball, environment, &surface, models, QUALITY, &|| ());
        let names = std::iter::once("SGD").chain(FIT_NAMES);
        Self::beside("The measurement", reference, names.zip(models))
    }

    /// The pictures of models beside a reference.
    fn beside(
        of: &'static str,
        reference: Render,
        models: impl Iterator<Item = (&'static str, Render)>,
    ) -> Self {
        let Render { film: reference, noise } = reference;
        let models = models
            .map(|(name, Render { film, .. })| Picture::new(name, film, &reference))
            .collect();
        Self { models, reference, of, noise }
    }

    /// Adds the picture of an edition of a material, with the same directions as the others.
    fn add_edition(
        &mut self,
        place: usize,
        edition: Edition,
        material: &Material,
        environment: &Environment,
    ) {
        let Some(edited) = edition.material(&material.name) else { return };
        let sgd = SgdBatch::new(edited, MaskingKind::Exact);
        // The sampler of the first pictures, so that both see the same directions.
        let surface = drawn_from(material);
        let [sgd] = render(&Shape::Ball, environment, &surface, [&sgd], QUALITY, &|| ());
        let picture = Picture::new(sgd_name(edition), sgd.film, &self.reference);
        self.models.insert(place, picture);
    }

    /// The pictures of the fits, in the order of [`FIT_NAMES`].
    #[must_use]
    pub fn of_fits(&self) -> [&Picture; 3] {
        let first = self.models.len() - FIT_NAMES.len();
        std::array::from_fn(|i| &self.models[first + i])
    }
}

impl Picture {
    fn new(name: &'static str, film: Film, reference: &Film) -> Self {
        Self { name, difference: film.delta_e(reference), film }
    }
}
