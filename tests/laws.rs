//! Laws that hold for every published lobe, and for lobes that colour all channels.

mod common;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use common::materials::shared_lobes;
use glam::DVec3;
use proptest::prelude::*;
use rayon::prelude::*;
use sgdbake::brdf::{Lobe, MaskingKind, SgdBrdf};
use sgdbake::material::{LobeParams, Material, catalog};
use sgdbake::math::direction::{cot_theta, spherical, tan2_theta};
use sgdbake::math::quadrature::{Node, gauss_legendre};
use sgdbake::microfacet::{Accuracy, Distribution as _, Sgd, SgdNdf};

/// Every published material, and those whose lobes colour all channels.
fn materials() -> Vec<Material> {
    catalog().iter().map(|entry| entry.material.clone()).chain(shared_lobes()).collect()
}

/// Calls `law` with every lobe and the name of its material, in parallel.
fn for_every_lobe(law: impl Fn(&str, &LobeParams) + Sync) {
    materials().par_iter().for_each(|material| {
        for params in material.lobes() {
            law(&material.name, params);
        }
    });
}

/// The lobe with its exact masking.
fn exact(params: &LobeParams, accuracy: Accuracy) -> Lobe<Sgd> {
    Lobe::new(params, MaskingKind::Exact, accuracy)
}

/// A rule for ∫ over (low, high) in pieces of the logarithm, which resolves lobes of any width:
/// (x, weight dx).
fn log_rule(low: f64, high: f64, nodes: usize) -> Vec<(f64, f64)> {
    let piece = gauss_legendre(nodes);
    let pieces = ((high / low).ln() / 2.0).ceil().max(1.0);
    let width = (high / low).ln() / pieces;
    (0..pieces as u32)
        .flat_map(|i| {
            let start = low.ln() + f64::from(i) * width;
            piece.iter().map(move |Node { x, weight }| {
                let at = (start + x * width).exp();
                (at, weight * width * at)
            })
        })
        .collect()
}

/// Where a lobe's slope density begins and ends to vary, in tan²θ.
fn slope_range(params: &LobeParams, accuracy: f64) -> (f64, f64) {
    (params.alpha() * params.alpha() * accuracy, params.alpha() * 800.0)
}

/// ∫ over tan²θ of everything a lobe's distribution weights.
fn slope_rule(params: &LobeParams) -> Vec<(f64, f64)> {
    let (low, high) = slope_range(params, 1e-14);
    log_rule(low, high, 24)
}

/// The same with a break at `kink`, beyond which √(x − kink) is the smooth variable.
fn slope_rule_with_kink(params: &LobeParams, kink: f64) -> Vec<(f64, f64)> {
    let (low, high) = slope_range(params, 1e-14);
    if kink >= high {
        return log_rule(low, high, 24);
    }
    let below = if kink > low { log_rule(low, kink, 24) } else { Vec::new() };
    let smallest = 1e-9 * (high - kink).sqrt();
    let beyond = log_rule(smallest, (high - kink).sqrt(), 24)
        .into_iter()
        .map(|(t, dt)| (kink + t * t, 2.0 * t * dt));
    below.into_iter().chain(beyond).collect()
}

#[test]
fn the_distribution_is_normalised() {
    // ∫ D cosθ dω = π ∫ D cos⁴θ dx with x = tan²θ.
    for_every_lobe(|name, params| {
        let ndf = SgdNdf::new(params.alpha(), params.p());
        let integral: f64 =
            slope_rule(params).iter().map(|(x, dx)| PI * ndf.slope_density(*x) * dx).sum();
        assert!((integral - 1.0).abs() < 1e-10, "{name}: {integral}");
    });
}

#[test]
fn the_weak_white_furnace_returns_all_light() {
    // ∫ D G1(wo) ⟨wo,h⟩ dω = cosθo: D's slope density times ⟨wo,h⟩/cosθh, averaged over azimuth.
    for_every_lobe(|name, params| {
        let sgd = exact(params, Accuracy::Reference).distribution;
        for theta_deg in [5.0_f64, 45.0, 75.0, 85.0, 89.0] {
            let wo = spherical(theta_deg.to_radians(), 0.0);
            let projected = |tan: f64| positive_part_mean(wo.z, wo.x * tan);
            // A facet begins to be turned away where its slope exceeds cotθo.
            let kink = cot_theta(wo).powi(2);
            let integral: f64 = slope_rule_with_kink(params, kink)
                .iter()
                .map(|(x, dx)| PI * sgd.slope_density(*x) * projected(x.sqrt()) * dx)
                .sum();
            let furnace = integral * sgd.g1(cot_theta(wo)) / wo.z;
            assert!((furnace - 1.0).abs() < 1e-9, "{name} at {theta_deg}°: {furnace}");
        }
    });
}

