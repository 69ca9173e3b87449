//! The embedded refit edition: its stated errors against the surfaces, what it conserves, and that a
//! fit still finds it.

mod common;

use common::network;
use glam::DVec3;
use rayon::prelude::*;
use sgdbake::brdf::{MaskingKind, SgdBrdf, directional_albedo};
use sgdbake::fit::measured_target::MeasuredTarget;
use sgdbake::fit::sgd::{Energy, Lobes, Options, fit};
use sgdbake::material::{RefitEntry, find, refit, refit_of};
use sgdbake::math::direction::spherical;
use sgdbake::microfacet::Accuracy;
use sgdbake::report::distance::Reference;
use sgdbake::report::surface::evaluated;

/// Half of the table's last digit, and what its parameters' digits change.
const DIGITS: f64 = 2e-4;

#[test]
fn every_stated_error_is_the_distance_from_the_surface() {
    let Some(networks) = network::all() else { return };
    refit().par_iter().step_by(5).for_each(|RefitEntry { material, error, published_delta_e }| {
        let name = material.name.trim_end_matches("@refit");
        let reference = Reference::new(&networks[&format!("merl/{name}")]);
        let found = reference.distance(&evaluated(material));
        let published = &find(name).expect("in the catalogue").material;
        let pairs = [
            (found.suns, error.delta_e),
            (found.highlights, error.highlights),
            (found.absolute, error.absolute),
            (found.lightness, error.lightness),
            (reference.distance(&evaluated(published)).suns, *published_delta_e),
        ];
        for (found, stated) in pairs {
            assert!((found - stated).abs() <= DIGITS, "{name}: {pairs:?}");
        }
    });
}

/// The golden ratio's fractional parts: evenly spread, and at no angle that a fit or an audit looks at.
fn spread(i: u32) -> f64 {
    (f64::from(i) * 0.618_033_988_749_894_9).fract()
}

#[test]
fn no_refit_is_negative_or_gains_energy() {
    refit().par_iter().for_each(|RefitEntry { material, .. }| {
        let name = &material.name;
        let brdf = SgdBrdf::with_accuracy(material, MaskingKind::Exact, Accuracy::Reference);
        for i in 1..40 {
            let wo = spherical(spread(i) * 89.99_f64.to_radians(), 0.0);
            let albedo = directional_albedo(&brdf, wo.z);
            assert!(albedo.iter().all(|albedo| *albedo <= 1.0), "{name} at {wo}: {albedo:?}");
            for j in 0..50 {
                let [theta, phi] = [
                    spread(37 * i + j) * std::f64::consts::FRAC_PI_2,
                    3.2 * spread(91 * i + 3 * j),
                ];
                let wi: DVec3 = spherical(theta, phi);
                let f = brdf.eval(wi, wo);
                assert!(f.iter().all(|f| *f >= 0.0), "{name} at {wi} {wo}: {f:?}");
            }
        }
    });
}

#[test]
fn a_fit_finds_the_edition_again() {
    let Some(networks) = network::all() else { return };
    for name in ["gold-paint", "white-paint", "pink-fabric"] {
        let measured = &networks[&format!("merl/{name}")];
        let target = MeasuredTarget::of(measured).expect("all of it is measured");
        let options = Options { lobes: Lobes::Auto, energy: Energy::Conserve };
        let found = fit(&target, options).model.material(name).expect("a fit is in range");
        let distance = Reference::new(measured).distance(&evaluated(&found));
        let stated = &refit_of(name).expect("refitted").error;
        assert!((distance.suns - stated.delta_e).abs() < 0.01, "{name}: {distance:?} {stated:?}");
    }
}

/// The whole edition is what `--all --edition refit` means in every command.
#[test]
fn every_command_takes_the_whole_edition() {
    let commands: [&[&str]; 3] = [
        &["eval", "--wi", "0,0,1", "--wo", "0,0,1"],
        &["slice", "--theta-deg", "10"],
        &["sample", "--wo", "0,0,1", "-n", "2"],
    ];
    for command in commands {
        let mut sgdbake = assert_cmd::Command::cargo_bin("sgdbake").expect("built with the tests");
        let run = sgdbake.args(command).args(["--all", "--edition", "refit", "--json"]).assert();
        let output = run.success().get_output().stdout.clone();
        let lines = String::from_utf8(output).expect("text");
        assert_eq!(lines.lines().count(), refit().len(), "{command:?}");
    }
}
