//! Directions and channels that break implementations, each with what is right and why, in f64
//! and in f32 with both maskings.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use sgdbake::brdf::{LobeTerms, MaskingKind, SgdBatch, SgdBrdf, Terms};
use sgdbake::material::{Channel, ChannelParams, Material, catalog, find};
use sgdbake::math::direction::{cos_sin_degrees, from_cos_sin};
use sgdbake::microfacet::{Accuracy, Distribution as _, Sgd};

const KINDS: [MaskingKind; 2] = [MaskingKind::Exact, MaskingKind::Fitted];
const MATERIALS: [&str; 4] = ["chrome", "gold-paint", "pink-fabric", "specular-orange-phenolic"];

/// A material in both precisions.
struct Evaluators {
    double: SgdBrdf,
    single: SgdBatch,
}

impl Evaluators {
    fn new(material: &Material, kind: MaskingKind) -> Self {
        Self { double: SgdBrdf::new(material, kind), single: SgdBatch::new(material, kind) }
    }

    /// f64's and f32's terms.
    fn terms(&self, wi: DVec3, wo: DVec3) -> [Terms; 2] {
        [self.double.terms(wi, wo), self.single.terms(wi.as_vec3(), wo.as_vec3())]
    }
}

/// Calls `check` with each material of [`MATERIALS`] and each masking.
fn for_each(check: impl Fn(&Material, &Evaluators)) {
    for name in MATERIALS {
        let material = &find(name).expect("in the catalogue").material;
        for kind in KINDS {
            check(material, &Evaluators::new(material, kind));
        }
    }
}

fn assert_zero(evaluators: &Evaluators, wi: DVec3, wo: DVec3) {
    for terms in evaluators.terms(wi, wo) {
        assert_eq!(terms, Terms::default(), "{wi} {wo}");
    }
}

fn assert_close(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((value - expected).abs() <= tolerance * expected.abs(), "{what}: {value} {expected}");
}

/// The channels of a published material: lobe c colours channel c alone.
fn channels(material: &Material) -> [ChannelParams; 3] {
    material.channels().expect("a published material is in the paper's form")
}

/// ρd/π + ρs/π · F D V V: the formula with the factors given.
fn formula(params: &ChannelParams, cos_d: f64, ndf: f64, v_i: f64, v_o: f64) -> f64 {
    let fresnel = params.f0 + (1.0 - params.f0) * (1.0 - cos_d).powi(5) - params.f1 * cos_d;
    FRAC_1_PI * (params.rho_d + params.rho_s * fresnel * ndf * v_i * v_o)
}

/// Both precisions, and the tolerance of each.
const TOLERANCE: [f64; 2] = [1e-11, 2e-5];

/// θi = θo = 0: h = n, so D is at its peak, F = f0 − f1, and G1(0) divides by cosθ = 1.
#[test]
fn normal_incidence() {
    for_each(|material, evaluators| {
        let both = evaluators.terms(DVec3::Z, DVec3::Z);
        for (terms, tolerance) in both.iter().zip(TOLERANCE) {
            for (c, params) in channels(material).iter().enumerate() {
                let lobe = &evaluators.double.lobes[c];
                let g1 = lobe.g1(f64::INFINITY);
                let expected = formula(params, 1.0, lobe.distribution.peak(), g1, g1);
                assert_close(terms.brdf[c], expected, tolerance, &material.name);
            }
        }
    });
}

/// θ = π/2 exactly: no light crosses the horizon, f is 0 by definition; with f's own 1/cosθ the
/// formula is 0/0 there.
#[test]
fn exactly_grazing() {
    for_each(|_, evaluators| {
        assert_zero(evaluators, DVec3::X, DVec3::Z);
        assert_zero(evaluators, DVec3::Z, DVec3::X);
        assert_zero(evaluators, DVec3::X, DVec3::X);
    });
}

/// θ within 1e-12 of π/2, and cosθ = 1e-30: G1/cosθ tends to a constant, so f has a limit and is
/// at it.
#[test]
fn all_but_grazing() {
    let wo = DVec3::new(-0.6, 0.0, 0.8);
    for_each(|material, evaluators| {
        let at = |cos: f64| evaluators.terms(DVec3::new(1.0, 0.0, cos), wo);
        let limit = at(1e-14);
        for cos in [1e-12, 1e-13, 1e-20, 1e-30, 1e-37] {
            for ((terms, limit), tolerance) in at(cos).iter().zip(&limit).zip([1e-6, 2e-5]) {
                for c in 0..3 {
                    assert_close(terms.brdf[c], limit.brdf[c], tolerance, &material.name);
                    let g1_i = terms.lobes[c].g1_i;
                    assert!(g1_i > 0.0 && g1_i < 1e-5 && terms.brdf[c].is_finite());
                }
            }
        }
    });
}

