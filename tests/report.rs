//! The commands that look at materials: audit, preview, sheet, speed-error.

#[path = "support/command.rs"]
mod command;

use std::fs;
use std::path::{Path, PathBuf};

use crate::command::{done, sgdbake};

/// A model of the shared folder; `None`, said aloud, where it is absent.
fn shared(name: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let folder = std::env::var_os("SGDBAKE_SHARED").map_or(beside, PathBuf::from);
    let found = [folder.join("models").join(name), Path::new("../../shared/models").join(name)];
    let path = found.into_iter().find(|path| path.exists());
    if path.is_none() {
        eprintln!("skipped: {name} is not in the shared folder");
    }
    path
}

fn text(path: &Path) -> &str {
    path.to_str().expect("temporary paths are text")
}

#[test]
fn audit_finds_what_white_paint_breaks() {
    let page = done(&["audit", "--material", "white-paint"]);
    assert!(page.contains("| white-paint | r | 68.0° |"), "{page}");
    let json = done(&["audit", "--material", "white-paint", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(report["schema"], "sgdbake/audit/1");
    assert_eq!(report["materials"][0]["channels"][0]["gains_energy_from_deg"].to_string(), "68.0");
}

/// The laws hold at the corners of what a material file may say.
#[test]
fn the_laws_hold_at_the_ends_of_the_accepted_ranges() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (alpha, p) in [(1e-8, 0.0), (1e-8, 10.0), (0.12, 10.0), (100.0, 0.0), (100.0, 10.0)] {
        let path = folder.path().join("far.toml");
        let channel =
            format!("rho_d = 0.1\nrho_s = 0.2\nalpha = {alpha}\np = {p}\nf0 = 0.1\nf1 = 0\n");
        let file = format!("name = \"far\"\n[r]\n{channel}[g]\n{channel}[b]\n{channel}");
        fs::write(&path, file).expect("written");
        let report = done(&["audit", "--material", text(&path), "--json"]);
        let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
        let laws = report["materials"][0]["channels"][0]["laws"].as_array().expect("laws");
        assert_eq!(laws.len(), 5);
        for law in laws {
            assert!(law["deviation"].as_f64() <= law["bound"].as_f64(), "{alpha} {p}: {law}");
        }
    }
}

#[test]
fn a_preview_has_the_same_bytes_on_any_number_of_threads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let picture = |name: &str, threads: &str, seed: &str| {
        let path = folder.path().join(name);
        let common = ["preview", "--material", "gold-paint", "--size", "24", "--samples", "16"];
        done(&[&common[..], &["-o", text(&path), "--threads", threads, "--seed", seed]].concat());
        fs::read(path).expect("written")
    };
    let one = picture("one.png", "1", "5");
    assert_eq!(one, picture("two.png", "2", "5"));
    assert_ne!(one, picture("other.png", "2", "6"));
    assert_eq!(picture("one.exr", "1", "5"), picture("two.exr", "3", "5"));
    // A second run replaces its own file, and refuses a foreign one.
    picture("one.png", "1", "5");
    let foreign = folder.path().join("foreign.png");
    fs::write(&foreign, b"a holiday").expect("written");
    let refused = sgdbake(&["preview", "--material", "chrome", "-o", text(&foreign)]);
    assert_eq!(refused.status.code(), Some(1));
    assert_eq!(fs::read(&foreign).expect("there"), b"a holiday");
}

#[test]
fn every_model_can_be_shown_and_a_wrong_name_is_usage() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for model in ["sgd", "beckmann", "ggx", "mixture", "gltf", "lut"] {
        let path = folder.path().join(format!("{model}.png"));
        let size = ["--size", "8", "--samples", "16", "--model", model];
        done(&[&["preview", "--material", "chrome", "-o", text(&path)], &size[..]].concat());
        assert!(path.exists());
    }
    let jpg = sgdbake(&["preview", "--material", "chrome", "-o", "picture.jpg"]);
    assert_eq!(jpg.status.code(), Some(2));
    let absent =
        sgdbake(&["preview", "--material", "chrome", "-o", "a.png", "--environment", "no.hdr"]);
    assert_eq!(absent.status.code(), Some(1));
}

