//! Shapes (α, p) that no catalogue holds, against 40-digit values and against integrals done by a
//! quadrature that shares no code with the library.

mod common;

use common::double_exponential::integrate;
use sgdbake::material::catalog;
use sgdbake::math::exponential_integral::scaled_exponential_integral;
use sgdbake::microfacet::{BeckmannMixture, Distribution as _, SgdNdf};
use std::f64::consts::PI;

/// alpha,p,scaled_e,cot_theta,ndf,lambda,g1; made by generate_reference.py beside it.
const TABLE: &str = include_str!("data/shape-reference.csv");

struct Row {
    alpha: f64,
    p: f64,
    scaled_e: f64,
    cot: f64,
    ndf: f64,
    lambda: f64,
    g1: f64,
}

fn rows() -> Vec<Row> {
    TABLE
        .lines()
        .skip(1)
        .map(|line| {
            let numbers: Vec<f64> = line
                .split(',')
                .map(|text| text.parse().expect("the table holds numbers"))
                .collect();
            let [alpha, p, scaled_e, cot, ndf, lambda, g1] = numbers[..] else {
                panic!("seven columns: {line}");
            };
            Row { alpha, p, scaled_e, cot, ndf, lambda, g1 }
        })
        .collect()
}

fn relative(value: f64, expected: f64) -> f64 {
    (value / expected - 1.0).abs()
}

#[test]
fn gamma_distribution_and_masking_match_40_digit_values() {
    let rows = rows();
    assert_eq!(rows.len(), 8 * 13 * 6);
    let mut worst = [0.0_f64; 4];
    for row in &rows {
        let masking = BeckmannMixture::new(row.alpha, row.p, 1e-13);
        let errors = [
            relative(scaled_exponential_integral(row.p, row.alpha), row.scaled_e),
            relative(SgdNdf::new(row.alpha, row.p).ndf(row.cot * row.cot), row.ndf),
            if row.lambda < 1e-12 { 0.0 } else { relative(masking.lambda(row.cot), row.lambda) },
            relative(masking.g1(row.cot), row.g1),
        ];
        for (worst, error) in worst.iter_mut().zip(errors) {
            if error > *worst && error > 1e-13 {
                println!("α {} p {} cot {}: {errors:?}", row.alpha, row.p, row.cot);
            }
            *worst = worst.max(error);
        }
    }
    println!(
        "largest errors: eˣE_p {:e}, D {:e}, Λ {:e}, G1 {:e}",
        worst[0], worst[1], worst[2], worst[3]
    );
    let [e, d, lambda, g1] = worst;
    assert!(e <= 2e-14 && d <= 1e-12 && lambda <= 1e-8 && g1 <= 1e-12, "{worst:?}");
}

#[test]
fn masking_keeps_the_accuracy_that_was_asked_for() {
    for accuracy in [1e-3, 1e-6, 1e-9, 1e-12] {
        let mut nodes = 0;
        let mut worst: f64 = 0.0;
        for row in rows() {
            let mixture = BeckmannMixture::new(row.alpha, row.p, accuracy);
            nodes = nodes.max(mixture.components().len());
            let error = relative(mixture.g1(row.cot), row.g1);
            if error > worst {
                println!(
                    "α {} p {} cot {}: {error:e} with {}",
                    row.alpha,
                    row.p,
                    row.cot,
                    mixture.components().len()
                );
                worst = error;
            }
        }
        println!("{accuracy:e}: {worst:e} with up to {nodes} nodes");
        assert!(worst <= accuracy, "{accuracy:e}: {worst:e}");
    }
}

