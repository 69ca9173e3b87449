//! The ranges in which parameters mean something.

/// A parameter outside the range in which the model is defined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} = {} is out of range; it must be {accepted}", written(*.value))]
pub struct ParameterError {
    /// The key as it stands in a file, e.g. `alpha`.
    pub key: &'static str,
    /// The value found.
    pub value: f64,
    /// The accepted range, in words.
    pub accepted: &'static str,
}

/// A number as one writes it: 1e308 without its zeros.
fn written(value: f64) -> String {
    let short = value == 0.0 || !value.is_finite() || (1e-4..1e6).contains(&value.abs());
    if short { value.to_string() } else { format!("{value:e}") }
}

/// The range a parameter must lie in.
#[derive(Clone, Copy)]
pub(super) struct Range {
    lowest: f64,
    highest: f64,
    words: &'static str,
}

/// Widths from a lobe that is a mirror for every picture to slopes that no surface has.
pub(super) const ALPHA: Range =
    Range { lowest: 1e-8, highest: 100.0, words: "between 1e-8 and 100" };
/// Exponents; the published ones end at 1.8. Beyond, the masking loses digits: at 20 its error is
/// 3e-10 where 1e-12 is promised, and 2e-3 where 1e-3 is asked for.
pub(super) const P: Range = Range { lowest: 0.0, highest: 10.0, words: "between 0 and 10" };
/// Diffuse and specular scales; the published ones end below 5. Beyond, f32 textures overflow.
pub(super) const SCALE: Range = Range { lowest: 0.0, highest: 1e4, words: "between 0 and 1e4" };
/// Fresnel parameters; the published ones end at 8.5.
pub(super) const FRESNEL: Range =
    Range { lowest: -1e4, highest: 1e4, words: "between -1e4 and 1e4" };
/// Masking parameters; c of the published ones reaches 1e109.
pub(super) const MASKING: Range =
    Range { lowest: f64::MIN_POSITIVE, highest: f64::MAX, words: "a finite number above 0" };

impl Range {
    pub(super) fn check(self, key: &'static str, value: f64) -> Result<(), ParameterError> {
        // A NaN lies in no range.
        if (self.lowest..=self.highest).contains(&value) {
            Ok(())
        } else {
            Err(ParameterError { key, value, accepted: self.words })
        }
    }

    pub(super) fn check_all(
        self,
        key: &'static str,
        values: [f64; 3],
    ) -> Result<(), ParameterError> {
        values.into_iter().try_for_each(|value| self.check(key, value))
    }
}
