//! Fits to reflectances that stand in for measurements: what is recovered, what it costs to conserve
//! energy, and how near the networks' surfaces come.

mod common;

use std::f64::consts::PI;

use common::network;
use glam::DVec3;
use sgdbake::brdf::{MaskingKind, Reflectance, SgdBrdf, directional_albedo};
use sgdbake::fit::measured_target::{MeasuredTarget, NothingMeasured};
use sgdbake::fit::sgd::{Energy, Lobes, Options, SgdFit, fit};
use sgdbake::fit::sgd_model::{SgdLobe, SgdModel};
use sgdbake::fit::{gltf_measured, one_lobe_measured};
use sgdbake::material::find;
use sgdbake::microfacet::{Accuracy, Family, SgdNdf};
use sgdbake::report::distance::Reference;

fn fit_of(reflectance: &dyn Reflectance, lobes: Lobes, energy: Energy) -> SgdFit {
    let target = MeasuredTarget::of(reflectance).expect("all of it is measured");
    fit(&target, Options { lobes, energy })
}

/// The reflectance of a model.
fn brdf(model: &SgdModel) -> SgdBrdf {
    let material = model.material("fitted").expect("a fit is in range");
    SgdBrdf::with_accuracy(&material, MaskingKind::Exact, Accuracy::Table).tabulated()
}

fn picture_difference(reflectance: &dyn Reflectance, fit: &SgdFit) -> f64 {
    Reference::new(reflectance).distance(&brdf(&fit.model)).suns
}

/// Largest |D − D_fit| over the peak of D.
fn ndf_difference(exact: [f64; 2], fitted: &SgdLobe) -> f64 {
    let [exact, fitted] = [exact, [fitted.alpha, fitted.p]].map(|[alpha, p]| SgdNdf::new(alpha, p));
    let angles = (0..200).map(|i| 1e-8 * 1.12_f64.powi(i));
    let off = angles.map(|x| (exact.slope_density(x) - fitted.slope_density(x)).abs());
    off.fold(0.0, f64::max) / exact.peak()
}

fn coated() -> SgdModel {
    let lobe = |alpha, p, rho_s, f0, f1| SgdLobe { alpha, p, rho_s, f0, f1 };
    SgdModel {
        rho_d: [0.3, 0.15, 0.05],
        lobes: vec![
            lobe(4e-3, 0.4, [0.3; 3], [0.1, 0.12, 0.15], [0.02, 0.01, 0.03]),
            lobe(0.12, 0.3, [0.25, 0.2, 0.1], [0.4, 0.3, 0.5], [0.1, 0.05, 0.2]),
        ],
    }
}

#[test]
fn two_lobes_are_recovered() {
    let exact = brdf(&coated());
    let fit = fit_of(&exact, Lobes::Auto, Energy::Conserve);
    assert_eq!(fit.model.lobes.len(), 2);
    for (found, exact) in fit.model.lobes.iter().zip(&coated().lobes) {
        let off = ndf_difference([exact.alpha, exact.p], found);
        assert!(off < 0.01, "D off by {off} of its peak: {found:?}");
    }
    let difference = picture_difference(&exact, &fit);
    assert!(difference < 0.05, "{difference}");
}

#[test]
fn published_materials_are_recovered_channel_by_channel() {
    for name in ["gold-paint", "blue-rubber", "specular-blue-phenolic", "nickel"] {
        let entry = find(name).expect("in the catalogue");
        let exact = SgdBrdf::new(&entry.material, MaskingKind::Exact);
        let fit = fit_of(&exact, Lobes::PerChannel, Energy::Free);
        let difference = picture_difference(&exact, &fit);
        assert!(difference < 0.2, "{name}: {difference}");
        for (found, exact) in fit.model.lobes.iter().zip(&entry.channels) {
            let off = ndf_difference([exact.alpha, exact.p], found);
            assert!(off < 0.01, "{name}: D off by {off} of its peak: {found:?} {exact:?}");
        }
    }
}

/// Measured badly: 5 % noise, one cell in ten missing, anything between 0 and 5 times the value beyond
/// 80°.
struct Bad<'a>(&'a dyn Reflectance);

impl Reflectance for Bad<'_> {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let bits = wi.x.to_bits() ^ wi.y.to_bits().rotate_left(21) ^ wo.x.to_bits().rotate_left(42);
        let chance = |k: u64| {
            let mut x = (bits ^ k).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            x = (x ^ (x >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            (x >> 11) as f64 / (1_u64 << 53) as f64
        };
        if chance(1) < 0.1 {
            return [f64::NAN; 3];
        }
        // The sum of twelve is nearly normal.
        let noise = 0.05 * ((2..14).map(chance).sum::<f64>() - 6.0);
        let grazing = wi.z.min(wo.z) < 80.0_f64.to_radians().cos();
        let factor = if grazing { 5.0 * chance(14) } else { 1.0 + noise };
        self.0.eval(wi, wo).map(|f| f * factor)
    }
}

