//! The evaluator against tables computed with 40 digits.

use sgdbake::brdf::{Lobe, MaskingKind};
use sgdbake::material::{Channel, find};
use sgdbake::math::direction::cos_sin_degrees;
use sgdbake::microfacet::{Accuracy, Distribution as _};

/// material,channel,theta_deg,ndf,lambda,masking_exact,masking_fitted,fresnel
const TABLE: &str = include_str!("data/sgd-reference.csv");

/// Relative difference; values below the smallest normal number count as 0, as f64 stores them.
fn relative(value: f64, expected: f64) -> f64 {
    if expected.abs() < 1e-300 { value.abs() } else { (value / expected - 1.0).abs() }
}

#[test]
fn every_published_channel_matches_40_digit_values() {
    let mut worst = [0.0_f64; 5];
    let mut rows = 0;
    for line in TABLE.lines().skip(1) {
        let columns: Vec<&str> = line.split(',').collect();
        let number = |i: usize| columns[i].parse::<f64>().expect("the table holds numbers");
        let channel =
            Channel::ALL.into_iter().position(|c| c.name() == columns[1]).expect("r, g, b");
        let entry = find(columns[0]).expect("in the catalogue");
        let params = &entry.material.lobes()[channel];
        let [exact, fitted] = [MaskingKind::Exact, MaskingKind::Fitted]
            .map(|kind| Lobe::new(params, kind, Accuracy::Reference));
        let (cos, sin) = cos_sin_degrees(number(2));
        let (cot, tan2) = (cos / sin, (sin / cos) * (sin / cos));
        let errors = [
            relative(exact.distribution.ndf(tan2), number(3)),
            if number(4) < 1e-12 { 0.0 } else { relative(exact.lambda(cot), number(4)) },
            relative(exact.g1(cot), number(5)),
            (fitted.g1(cot) - number(6)).abs(),
            (exact.fresnel[channel].eval(cos) - number(7)).abs() / number(7).abs().max(1.0),
        ];
        for (worst, error) in worst.iter_mut().zip(errors) {
            *worst = worst.max(error);
        }
        rows += 1;
    }
    let [ndf, lambda, g1, fitted, fresnel] = worst;
    eprintln!(
        "largest errors: D {ndf:e}, Λ {lambda:e}, G1 {g1:e}, fitted G1 {fitted:e}, F {fresnel:e}"
    );
    assert_eq!(rows, 2400);
    assert!(ndf <= 1e-10 && lambda <= 1e-8 && g1 <= 1e-11 && fitted <= 1e-10 && fresnel <= 1e-14);
}
