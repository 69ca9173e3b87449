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

/// The coefficients a of Σ a_j T_j through values at the nodes.
#[must_use]
pub fn series<const N: usize>(values: [f64; N]) -> [f64; N] {
    std::array::from_fn(|j| {
        let angles = (0..N).map(|k| PI * j as f64 * (k as f64 + 0.5) / N as f64);
        // The cosines are orthogonal over the nodes, so each coefficient is a plain sum.
        let sum: f64 = values.iter().zip(angles).map(|(value, angle)| value * angle.cos()).sum();
        if j == 0 { sum / N as f64 } else { 2.0 * sum / N as f64 }
    })
}

/// Σ a_j T_j as coefficients of powers, lowest first: T_j+1 = 2x T_j − T_j−1.
#[must_use]
pub fn powers(series: &[f64]) -> Vec<f64> {
    let n = series.len();
    // T_{j−2} and T_{j−1} as powers, while `next` is T_j.
    let (mut before, mut now) = (vec![0.0; n], vec![0.0; n]);
    let mut powers = vec![0.0; n];
    for (j, a) in series.iter().enumerate() {
        let next: Vec<f64> = (0..n)
            .map(|k| match (j, k) {
                (0, _) => f64::from(k == 0),
                (1, _) => f64::from(k == 1),
                (_, 0) => -before[0],
                _ => 2.0 * now[k - 1] - before[k],
            })
            .collect();
        powers.iter_mut().zip(&next).for_each(|(power, t)| *power += a * t);
        (before, now) = (now, next);
    }
    powers
}

#[cfg(test)]
mod tests {
    use nalgebra::SVector;

    use super::*;

    fn cubic(x: f64) -> f64 {
        1.0 - 2.0 * x + 0.5 * x.powi(3)
    }

    #[test]
    fn a_polynomial_comes_back() {
        let values = SVector::from(nodes::<6>().map(cubic));
        let coefficients = interpolation::<6>() * values;
        for (found, expected) in powers(&series(nodes::<6>().map(cubic))).iter().zip(&coefficients)
        {
            assert!((found - expected).abs() < 1e-14, "{coefficients}");
        }
        for (found, expected) in coefficients.iter().zip([1.0, -2.0, 0.0, 0.5, 0.0, 0.0]) {
            assert!((found - expected).abs() < 1e-14, "{coefficients}");
        }
    }
}
