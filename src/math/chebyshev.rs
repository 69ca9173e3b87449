//! Polynomials through a function's values at Chebyshev's nodes: as good as the best ones of their
//! degree, but for a small factor.

use std::f64::consts::PI;

use nalgebra::SMatrix;

/// Chebyshev's nodes on [−1, 1].
#[must_use]
pub fn nodes<const N: usize>() -> [f64; N] {
    std::array::from_fn(|k| (PI * (k as f64 + 0.5) / N as f64).cos())
}

/// From values at the nodes to the coefficients of the polynomial through them, lowest power first.
///
/// # Panics
///
/// Never: the nodes are distinct.
#[must_use]
pub fn interpolation<const N: usize>() -> SMatrix<f64, N, N> {
    let nodes = nodes::<N>();
    SMatrix::<f64, N, N>::from_fn(|row, power| nodes[row].powi(power as i32))
        .try_inverse()
        .expect("the Vandermonde matrix of distinct nodes is regular")
}

#[cfg(test)]
mod tests {
    use nalgebra::SVector;

    use super::*;

    #[test]
    fn a_polynomial_comes_back() {
        let cubic = |x: f64| 1.0 - 2.0 * x + 0.5 * x.powi(3);
        let values = SVector::from(nodes::<6>().map(cubic));
        let coefficients = interpolation::<6>() * values;
        for (found, expected) in coefficients.iter().zip([1.0, -2.0, 0.0, 0.5, 0.0, 0.0]) {
            assert!((found - expected).abs() < 1e-14, "{coefficients}");
        }
    }
}
