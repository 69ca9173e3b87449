//! Speed against error: every way this crate can evaluate a material, timed and held against the
//! exact f64 value in the same run.

use std::time::Duration;

use serde::Serialize;

use crate::lut::BakeError;
use crate::material::Material;
use crate::report::deviation::{Deviation, Yardstick};
use crate::report::methods::{Hemisphere, Method, methods};
use crate::report::pareto_front::margins;
use crate::report::stopwatch::{Patience, Timing, measure};

pub use crate::report::methods::{Effort, MethodFamily};

/// A material's methods with their time and error.
#[derive(Clone, Debug, Serialize)]
pub struct SpeedError {
    /// The material.
    pub material: String,
    /// Every method.
    pub methods: Vec<Measured>,
}

/// A method's figures.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// Its name.
    pub method: String,
    /// Kind of method.
    pub family: MethodFamily,
    /// Time of one RGB evaluation.
    pub time: Timing,
    /// Parameters or texels that must be stored \[bytes\].
    pub bytes: usize,
    /// Time to make it from the material's parameters: the bake, the fit \[ms\].
    pub preparation_ms: f64,
    /// Error against exact f64.
    pub error: Deviation,
    /// True on the Pareto front of time and largest error: `margin` > 1.
    pub front: bool,
    /// Its time ratio over the limit that comes nearest to pushing it off, see [`margins`]; null in
    /// JSON where no other method can.
    pub margin: f64,
}

/// Measures a material's methods.
///
/// # Errors
///
/// A table that cannot be baked.
pub fn speed_error(material: &Material, effort: Effort) -> Result<SpeedError, BakeError> {
    let methods = methods(material, effort)?;
    let yardstick = Yardstick::new(material);
    let errors: Vec<Deviation> =
        methods.iter().map(|method| yardstick.measure(method.reflectance())).collect();
    let pairs = Hemisphere::new();
    let rounds = measure(methods.iter().map(|m| m.job(&pairs)).collect(), effort.patience());
    let margins = margins(&rounds, &errors.iter().map(|error| error.max).collect::<Vec<_>>());
    let figures = rounds.timings().into_iter().zip(errors).zip(margins);
    let methods = methods
        .iter()
        .zip(figures)
        .map(|(method, ((time, error), margin))| Measured::of(method, time, error, margin))
        .collect();
    Ok(SpeedError { material: material.name.clone(), methods })
}

/// Far shorter than a scheduler's time slice: of many such rounds on a busy machine, few are cut.
const ROUND: Duration = Duration::from_micros(50);

impl Effort {
    fn patience(self) -> Patience {
        match self {
            Self::Quick => Patience { repeats: 51, round: ROUND },
            Self::Full => Patience { repeats: 201, round: ROUND },
        }
    }
}

impl Measured {
    fn of(method: &Method, time: Timing, error: Deviation, margin: f64) -> Self {
        Self {
            method: method.name.clone(),
            family: method.family,
            time,
            bytes: method.bytes,
            preparation_ms: method.preparation.as_secs_f64() * 1e3,
            error,
            front: margin > 1.0,
            margin,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::find;

    #[test]
    fn every_family_is_measured_and_the_exact_one_is_exact() {
        let material = &find("gold-paint").expect("in the catalogue").material;
        let report = speed_error(material, Effort::Quick).expect("bakes");
        for family in MethodFamily::ALL {
            assert!(report.methods.iter().any(|m| m.family == family), "{family:?}");
        }
        let exact = &report.methods[0];
        assert!(exact.front && exact.error.max == 0.0 && exact.time.median_ns > 0.0);
        let [ggx, table, f32_exact] =
            ["GGX", "table 512 float, filtered", "f32 exact"].map(|name| {
                let method = report.methods.iter().find(|method| method.method == name);
                method.unwrap_or_else(|| panic!("no {name}")).error.max
            });
        assert!(ggx > 100.0 * table && f32_exact < 1e-4);
    }
}
