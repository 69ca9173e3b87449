//! Quadrature rules.

use nalgebra::{DMatrix, SymmetricEigen};

/// A node in [0, 1] and its share of the total weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Where the integrand is evaluated.
    pub x: f64,
    /// The node's weight; a rule's weights sum to 1.
    pub weight: f64,
}

/// Gauss–Jacobi rule for p ∫_0^1 y^{p−1} h(y) dy ≈ Σ weight·h(x), p ≥ 0, nodes ascending.
///
/// # Formula
///
/// Golub and Welsch (1969): nodes are the eigenvalues of the symmetric tridiagonal matrix of the
/// recurrence of the Jacobi polynomials P^(0,p−1) on [0, 1], weights the squares of the first
/// components of its eigenvectors. The recurrence is written in p itself, so nothing is lost for
/// p as small as 1e-15; at p = 0 the rule degenerates to the value h(0), as the integral does.
#[must_use]
pub fn gauss_jacobi(p: f64, nodes: usize) -> Vec<Node> {
    let mut matrix = DMatrix::zeros(nodes, nodes);
    for k in 0..nodes {
        matrix[(k, k)] = jacobi_diagonal(p, k as f64);
        if k > 0 {
            let b = jacobi_off_diagonal(p, k as f64);
            matrix[(k, k - 1)] = b;
            matrix[(k - 1, k)] = b;
        }
    }
    let eigen = SymmetricEigen::new(matrix);
    let first_components = eigen.eigenvectors.row(0);
    let mut rule: Vec<Node> = eigen
        .eigenvalues
        .iter()
        .zip(first_components.iter())
        // Rounding may leave an eigenvalue outside; integrands are only defined inside.
        .map(|(x, v)| Node { x: x.clamp(0.0, 1.0), weight: v * v })
        .collect();
    rule.sort_by(|a, b| a.x.total_cmp(&b.x));
    rule
}

/// Gauss–Legendre rule for ∫_0^1 h(y) dy: the Jacobi rule with p = 1.
#[must_use]
pub fn gauss_legendre(nodes: usize) -> Vec<Node> {
    gauss_jacobi(1.0, nodes)
}

/// The diagonal coefficient a_k of the monic Jacobi recurrence on [0, 1].
fn jacobi_diagonal(p: f64, k: f64) -> f64 {
    if k == 0.0 {
        // The general form is 0/0 here at p = 1.
        return p / (p + 1.0);
    }
    let m = 2.0 * k + p;
    0.5 + 0.5 * (p - 1.0).powi(2) / ((m - 1.0) * (m + 1.0))
}

/// The off-diagonal coefficient √b_k; k = 1 apart because its general form is 0/0 at p = 0.
fn jacobi_off_diagonal(p: f64, k: f64) -> f64 {
    if k == 1.0 {
        return (p / (p + 2.0)).sqrt() / (p + 1.0);
    }
    let m = 2.0 * k + p;
    k * (k + p - 1.0) / ((m - 1.0) * (m * (m - 2.0)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrates_every_polynomial_up_to_degree_2n_minus_1() {
        for p in [0.0, 4.6e-15, 0.3, 1.0, 1.78, 4.0] {
            let rule = gauss_jacobi(p, 6);
            for degree in 0..12 {
                let sum: f64 = rule.iter().map(|n| n.weight * n.x.powi(degree)).sum();
                let exact = if degree == 0 { 1.0 } else { p / (p + f64::from(degree)) };
                assert!((sum - exact).abs() < 1e-14, "p {p} degree {degree}: {sum} {exact}");
            }
        }
    }
}