/// Between the table's angles, and for the shapes that are in use.
#[test]
fn fewer_nodes_keep_their_accuracy_at_every_angle_of_the_catalogue() {
    for accuracy in [1e-3, 1e-6, 1e-9, 1e-12] {
        let mut worst: f64 = 0.0;
        let mut nodes = Vec::new();
        for params in catalog().iter().step_by(3).flat_map(|entry| &entry.channels) {
            let of = |accuracy| BeckmannMixture::new(params.alpha, params.p, accuracy);
            let (mixture, exact) = (of(accuracy), of(1e-13));
            nodes.push(mixture.components().len());
            for i in 0..60 {
                let cot = params.alpha.sqrt() * 4.0 * (-0.25 * f64::from(i)).exp2();
                worst = worst.max(relative(mixture.g1(cot), exact.g1(cot)));
            }
        }
        nodes.sort_unstable();
        println!(
            "{accuracy:e}: {worst:e}, nodes {}, at most {}",
            nodes[nodes.len() / 2],
            nodes[nodes.len() - 1]
        );
        assert!(worst <= accuracy, "{accuracy:e}: {worst:e}");
    }
}

/// ln x as the variable: every scale of a power law gets its share of points.
fn integrate_log(low: f64, high: f64, integrand: impl Fn(f64) -> f64) -> f64 {
    integrate(low.ln(), high.ln(), 1e-12, |v| {
        let x = v.exp();
        x * integrand(x)
    })
}

/// Γ(1−p, α) from its definition ∫_α^∞ t^{−p} e^{−t} dt.
fn upper_gamma(p: f64, alpha: f64) -> f64 {
    integrate_log(alpha, alpha + 40.0, |t| t.powf(-p) * (-t).exp())
}

const SHAPES: [(f64, f64); 5] =
    [(0.0148, 0.459), (0.12, 0.79), (1e-3, 1.78), (0.5, 1.0), (5.0, 2.5)];

#[test]
fn masking_is_the_radial_integral() {
    for (alpha, p) in SHAPES {
        let k = 1.0 / (alpha * upper_gamma(p, alpha));
        let masking = BeckmannMixture::new(alpha, p, 1e-13);
        for cot in [0.03, 0.3, 1.0, 2.0].map(|a| a * alpha.sqrt()) {
            let lambda = 2.0 / cot
                * integrate_log(1e-6 * cot.min(alpha), (60.0 * alpha).sqrt(), |s| {
                    let z = s / cot;
                    let rise = if z < 1e-2 {
                        s * z
                            * z
                            * (1.0 / 3.0 - z * z * (1.0 / 5.0 - z * z * (1.0 / 7.0 - z * z / 9.0)))
                    } else {
                        s - cot * z.atan()
                    };
                    let t = alpha + (cot * cot + s * s) / alpha;
                    s * k * (-t).exp() * t.powf(-p) / PI * rise
                });
            let error = relative(masking.lambda(cot), lambda);
            assert!(error < 1e-9, "α {alpha} p {p} cot {cot}: {error:e}");
        }
    }
}

#[test]
fn masking_is_the_confluent_hypergeometric_integral() {
    for (alpha, p) in SHAPES {
        let gamma = upper_gamma(p, alpha);
        // U(p, p+½, z) = 1/Γ(p) ∫ e^{−zt} t^{p−1} (1+t)^{−½} dt (DLMF 13.4.4).
        let gamma_p = integrate_log(1e-40_f64.powf(1.0 / p).max(1e-300), 60.0, |t| {
            t.powf(p - 1.0) * (-t).exp()
        });
        let u = |z: f64| {
            let low = 1e-16_f64.powf(1.0 / p).max(1e-300) / z;
            integrate_log(low, 50.0 / z, |t| (-z * t).exp() * t.powf(p - 1.0) / (1.0 + t).sqrt())
                / gamma_p
        };
        let p2 = |r: f64| {
            let z = alpha + r * r / alpha;
            u(z) * (-z).exp() / ((PI * alpha).sqrt() * gamma)
        };
        let masking = BeckmannMixture::new(alpha, p, 1e-13);
        for cot in [0.3, 1.0].map(|a| a * alpha.sqrt()) {
            let lambda = integrate(cot, (cot * cot + 40.0 * alpha).sqrt(), 1e-10, |r| {
                (r / cot - 1.0) * p2(r)
            });
            let error = relative(masking.lambda(cot), lambda);
            assert!(error < 1e-8, "α {alpha} p {p} cot {cot}: {error:e}");
        }
    }
}
