//! `measure` and `--measured` as a user sees them, on files made of known materials.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

#[path = "support/command.rs"]
mod command;

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::command::{done, sgdbake};

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&done(arguments)).expect("stdout is JSON")
}

/// A folder with `coat.binary`, the file of a material with one lobe for all colours.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let material = "name = \"coat\"\nrho_d = [0.3, 0.2, 0.1]\n[[lobe]]\nalpha = 0.1\np = 0.4\n\
                    rho_s = [0.2, 0.2, 0.2]\nf0 = [0.2, 0.15, 0.1]\nf1 = [0.05, 0.02, 0.01]\n";
    fs::write(folder.path().join("coat.toml"), material).unwrap();
    done(&["tabulate", "--material", &at(&folder, "coat.toml"), "-o", &at(&folder, "coat.binary")]);
    folder
}

fn at(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).to_str().unwrap().to_owned()
}

/// The arguments of `measure`, with more of them.
fn measure<'a>(binary: &'a str, toml: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["measure", binary, "-o", toml], more].concat()
}

#[test]
fn a_measurement_becomes_a_material_file_that_export_takes() {
    let folder = folder();
    let [binary, toml, glb] = ["coat.binary", "fit.toml", "ball.glb"].map(|name| at(&folder, name));
    done(&measure(&binary, &toml, &["--dry-run"]));
    assert!(!Path::new(&toml).exists(), "a dry run writes nothing");
    let report = json(&measure(&binary, &toml, &["--json"]));
    assert_eq!(report["schema"], "sgdbake/measure/1");
    assert_eq!(report["energy"], "conserve");
    let suns = report["error"]["suns"].as_f64().unwrap();
    assert!(suns < 0.2, "{report}");
    let diffuse = report["material"]["diffuse"][0].as_f64().unwrap();
    assert!((diffuse - 0.3).abs() < 0.01, "{report}");
    assert!(report["uncertainty"]["rho_d"][0].as_f64().unwrap() < 0.05, "{report}");

    let text = fs::read_to_string(&toml).unwrap();
    assert!(text.contains("source = \"coat.binary\""), "{text}");
    done(&["export", "--shape", "ball", "--assign", &format!("*={toml}"), "-o", &glb]);
    let scene = fs::read(&glb).unwrap();
    let scene = String::from_utf8_lossy(&scene);
    assert!(scene.contains("coat.binary"), "the source of the stated error");

    done(&measure(&binary, &toml, &["--lobes", "1"]));
    fs::write(&toml, text.replacen("rho_d = [", "rho_d = [0.5, 0.5, 0.5] # ", 1)).unwrap();
    let refused = sgdbake(&measure(&binary, &toml, &[]));
    assert_eq!(refused.status.code(), Some(1), "an edited file is kept");
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--force"));
}

#[test]
fn a_measurement_goes_where_a_material_goes_and_a_note_says_so() {
    let folder = folder();
    let binary = at(&folder, "coat.binary");
    let pair = ["--wi", "0.3,0,1", "--wo=-0.3,0,1", "--json"];
    let output = sgdbake(&[&["eval", "--material", &binary], &pair[..]].concat());
    let note = String::from_utf8_lossy(&output.stderr);
    assert!(note.contains("coat.binary was fitted in") && note.contains("ΔE2000"), "{note}");
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let exact = json(&[&["eval", "--material", &at(&folder, "coat.toml")], &pair[..]].concat());
    for colour in ["r", "g", "b"] {
        let [found, exact] = [&found, &exact].map(|value| value[colour]["brdf"].as_f64().unwrap());
        assert!((found / exact - 1.0).abs() < 0.02, "{colour}: {found} {exact}");
    }
}

#[test]
fn fit_prints_the_same_object_for_a_measurement() {
    let folder = folder();
    let [binary, toml] = ["coat.binary", "coat.toml"].map(|name| at(&folder, name));
    let fit = |of: &str, path: &str| json(&["fit", of, path, "--model", "gltf", "--json"]);
    let (measured, material) = (fit("--measured", &binary), fit("--material", &toml));
    for key in ["schema", "material", "model", "fit", "appearance"] {
        assert!(measured.get(key).is_some() && material.get(key).is_some(), "{key}: {measured}");
    }
    for key in ["base_color", "metallic", "roughness", "residuals", "reasons"] {
        assert!(measured["fit"].get(key).is_some(), "{key}: {measured}");
    }
    let against = &measured["measured"];
    assert_eq!(against["fitted_to"], "measurement");
    let [direct, of_sgd] =
        [against, &against["of_sgd"]].map(|fit| fit["distance"]["suns"].as_f64().unwrap());
    assert!(direct < of_sgd + 0.3 && direct < 5.0, "{direct} {of_sgd}");
}

