//! v = G1/cosθ of a row's lobes in single precision, for tables with millions of texels.

use crate::lut::row::Row;
use crate::lut::term::masking_scale;
use crate::math::arithmetic::{Arithmetic, max, min};
use crate::microfacet::G1Polynomial;

/// Directions that are worked on together.
pub const BLOCK: usize = 128;
/// A value for each direction of a block.
pub type PerDirection = [f32; BLOCK];

/// The coefficients of a polynomial that is fitted, before those that do not count are dropped.
pub const MAX_ORDER: usize = 20;
/// s as a multiple of where masking sets in: the polynomials are shortest around here.
const WIDTH: f64 = 3.0;
/// Below the horizon v continues as far as this u.
const LOWEST: f32 = -0.7;

/// v = G1/cosθ as polynomials.
///
/// # Formula
///
/// With c = cosθ and u = c/(c + s), v·(c + s) is smooth in u from the horizon to the zenith: a
/// polynomial. Below the horizon u = c/s, and v·s continues as its value at the horizon times
/// 1 + y + y²/2, y = u d(ln v)/du there: positive, and smooth across the horizon.
///
/// Every instruction set gives the same bits: products and sums are fused, in software where the
/// machine cannot.
#[derive(Clone, Debug, PartialEq)]
pub struct Visibility {
    /// s.
    scale: f32,
    /// The factor that takes u into [0, 2].
    stretch: f32,
    /// Coefficients over [−1, 1] of each lobe, and how many there are.
    coefficients: [[f32; MAX_ORDER]; 3],
    count: usize,
    /// d(ln v)/du at the horizon, of each lobe.
    log_slope: [f32; 3],
}

impl Visibility {
    /// The polynomials of a row, 0 where there is no lobe. Coefficients are dropped that
    /// change v by less than `accuracy` of it.
    #[must_use]
    pub fn new(row: &Row, accuracy: f64) -> Self {
        let scale = WIDTH * masking_scale(row);
        let mut visibility = Self {
            scale: scale as f32,
            stretch: (2.0 * (1.0 + scale)) as f32,
            coefficients: [[0.0; MAX_ORDER]; 3],
            count: 0,
            log_slope: [0.0; 3],
        };
        for (j, lobe) in row.lobes.iter().enumerate() {
            let Some(lobe) = lobe else { continue };
            let g1 = G1Polynomial::new::<MAX_ORDER>(|cot| lobe.g1(cot), scale, 1.0, accuracy);
            visibility.coefficients[j] = g1.single();
            visibility.count = visibility.count.max(g1.coefficients.len());
            visibility.log_slope[j] = g1.log_slope() as f32;
        }
        visibility
    }

    /// v(wi)·v(wo) of each lobe at cosθi, cosθo = `middle` ∓ `reach`.
    #[inline(always)]
    pub fn products<A: Arithmetic>(
        &self,
        middle: &PerDirection,
        reach: &PerDirection,
    ) -> [PerDirection; 3] {
        // A length known at compile time unrolls; coefficients beyond `count` are 0.
        match self.count {
            0..=10 => self.products_of::<A, 10>(middle, reach),
            11..=12 => self.products_of::<A, 12>(middle, reach),
            13..=14 => self.products_of::<A, 14>(middle, reach),
            15..=16 => self.products_of::<A, 16>(middle, reach),
            _ => self.products_of::<A, MAX_ORDER>(middle, reach),
        }
    }