/// wi = wo: h = wo and θd = 0 on the nose, at every angle.
#[test]
fn back_towards_the_light() {
    for theta in [0.0, 1e-9, 10.0, 60.0, 89.0, 89.999] {
        let (cos, sin) = cos_sin_degrees(theta);
        let w = from_cos_sin(cos, sin, 1.0);
        for_each(|material, evaluators| {
            for (terms, tolerance) in evaluators.terms(w, w).iter().zip([1e-10, 1e-4]) {
                for (c, params) in channels(material).iter().enumerate() {
                    let lobe = &evaluators.double.lobes[c];
                    let v = lobe.g1(cos / sin) / cos;
                    let ndf = lobe.distribution.ndf((sin / cos) * (sin / cos));
                    assert_close(terms.lobes[c].fresnel[c], params.f0 - params.f1, tolerance, "F");
                    let expected = formula(params, 1.0, ndf, v, v);
                    assert_close(terms.brdf[c], expected, tolerance, &material.name);
                }
            }
        });
    }
}

/// wi = −wo: one of the two is below the horizon.
#[test]
fn opposite_directions_and_below_the_horizon() {
    let (up, down) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(-0.6, 0.0, -0.8));
    for_each(|_, evaluators| {
        assert_zero(evaluators, up, down);
        assert_zero(evaluators, down, up);
        assert_zero(evaluators, down, down);
        assert_zero(evaluators, DVec3::new(0.0, 1.0, -1e-300), up);
    });
}

/// Mirror directions at opposite grazing: wi + wo all but vanishes, yet h = n, θd = θ, D is at its
/// peak.
#[test]
fn opposite_grazing() {
    for cos in [1e-3, 1e-6, 1e-12, 1e-30] {
        let (wi, wo) = (DVec3::new(1.0, 0.0, cos), DVec3::new(-1.0, 0.0, cos));
        for_each(|material, evaluators| {
            for (terms, tolerance) in evaluators.terms(wi, wo).iter().zip(TOLERANCE) {
                for (c, params) in channels(material).iter().enumerate() {
                    let lobe = &evaluators.double.lobes[c];
                    let v = lobe.g1(cos) / cos;
                    let expected = formula(params, cos, lobe.distribution.peak(), v, v);
                    assert_close(terms.brdf[c], expected, tolerance, &material.name);
                }
            }
        });
    }
}

/// A vector that is not a unit vector is not a direction: f is 0, never NaN and never an error.
#[test]
fn what_is_no_direction() {
    let wo = DVec3::new(0.0, 0.6, 0.8);
    let garbage = [
        DVec3::ZERO,
        DVec3::splat(f64::NAN),
        DVec3::new(f64::NAN, 0.0, 1.0),
        DVec3::new(0.0, 0.0, f64::INFINITY),
        DVec3::new(0.0, 0.0, 5e-324),
        DVec3::new(1.0, 0.0, 5e-324),
        DVec3::new(3.0, 0.0, 4.0),
        DVec3::new(0.0, 0.0, 1e300),
        DVec3::new(0.0, 0.3, 0.4),
    ];
    for_each(|_, evaluators| {
        for w in garbage {
            assert_zero(evaluators, w, wo);
            assert_zero(evaluators, wo, w);
        }
    });
}