#[test]
fn noise_holes_and_garbage_at_grazing_angles_do_little_harm() {
    let exact = brdf(&coated());
    let fit = fit_of(&Bad(&exact), Lobes::Two, Energy::Conserve);
    let difference = picture_difference(&exact, &fit);
    assert!(difference < 0.6, "{difference}");
    for (found, exact) in fit.model.lobes.iter().zip(&coated().lobes) {
        let off = ndf_difference([exact.alpha, exact.p], found);
        assert!(off < 0.15, "D off by {off} of its peak: {found:?}");
    }
}

#[test]
fn the_stated_uncertainty_is_that_of_repeated_measurements() {
    /// Noise alone, another with each seed.
    struct Noisy<'a>(&'a dyn Reflectance, u64);
    impl Reflectance for Noisy<'_> {
        fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
            let turned = DVec3::new(wi.x + self.1 as f64, wi.y, wi.z);
            let bits = turned.x.to_bits() ^ wi.y.to_bits().rotate_left(21) ^ wo.y.to_bits();
            let chance = |k: u64| {
                let mut x = (bits ^ k).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                x = (x ^ (x >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                (x >> 11) as f64 / (1_u64 << 53) as f64
            };
            let noise = 0.03 * ((2..14).map(chance).sum::<f64>() - 6.0);
            self.0.eval(wi, wo).map(|f| f * (1.0 + noise))
        }
    }
    let model = SgdModel { lobes: vec![coated().lobes[1]], ..coated() };
    let exact = brdf(&model);
    for lobes in [Lobes::One, Lobes::PerChannel] {
        let runs: Vec<SgdFit> =
            (0..8).map(|seed| fit_of(&Noisy(&exact, seed), lobes, Energy::Conserve)).collect();
        let check = |name: &str, value: &dyn Fn(&SgdFit) -> [f64; 2]| {
            let values: Vec<[f64; 2]> = runs.iter().map(value).collect();
            let mean = values.iter().map(|v| v[0]).sum::<f64>() / 8.0;
            let spread = (values.iter().map(|v| (v[0] - mean).powi(2)).sum::<f64>() / 7.0).sqrt();
            let stated = values.iter().map(|v| v[1]).sum::<f64>() / 8.0;
            let case = format!("{name} of {lobes:?}: {stated} for {spread}");
            assert!(stated > 0.4 * spread && stated < 2.5 * spread, "{case}");
        };
        check("rho_d", &|fit| [fit.model.rho_d[0], fit.uncertainty.rho_d[0]]);
        check("alpha", &|fit| [fit.model.lobes[0].alpha, fit.uncertainty.lobes[0].alpha]);
        check("rho_s", &|fit| [fit.model.lobes[0].rho_s[0], fit.uncertainty.lobes[0].rho_s[0]]);
    }
}

#[test]
fn a_matte_surface_has_its_albedo_and_a_ggx_lobe_its_picture() {
    struct Matte;
    impl Reflectance for Matte {
        fn eval(&self, _: DVec3, _: DVec3) -> [f64; 3] {
            [0.6 / PI, 0.3 / PI, 0.0]
        }
    }
    let fit = fit_of(&Matte, Lobes::Auto, Energy::Conserve);
    let difference = picture_difference(&Matte, &fit);
    assert!(difference < 0.05, "{difference}: {fit:?}");

    let target = MeasuredTarget::of(&Matte).expect("measured");
    let ggx = one_lobe_measured::fit(&target, Family::Ggx).brdf();
    let again = MeasuredTarget::of(&ggx).expect("measured");
    let found = one_lobe_measured::fit(&again, Family::Ggx).brdf();
    let difference = Reference::new(&ggx).distance(&found).suns;
    assert!(difference < 0.05, "{difference}");
}

#[test]
fn nothing_measured_is_said() {
    struct Nothing;
    impl Reflectance for Nothing {
        fn eval(&self, _: DVec3, _: DVec3) -> [f64; 3] {
            [f64::NAN; 3]
        }
    }
    assert_eq!(MeasuredTarget::of(&Nothing).err(), Some(NothingMeasured));
}