#[test]
fn what_is_no_measurement_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let letter = at(&folder, "letter.binary");
    fs::write(&letter, "Dear reader,\n").unwrap();
    let out = at(&folder, "out.toml");
    for arguments in [
        vec!["measure", &letter, "-o", &out],
        vec!["fit", "--measured", &letter],
        vec!["sheet", "--measured", &letter, "-o", &out],
        vec!["eval", "--material", &letter, "--wi", "0,0,1", "--wo", "0,0,1"],
    ] {
        let output = sgdbake(&arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {stderr}");
        assert!(stderr.contains("letter.binary"), "{arguments:?}: {stderr}");
    }
    let over_itself = sgdbake(&["measure", &letter, "-o", &letter, "--force"]);
    assert_ne!(over_itself.status.code(), Some(0));
    assert_eq!(fs::read_to_string(&letter).unwrap(), "Dear reader,\n");
}

/// `coat.toml` sampled in the plane and out of it, as a gonioreflectometer would.
fn csv(folder: &tempfile::TempDir) -> String {
    let material = sgdbake::material::load(Path::new(&at(folder, "coat.toml"))).unwrap();
    let brdf = sgdbake::brdf::SgdBrdf::new(&material, sgdbake::brdf::MaskingKind::Exact);
    let mut text = "theta_i,phi_i,theta_o,phi_o,r,g,b\n".to_owned();
    for i in (0..=16).map(|i| 5.0 * f64::from(i)) {
        for o in (0..=32).map(|o| 2.5 * f64::from(o)) {
            for phi in (0..=18).map(|phi| 10.0 * f64::from(phi)) {
                let direction = |theta: f64, phi: f64| {
                    sgdbake::math::direction::spherical(theta.to_radians(), phi.to_radians())
                };
                let [r, g, b] = brdf.eval(direction(i, 0.0), direction(o, phi));
                text += &format!("{i},0,{o},{phi},{r},{g},{b}\n");
            }
        }
    }
    let path = at(folder, "coat.csv");
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn every_format_of_measurements_becomes_a_material() {
    let folder = folder();
    let [bsdf, toml] = ["coat.bsdf", "fit.toml"].map(|name| at(&folder, name));
    done(&["tabulate", "--material", &at(&folder, "coat.toml"), "-o", &bsdf]);
    // A table of a few degrees is coarser than the lobe.
    for (path, near) in [(bsdf, 0.3), (csv(&folder), 1.0)] {
        let report = json(&measure(&path, &toml, &["--json", "--force"]));
        let suns = report["error"]["suns"].as_f64().unwrap();
        assert!(suns < near, "{path}: {report}");
        let diffuse = report["material"]["diffuse"][0].as_f64().unwrap();
        assert!((diffuse - 0.3).abs() < 0.02, "{path}: {report}");
    }
}

#[test]
fn every_model_is_fitted_to_a_measurement_and_to_its_sgd() {
    let folder = folder();
    let lines = done(&["fit", "--measured", &at(&folder, "coat.binary"), "--json"]);
    let lines: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 4);
    for line in lines {
        let against = &line["measured"];
        assert_eq!(against["fitted_to"], "measurement", "{line}");
        let [direct, of_sgd] =
            [against, &against["of_sgd"]].map(|fit| fit["distance"]["suns"].as_f64().unwrap());
        assert!(direct < of_sgd + 0.3, "{line}");
        if line["model"] == "beckmann" || line["model"] == "ggx" {
            assert!(line["fit"]["per_channel"]["channels"][2]["alpha"].as_f64().unwrap() > 0.0);
        }
    }
}