/// Over directions from the peak to grazing: every term finite, D, G1 and the diffuse term not
/// negative, the specular term of the sign of F, and f32 where f64 is.
fn assert_sound(name: &str, channel: Channel) {
    let material = &find(name).expect("in the catalogue").material;
    let c = Channel::ALL.iter().position(|other| *other == channel).expect("one of three");
    for kind in KINDS {
        let evaluators = Evaluators::new(material, kind);
        let mut largest: f64 = 0.0;
        let mut values = Vec::new();
        for theta_i in [0.0, 1e-6, 0.1, 5.0, 30.0, 60.0, 85.0, 89.9, 90.0 - 1e-9] {
            for theta_o in [0.0, 0.1, 5.1, 30.0, 60.1, 85.0, 89.99] {
                for phi in [0.0, 1.0, 3.1, std::f64::consts::PI] {
                    let direction = |theta: f64, phi| {
                        let (cos, sin) = cos_sin_degrees(theta);
                        from_cos_sin(cos, sin, phi).as_vec3().as_dvec3()
                    };
                    let [double, single] =
                        evaluators.terms(direction(theta_i, phi), direction(theta_o, 0.0));
                    for terms in [double, single] {
                        let LobeTerms { ndf, g1_i, g1_o, fresnel } = terms.lobes[c];
                        let [fresnel, specular, diffuse, brdf] =
                            [fresnel, terms.specular, terms.diffuse, terms.brdf].map(|t| t[c]);
                        assert!([ndf, fresnel, specular, brdf].iter().all(|term| term.is_finite()));
                        assert!((0.0..=1.0).contains(&g1_i) && (0.0..=1.0).contains(&g1_o));
                        assert!(ndf >= 0.0 && diffuse >= 0.0 && specular * fresnel >= 0.0);
                    }
                    largest = largest.max(double.brdf[c].abs());
                    values.push((double.brdf[c], single.brdf[c]));
                }
            }
        }
        for (double, single) in values {
            let allowed = 1e-5 * double.abs() + 1e-6 * largest;
            assert!((single - double).abs() <= allowed, "{name}: {double} {single}");
        }
    }
}

/// c = 1.8e66 overflows f32: the stable form of the fitted masking has no c.
#[test]
fn chrome_b_has_a_rate_of_1e66() {
    assert_sound("chrome", Channel::B);
}

/// c = 1.6e109.
#[test]
fn chrome_steel_g_has_a_rate_of_1e109() {
    assert_sound("chrome-steel", Channel::G);
}

/// λ = 1.5e7: 1 + λ(1 − e^…) cancels seven digits; expm1 does not.
#[test]
fn green_acrylic_b_has_an_amplitude_of_1e7() {
    assert_sound("green-acrylic", Channel::B);
}

/// λ = 4.5e-8: ln(1 + 1/λ) is large, and G1 leaves 1 only at the horizon.
#[test]
fn white_acrylic_b_has_an_amplitude_of_1e_minus_8() {
    assert_sound("white-acrylic", Channel::B);
}

/// α = 1.6e-5: 1 − cos²θ would lose the lobe; tan²θ from the components does not.
#[test]
fn specular_orange_phenolic_b_is_the_sharpest() {
    assert_sound("specular-orange-phenolic", Channel::B);
}

/// p = 4.6e-15: one Beckmann lobe up to 1e-13.
#[test]
fn pink_fabric_g_is_all_but_beckmann() {
    assert_sound("pink-fabric", Channel::G);
    let params = find("pink-fabric").expect("in the catalogue").channels[1];
    let [sgd, beckmann] = [params.p, 0.0].map(|p| Sgd::new(params.alpha, p, Accuracy::Reference));
    for cot in [0.01, 0.3, 1.0, 3.0] {
        assert_close(sgd.g1(cot), beckmann.g1(cot), 1e-13, "G1");
        assert_close(sgd.ndf(cot), beckmann.ndf(cot), 1e-13, "D");
    }
}

/// p = 1.78: Γ(1−p, α) of a negative order.
#[test]
fn pink_fabric_r_has_a_gamma_of_negative_order() {
    assert_sound("pink-fabric", Channel::R);
}

/// ρs = 2e-16: no specular lobe, and nothing divides by it.
#[test]
fn black_fabric_r_has_no_specular_lobe() {
    assert_sound("black-fabric", Channel::R);
}

/// f0 = 8.5: F leaves [0, 1], and is evaluated as published.
#[test]
fn beige_fabric_b_has_a_fresnel_factor_above_1() {
    assert_sound("beige-fabric", Channel::B);
}

/// θ0 < 0, in 89 channels: the fitted G1 is already falling at normal incidence, though by less
/// than 1e-10, and never above 1.
#[test]
fn channels_masked_from_the_normal_on() {
    let mut at_normal = Vec::new();
    for entry in catalog() {
        let brdf = SgdBrdf::new(&entry.material, MaskingKind::Fitted);
        let lobes = brdf.lobes.iter().zip(&entry.printed);
        let masked = lobes.filter(|(_, printed)| printed.theta0 < 0.0);
        at_normal.extend(masked.map(|(lobe, _)| lobe.g1(f64::INFINITY)));
    }
    assert_eq!(at_normal.len(), 89);
    assert!(at_normal.iter().all(|g1| (1.0 - 1e-10..=1.0).contains(g1)), "{at_normal:?}");
    assert!(at_normal.iter().any(|g1| *g1 < 1.0 - 1e-11), "{at_normal:?}");
}
