//! A measured surface: what fits aim at, and how far each of them is from it.

use serde::Serialize;

use crate::asset::Distances;
use crate::brdf::{MaskingKind, Reflectance, SgdBrdf};
use crate::fit::measured_target::{MeasuredTarget, NothingMeasured};
use crate::fit::sgd::{self, Options, SgdFit};
use crate::material::{Material, MaterialError};
use crate::microfacet::Accuracy;
use crate::report::distance::{Distance, Reference};

/// A measurement as fits see it and as they are judged by.
pub struct Surface {
    /// The reflectance that is fitted to.
    pub target: MeasuredTarget,
    /// What it is compared with, at other pairs of directions and under other lights.
    pub reference: Reference,
}

/// An SGD material fitted to a measurement.
#[derive(Clone, Debug)]
pub struct SurfaceFit {
    /// The parameters and their standard errors.
    pub fit: SgdFit,
    /// The material of the parameters.
    pub material: Material,
    /// Its distance from the measurement.
    pub distance: Distance,
}

/// A measurement that no material can be fitted to.
#[derive(Debug, thiserror::Error)]
pub enum SurfaceError {
    /// Nothing in it to fit to.
    #[error(transparent)]
    Nothing(#[from] NothingMeasured),
    /// Parameters that no material can have.
    #[error("the fit left the range of materials: {0}")]
    Material(#[from] MaterialError),
}

/// A model's name and its distance.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ModelDistance {
    /// The model.
    pub model: &'static str,
    /// Its distance from the measurement.
    #[serde(flatten)]
    pub distance: Distance,
}

impl Surface {
    /// The surface of a measurement that is isotropic and reciprocal: an averaged one.
    ///
    /// # Errors
    ///
    /// [`NothingMeasured`]: no valid value where a fit looks.
    pub fn new(measured: &dyn Reflectance) -> Result<Self, NothingMeasured> {
        let (target, reference) =
            rayon::join(|| MeasuredTarget::of(measured), || Reference::new(measured));
        Ok(Self { target: target?, reference })
    }

    /// The best SGD material.
    ///
    /// # Errors
    ///
    /// Parameters out of range.
    pub fn fit(&self, name: &str, options: Options) -> Result<SurfaceFit, MaterialError> {
        let fit = sgd::fit(&self.target, options);
        let material = fit.model.material(name)?;
        let distance = self.reference.distance(&evaluated(&material));
        Ok(SurfaceFit { fit, material, distance })
    }

    /// How far a model is from the surface, as an asset states it.
    #[must_use]
    pub fn distances(&self, model: &dyn Reflectance) -> Distances {
        self.reference.distance(model).into()
    }
}

/// A material with its exact masking from a table.
#[must_use]
pub fn evaluated(material: &Material) -> SgdBrdf {
    SgdBrdf::with_accuracy(material, MaskingKind::Exact, Accuracy::Table).tabulated()
}