#[test]
fn a_real_environment_and_real_meshes_are_shown() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let small = ["--size", "32", "--samples", "16"];
    let with = |option: &str, file: &str| {
        let Some(path) = shared(file) else { return };
        let image = folder.path().join("image.exr");
        let common =
            ["preview", "--material", "gold-paint", "-o", text(&image), option, text(&path)];
        done(&[&common[..], &small[..]].concat());
        let pixels = covered(&image);
        assert!(pixels.len() > 20, "{file} covers {} pixels", pixels.len());
        assert!(pixels.iter().flatten().all(|c| c.is_finite() && *c >= 0.0));
        assert!(pixels.iter().any(|rgb| rgb[0] > 0.01), "{file} is dark");
    };
    with("--environment", "royal_esplanade_1k.hdr");
    for mesh in ["teapot.obj", "Box.glb"] {
        with("--mesh", mesh);
    }
    if let Some(compressed) = shared("pmndrs_suzi.glb") {
        let mesh = ["--mesh", text(&compressed)];
        let refused =
            sgdbake(&[&["preview", "--material", "chrome", "-o", "a.png"], &mesh[..]].concat());
        assert_eq!(refused.status.code(), Some(1));
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(message.contains("KHR_draco_mesh_compression") && message.contains("uncompressed"));
    }
}

/// Radiance of the pixels of an EXR that something covers.
fn covered(path: &Path) -> Vec<[f32; 3]> {
    let image = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |_, _| Vec::new(),
        |pixels: &mut Vec<[f32; 3]>, _, (r, g, b, a): (f32, f32, f32, f32)| {
            if a > 0.0 {
                pixels.push([r / a, g / a, b / a]);
            }
        },
    );
    image.expect("an EXR").layer_data.channel_data.pixels
}

/// The sheet of the paper's supplement, element by element.
#[test]
fn a_sheet_has_every_element_and_needs_no_other_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    done(&["sheet", "--material", "alum-bronze", "-o", text(folder.path())]);
    let page = fs::read_to_string(folder.path().join("alum-bronze.html")).expect("written");
    // K of the red channel, θ0 of the blue one, the paper's error of the green one.
    for number in ["46.3841", "-0.0661102", "0.0878706"] {
        assert!(page.contains(number), "{number} is missing");
    }
    assert_eq!(page.matches("<img ").count(), 5 + 4, "five balls, four difference maps");
    let refit = &sgdbake::material::refit_of("alum-bronze").expect("refitted").error;
    let row = format!("<tr><td>SGD refitted</td><td>{:.2}</td>", refit.delta_e);
    assert!(page.contains(&row), "{row} is missing");
    assert_eq!(page.matches("class=\"polar\"").count(), 4 * 3, "lobes per angle and channel");
    assert_eq!(page.matches("class=\"chart\"").count(), 3 + 4, "D per channel, F, G1, ΔG1, albedo");
    for heading in
        ["Parameters", "Pictures", "Lobes", "Distribution", "Fresnel", "Best fits", "Audit"]
    {
        assert!(page.contains(&format!("<h2>{heading}")), "{heading} is missing");
    }
    assert!(page.contains("prefers-color-scheme: dark"));
    assert!(
        !page.contains("http://")
            || page.matches("http://").count() == page.matches("http://www.w3.org").count()
    );
    let cells = page.split('>').filter_map(|rest| rest.split('<').next());
    assert!(cells.clone().count() > 500);
    for cell in cells {
        assert!(!cell.split(' ').any(|word| ["NaN", "inf", "-inf"].contains(&word)), "{cell}");
    }
    let index = fs::read_to_string(folder.path().join("index.html")).expect("written");
    assert!(index.contains("href=\"alum-bronze.html\""));
}

#[test]
fn speed_error_writes_its_three_files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = ["speed-error", "--material", "chrome", "--quick", "-o", text(folder.path())];
    assert_eq!(done(&[&arguments[..], &["--dry-run"]].concat()).lines().count(), 3);
    done(&arguments);
    let json = fs::read_to_string(folder.path().join("speed-error.json")).expect("written");
    let report: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(report["schema"], "sgdbake/speed-error/1");
    let methods = report["materials"][0]["methods"].as_array().expect("a list");
    assert!(methods.iter().any(|method| method["front"] == true));
    let page = fs::read_to_string(folder.path().join("speed-error.md")).expect("written");
    assert!(page.contains("![chrome](speed-error-chrome.svg)") && page.contains("**f64 exact"));
    let picture =
        fs::read_to_string(folder.path().join("speed-error-chrome.svg")).expect("written");
    assert!(picture.contains("xmlns=\"http://www.w3.org/2000/svg\"") && picture.contains("glTF"));
}

#[test]
fn completions_and_manual_pages_come_from_the_help() {
    assert!(done(&["completions", "bash"]).contains("speed-error"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    done(&["man", "-o", text(folder.path())]);
    let page = fs::read_to_string(folder.path().join("sgdbake-preview.1")).expect("written");
    assert!(page.contains(".TH sgdbake-preview 1") && page.contains("environment"));
    assert!(folder.path().join("sgdbake.1").exists());
}
