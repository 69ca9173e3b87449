//! The evaluator that a command asks for: which masking, in which arithmetic.

use clap::ValueEnum;
use glam::DVec3;

use sgdbake::brdf::{LobeCurves, MaskingKind, SgdBatch, SgdBrdf, Terms};
use sgdbake::material::Material;
use sgdbake::math::direction::cos_sin_degrees;

/// How to evaluate.
#[derive(Debug, clap::Args)]
pub struct Evaluation {
    /// The masking function
    #[arg(long, value_enum, default_value_t)]
    masking: MaskingKind,
    /// The arithmetic: the reference in f64, or the f32 batch path
    #[arg(long, value_enum, default_value_t)]
    precision: Precision,
}

/// The arithmetic to evaluate in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Precision {
    /// Double precision, the reference
    #[default]
    F64,
    /// Single precision, as whole slices of pairs are evaluated
    F32,
}

impl Evaluation {
    /// The materials with an evaluator each.
    #[must_use]
    pub fn of_all<'m>(&self, materials: &'m [Material]) -> Vec<Evaluated<'m>> {
        // One material needs no name, as the caller gave it.
        let named = materials.len() > 1;
        let evaluated = materials.iter().map(|material| Evaluated {
            material,
            name: named.then_some(material.name.as_str()),
            evaluator: self.of(material),
        });
        evaluated.collect()
    }

    fn of(&self, material: &Material) -> Evaluator {
        match self.precision {
            Precision::F64 => Evaluator::Double(SgdBrdf::new(material, self.masking)),
            Precision::F32 => Evaluator::Single(SgdBatch::new(material, self.masking)),
        }
    }
}

/// A material to evaluate.
pub struct Evaluated<'m> {
    /// The material.
    pub material: &'m Material,
    /// The name that its results carry.
    pub name: Option<&'m str>,
    /// Its evaluator.
    pub evaluator: Evaluator,
}

/// A line of numbers after a name.
#[must_use]
pub fn columns(name: &str, numbers: &[f64]) -> String {
    numbers.iter().fold(name.to_owned(), |line, n| format!("{line} {n:>12.6e}"))
}

/// An evaluator in the chosen precision.
pub enum Evaluator {
    /// The reference.
    Double(SgdBrdf),
    /// The batch path.
    Single(SgdBatch),
}

impl Evaluator {
    /// f and its terms for a pair of directions.
    #[must_use]
    pub fn terms(&self, wi: DVec3, wo: DVec3) -> Terms {
        match self {
            Self::Double(brdf) => brdf.terms(wi, wo),
            Self::Single(batch) => batch.terms(wi.as_vec3(), wo.as_vec3()),
        }
    }

    /// The factors of each lobe against one angle.
    #[must_use]
    pub fn curves(&self, theta_deg: f64) -> Vec<LobeCurves> {
        let (cos, sin) = cos_sin_degrees(theta_deg);
        match self {
            Self::Double(brdf) => brdf.lobes.iter().map(|lobe| lobe.curves(cos, sin)).collect(),
            Self::Single(batch) => batch.curves(cos as f32, sin as f32),
        }
    }
}