#[test]
fn a_refitted_material_has_the_fits_to_its_surface_unless_asked_for_those_to_the_sgd() {
    let fit = |to: &[&str]| {
        json(&[&["fit", "--material", "aluminium@refit", "--model", "ggx", "--json"], to].concat())
    };
    let (measured, of_sgd) = (fit(&[]), fit(&["--to", "sgd"]));
    let direct =
        sgdbake::asset::direct_fits().iter().find(|fits| fits.name == "aluminium").unwrap();
    let alpha = direct.ggx.measured.lobe.channels[0].alpha;
    let joint = |fit: &Value| fit["fit"]["joint"]["channels"][0]["alpha"].as_f64().unwrap();
    assert!((joint(&measured) - alpha).abs() < 1e-12, "{measured}");
    assert_eq!(measured["measured"]["fitted_to"], "measurement");
    assert!((joint(&of_sgd) - alpha).abs() > 1e-6 && of_sgd.get("measured").is_none(), "{of_sgd}");
}

#[test]
fn tabulate_writes_what_preview_and_audit_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).into_os_string().into_string().unwrap();
    let bsdf = path("gold.bsdf");
    let tabulate = |out: &str, more: &[&str]| {
        let common = ["tabulate", "--material", "gold-paint", "-o", out];
        sgdbake(&[&common[..], more].concat())
    };
    let dry = tabulate(&bsdf, &["--dry-run"]);
    assert_eq!(String::from_utf8(dry.stdout).unwrap(), format!("would write {bsdf}\n"));
    assert!(fs::read(&bsdf).is_err(), "a dry run writes nothing");
    let json: Value = serde_json::from_slice(&tabulate(&bsdf, &["--json"]).stdout).unwrap();
    assert_eq!((&json["schema"], &json["format"]), (&"sgdbake/tabulate/1".into(), &"rgl".into()));
    assert!(json["error"]["median"].as_f64().unwrap() < 0.002, "{json}");
    let first = fs::read(&bsdf).unwrap();
    assert!(tabulate(&bsdf, &["--threads", "1"]).status.success(), "it is the tool's own file");
    assert!(first == fs::read(&bsdf).unwrap(), "the same bytes on any number of threads");

    let binary = path("gold.binary");
    done(&["tabulate", "--measured", &bsdf, "-o", &binary]);
    let again = tabulate(&binary, &[]);
    assert_eq!(again.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&again.stderr).contains("overwrite it with --force"));
    assert!(tabulate(&binary, &["--force", "--model", "ggx"]).status.success());

    let report = done(&["audit", "--measured", &bsdf, "--material", "chrome", "--json"]);
    let report: Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["materials"][0]["material"], "chrome");
    let audit = &report["measurements"][0];
    assert!(audit["coverage"].as_f64().unwrap() > 0.98);
    assert!(audit["bands"][1]["reciprocity"].as_f64().unwrap() < 0.002);
    let albedo = audit["channels"][1]["albedo"][0]["albedo"].as_f64().unwrap();
    assert!((albedo - 0.1697).abs() < 1e-3, "{albedo}");
    assert!(done(&["audit", "--measured", &bsdf]).starts_with("## gold\n"));

    let picture = path("ball.png");
    let small = ["--size", "16", "--samples", "16", "-o", &picture];
    done(&[&["preview", "--measured", &bsdf, "--material", "chrome"], &small[..]].concat());
    assert!(fs::read(&picture).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn wrong_names_and_files_end_with_their_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let letter = folder.path().join("gold.binary");
    fs::write(&letter, "Dear reader,\n").unwrap();
    let letter = letter.to_str().unwrap();
    for (arguments, code, message) in [
        (vec!["audit", "--measured", letter], 1, "gold.binary: text whose first line"),
        (vec!["preview", "--measured", letter, "-o", "a.png"], 1, "text whose first line"),
        (vec!["tabulate", "--material", "chrome", "-o", "a.txt"], 2, "use .binary (MERL) or .bsdf"),
        (vec!["tabulate", "-o", "a.bsdf"], 2, "required"),
        (vec!["audit"], 2, "required"),
        (vec!["preview", "-o", "a.png"], 2, "required"),
    ] {
        let output = sgdbake(&arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
        assert!(stderr.contains(message), "{arguments:?}: {stderr}");
    }
}