/// The largest directional albedo, and the least and largest F.
fn limits(model: &SgdModel) -> [f64; 3] {
    let brdf = brdf(model);
    let mut limits = [0.0_f64, f64::INFINITY, f64::NEG_INFINITY];
    for theta in (0..180).map(|i| 0.5 * f64::from(i)).chain([89.9, 89.99]) {
        let cos = (90.0 - theta).to_radians().sin();
        limits[0] = directional_albedo(&brdf, cos).into_iter().fold(limits[0], f64::max);
        for lobe in &brdf.lobes {
            for c in (0..3).filter(|c| lobe.rho_s[*c] > 0.0) {
                let f = lobe.fresnel[c].eval(theta.to_radians().sin());
                (limits[1], limits[2]) = (limits[1].min(f), limits[2].max(f));
            }
        }
    }
    limits
}

#[test]
fn conserving_fits_return_no_more_than_arrives() {
    /// Brighter than any surface.
    struct Bright;
    impl Reflectance for Bright {
        fn eval(&self, _: DVec3, wo: DVec3) -> [f64; 3] {
            [1.4 / PI, 1.0 / PI, 0.5 / (PI * (0.2 + wo.z))]
        }
    }
    let conserving = fit_of(&Bright, Lobes::Two, Energy::Conserve);
    let [albedo, least, most] = limits(&conserving.model);
    assert!(albedo <= 1.0 && least >= -1e-6 && most <= 1.0 + 1e-6, "{albedo} {least} {most}");
    assert!(albedo > 0.98, "as bright as it may be: {albedo}");
}

/// The trial's mean ΔE of a material.
fn trial(column: &str, material: &str) -> f64 {
    let text = std::fs::read_to_string(network::folder().expect("there").join("trial.csv"));
    let text = text.expect("the trial is there");
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    let place = header.iter().position(|name| *name == column).expect("a column");
    let row = lines.find(|row| row[0] == material).expect("a row");
    row[place].parse().expect("a number")
}

/// Half a unit of the last digit that the trial states.
const DIGITS: f64 = 0.005;

#[test]
fn the_networks_are_nearer_than_the_trial_and_the_published_fit() {
    let Some(folder) = network::folder() else { return };
    for (key, surface) in network::read(&folder, "networks.json") {
        let Some(name) = key.strip_prefix("merl/") else { continue };
        let reference = Reference::new(&surface);
        let fit = fit_of(&surface, Lobes::Auto, Energy::Conserve);
        let found = reference.distance(&brdf(&fit.model));
        let material = &find(name).expect("in the catalogue").material;
        let published = reference.distance(&SgdBrdf::new(material, MaskingKind::Exact));
        let trial = trial("sgd_two_lobes", name) + DIGITS;
        println!(
            "{name}: {:.2} (trial {trial:.2}); absolute {:.4} (published {:.4})",
            found.suns, found.absolute, published.absolute
        );
        assert!(found.suns <= published.suns, "{name}: {found:?}");
        // The trial conserves no energy. Its sharp lobe of chrome is below what its pixels show: 0.06
        // nearer in a picture under suns, 3 farther in the highlights under area lights.
        let free = fit_of(&surface, Lobes::Auto, Energy::Free);
        let free = reference.distance(&brdf(&free.model));
        println!("    free: {:.2}", free.suns);
        assert!(free.suns <= trial || name == "chrome", "{name}: {free:?}");
        assert!(found.absolute <= published.absolute, "{name}: {found:?} {published:?}");
        assert!(found.highlights <= published.highlights, "{name}: {found:?} {published:?}");
        let [albedo, least, most] = limits(&fit.model);
        assert!(
            albedo <= 1.0 && least >= -1e-6 && most <= 1.0 + 1e-6,
            "{name}: {albedo} {least} {most}"
        );
    }
}

#[test]
fn gltf_in_every_form_is_near_the_surface() {
    let Some(folder) = network::folder() else { return };
    let networks = network::read(&folder, "networks.json");
    for name in ["gold-paint", "pink-fabric", "white-paint"] {
        let surface = &networks[&format!("merl/{name}")];
        let target = MeasuredTarget::of(surface).expect("measured");
        let found = gltf_measured::fit(&target);
        let reference = Reference::new(surface);
        let appendix_b = reference.distance(&found.material).suns;
        assert!(appendix_b <= trial("sgd_published", name), "{name}: {appendix_b}");
        for engine in sgdbake::brdf::engine::Engine::ALL {
            let form = sgdbake::brdf::engine::EngineBrdf { engine, material: found.material };
            let difference = reference.distance(&form).suns;
            assert!(difference <= 2.0, "{name} in {engine:?}: {difference}");
        }
    }
}
