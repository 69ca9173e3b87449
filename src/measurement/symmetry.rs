//! The symmetries of an isotropic reciprocal surface, which measurements keep only on average.

use glam::DVec3;

use crate::brdf::Reflectance;

/// The pairs at which such a surface has one value: φd, −φd, φd + π and π − φd.
#[must_use]
pub fn symmetric_pairs(wi: DVec3, wo: DVec3) -> [[DVec3; 2]; 4] {
    let [mirrored_wi, mirrored_wo] = [wi, wo].map(|w| DVec3::new(w.x, -w.y, w.z));
    [[wi, wo], [mirrored_wi, mirrored_wo], [wo, wi], [mirrored_wo, mirrored_wi]]
}

/// The values of a reflectance at the pairs of [`symmetric_pairs`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Their mean; NaN where none was measured.
    pub mean: [f64; 3],
    /// Their standard deviation, of the mean of the colours relative to its mean: an estimate of
    /// the noise. Values that are equal count once: a format may store several pairs as one.
    /// `None` where fewer than two pairs were measured, or all are 0.
    pub relative: Option<f64>,
}

impl Spread {
    /// The spread of `reflectance` at a pair; NaN values are left out.
    #[must_use]
    pub fn of(reflectance: &dyn Reflectance, wi: DVec3, wo: DVec3) -> Self {
        let values = symmetric_pairs(wi, wo).map(|[wi, wo]| reflectance.eval(wi, wo));
        // If no pair was measured, the mean is 0/0: NaN, as documented.
        let measured: Vec<[f64; 3]> =
            values.into_iter().filter(|f| f.iter().all(|f| !f.is_nan())).collect();
        let mean = std::array::from_fn(|c| {
            measured.iter().map(|f| f[c]).sum::<f64>() / measured.len() as f64
        });
        Self { mean, relative: relative_deviation(&measured) }
    }
}

/// Relative difference up to which two values are one that is stored once, and rounding.
const EQUAL: f64 = 1e-9;

/// √(Σ (x − x̄)²/(n − 1))/x̄ of the means of the colours that differ.
fn relative_deviation(values: &[[f64; 3]]) -> Option<f64> {
    let mut grey: Vec<f64> = values.iter().map(|f| f.iter().sum::<f64>() / 3.0).collect();
    // Counted before equal values are merged: two of them are a spread of 0.
    let measured = grey.len();
    grey.sort_by(f64::total_cmp);
    grey.dedup_by(|a, b| (*a - *b).abs() <= EQUAL * b.abs());
    let n = grey.len() as f64;
    let mean = grey.iter().sum::<f64>() / n;
    let squares: f64 = grey.iter().map(|x| (x - mean).powi(2)).sum();
    // One distinct value has squares 0, and the divisor 1 gives a spread of 0.
    let variance = squares / (n - 1.0).max(1.0);
    (measured > 1 && mean > 0.0).then(|| variance.sqrt() / mean)
}

/// A reflectance averaged over its symmetries: exactly isotropic and reciprocal.
pub struct Averaged<'a>(pub &'a dyn Reflectance);

impl Reflectance for Averaged<'_> {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        Spread::of(self.0, wi, wo).mean
    }
}