    /// The same, by polynomials of `N` coefficients.
    #[inline(always)]
    fn products_of<A: Arithmetic, const N: usize>(
        &self,
        middle: &PerDirection,
        reach: &PerDirection,
    ) -> [PerDirection; 3] {
        let empty = [0.0; BLOCK];
        let (mut t_i, mut t_o, mut below, mut inverse) = (empty, empty, empty, empty);
        let inverse_scale = 1.0 / self.scale;
        for k in 0..BLOCK {
            // reach ≥ 0, so only cosθi can be below the horizon.
            let (cos_i, cos_o) = (middle[k] - reach[k], middle[k] + reach[k]);
            // cosθo = middle + reach is never below the horizon.
            let above = max(cos_i, 0.0);
            let (length_i, length_o) = (above + self.scale, cos_o + self.scale);
            // One division for both u and for 1/((c_i + s)(c_o + s)).
            let inverse_both = 1.0 / (length_i * length_o);
            inverse[k] = inverse_both;
            t_i[k] = A::mul_add(above * length_o * inverse_both, self.stretch, -1.0);
            t_o[k] = A::mul_add(cos_o * length_i * inverse_both, self.stretch, -1.0);
            // 0 above the horizon, where `beyond` is 1.
            below[k] = max(min(cos_i, 0.0) * inverse_scale, LOWEST);
        }
        let mut products = [empty; 3];
        for (c, products) in products.iter_mut().enumerate() {
            let coefficients = &self.coefficients[c];
            let slope = self.log_slope[c];
            for (k, product) in products.iter_mut().enumerate() {
                // Horner's rule for both directions at once: two chains hide each other's latency.
                let (mut sum_i, mut sum_o) = (coefficients[N - 1], coefficients[N - 1]);
                for n in (0..N - 1).rev() {
                    sum_i = A::mul_add(sum_i, t_i[k], coefficients[n]);
                    sum_o = A::mul_add(sum_o, t_o[k], coefficients[n]);
                }
                let y = slope * below[k];
                let beyond = A::mul_add(A::mul_add(y, 0.5, 1.0), y, 1.0);
                *product = sum_i * sum_o * (inverse[k] * beyond);
            }
        }
        products
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Lobe, MaskingKind, SgdBrdf};
    use crate::lut::row::Rows;
    use crate::material::catalog;
    use crate::math::arithmetic::Fused;
    use crate::math::direction::cot_of_cos;
    use crate::microfacet::{Accuracy, Sgd};

    #[test]
    fn products_keep_the_accuracy_asked_for() {
        for accuracy in [5e-5, 2e-6] {
            let worst = worst_product(accuracy);
            println!("asked for {accuracy:e}: largest relative error of a product {worst:.2e}");
            assert!(worst < 2.0 * accuracy + POLYNOMIALS, "{worst:e}");
        }
    }

    /// The error of a product by the longest polynomials.
    const POLYNOMIALS: f64 = 1.5e-5;

    /// G1/cosθ.
    fn visibility_of(lobe: &Lobe<Sgd>, cos: f64) -> f64 {
        let cos = cos.clamp(1e-12, 1.0);
        lobe.g1(cot_of_cos(cos)) / cos
    }

    fn worst_product(accuracy: f64) -> f64 {
        let mut worst: f64 = 0.0;
        for entry in catalog() {
            let kind = MaskingKind::Exact;
            let brdf = SgdBrdf::with_accuracy(&entry.material, kind, Accuracy::Table).tabulated();
            let mut rows = Rows::default();
            rows.push("", &brdf, [true; 3]);
            let visibility = Visibility::new(&rows.lobes[0], accuracy);
            let middle: PerDirection = std::array::from_fn(|k| 0.5 * (-(k as f32) / 10.0).exp());
            let reach = middle.map(|m| m * (8.0 * std::f32::consts::PI * m).cos().abs());
            let products = visibility.products::<Fused>(&middle, &reach);
            for k in 0..BLOCK {
                let cos = [middle[k] - reach[k], middle[k] + reach[k]].map(f64::from);
                for (products, lobe) in products.iter().zip(&brdf.lobes) {
                    let exact = visibility_of(lobe, cos[0]) * visibility_of(lobe, cos[1]);
                    worst = worst.max((f64::from(products[k]) / exact - 1.0).abs());
                }
            }
        }
        worst
    }
}