/// The mean over azimuth of max(0, a + b cosφ), a > 0, b ≥ 0, in closed form.
fn positive_part_mean(a: f64, b: f64) -> f64 {
    if b <= a {
        return a;
    }
    let limit = (-a / b).acos();
    (a * limit + b * limit.sin()) / PI
}

#[test]
fn without_fresnel_no_energy_is_gained() {
    // Albedo of D G1(wi) G1(wo)/(4 cosθi cosθo), F ≡ 1: integrated over h, where D is a rule.
    for_every_lobe(|name, params| {
        let sgd = exact(params, Accuracy::Picture).distribution;
        let azimuths = 16;
        let (low, high) = slope_range(params, 1e-7);
        for theta_deg in [0.0_f64, 40.0, 70.0, 85.0] {
            let wo = spherical(theta_deg.to_radians(), 0.0);
            let g1_o = sgd.g1(cot_theta(wo));
            let albedo: f64 = log_rule(low, high, 8)
                .iter()
                .filter(|(x, _)| sgd.slope_density(*x) > 1e-12 * sgd.peak())
                .map(|(x, dx)| {
                    let ring: f64 = (0..azimuths)
                        .map(|i| TAU * (f64::from(i) + 0.5) / f64::from(azimuths))
                        .map(|phi| reflected_share(&sgd, wo, x.sqrt(), phi))
                        .sum();
                    PI * sgd.slope_density(*x) * dx * ring / f64::from(azimuths)
                })
                .sum::<f64>()
                * g1_o
                / wo.z;
            assert!((0.0..=1.0 + 1e-5).contains(&albedo), "{name} at {theta_deg}°: {albedo}");
        }
    });
}

/// ⟨wo,h⟩/cosθh · G1(wi) of the direction that the facet of slope (tanθh, φ) reflects wo into.
fn reflected_share(sgd: &Sgd, wo: DVec3, tan_theta_h: f64, phi: f64) -> f64 {
    let h = spherical(tan_theta_h.atan(), phi);
    let facing = wo.dot(h);
    let wi = 2.0 * facing * h - wo;
    if facing <= 0.0 || wi.z <= 0.0 {
        return 0.0;
    }
    facing / h.z * sgd.g1(cot_theta(wi))
}

#[test]
fn masking_is_a_falling_probability() {
    for_every_lobe(|name, params| {
        for kind in [MaskingKind::Exact, MaskingKind::Fitted] {
            let lobe = Lobe::new(params, kind, Accuracy::Reference);
            let mut last = 0.0;
            for i in 0..=2000 {
                let elevation = FRAC_PI_2 * f64::from(i) / 2000.0;
                let g1 = lobe.g1(elevation.tan());
                assert!((0.0..=1.0).contains(&g1), "{name} {kind:?}: {g1}");
                assert!(g1 >= last - 1e-14, "{name} {kind:?} falls at {elevation}");
                last = g1;
            }
        }
    });
}

#[test]
fn k_follows_from_alpha_and_p_as_printed() {
    for entry in catalog() {
        for (params, printed) in entry.channels.iter().zip(&entry.printed) {
            let k = SgdNdf::new(params.alpha, params.p).k();
            assert!(
                (k / printed.k - 1.0).abs() < 6e-6,
                "{}: {k} {}",
                entry.material.name,
                printed.k
            );
        }
    }
}

fn upper_direction() -> impl Strategy<Value = DVec3> {
    // cosθ log-uniform, so that grazing is met as often as normal incidence.
    (-30.0_f64..0.0, 0.0..TAU).prop_map(|(log_cos, phi)| {
        let cos_theta = 10_f64.powf(log_cos);
        let sin_theta = ((1.0 - cos_theta) * (1.0 + cos_theta)).sqrt();
        sgdbake::math::direction::from_cos_sin(cos_theta, sin_theta, phi)
    })
}

proptest! {
    #[test]
    fn reciprocity_holds_bit_for_bit(
        wi in upper_direction(), wo in upper_direction(), index in 0..103_usize, fitted: bool,
    ) {
        let kind = if fitted { MaskingKind::Fitted } else { MaskingKind::Exact };
        let material = match catalog().get(index) {
            Some(entry) => entry.material.clone(),
            None => shared_lobes().swap_remove(index - catalog().len()),
        };
        let brdf = SgdBrdf::new(&material, kind);
        prop_assert_eq!(brdf.eval(wi, wo), brdf.eval(wo, wi));
        for f in brdf.eval(wi, wo) {
            prop_assert!(f.is_finite());
        }
        prop_assert!(tan2_theta(wi + wo) >= 0.0);
    }
}
