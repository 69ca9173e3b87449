//! Real clients read what an export wrote: the official glTF validator (no error that the input did
//! not have) and three.js; and ktx-parse what a bake wrote. All run in Node with the packages of tests/js; skipped with a message
//! where Node or the packages are absent.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
#![allow(clippy::print_stdout, reason = "the matrix of results is part of the output")]

mod support;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::{Value, json};
use sgdbake::encode::{Format, GENERATOR, encode};
use sgdbake::lut::{Depth, Depths, Extent, Quantity, Request, Table, bake};
use sgdbake::material::find;
use sgdbake::scene::{Pattern, Scene, resolve};
use support::{asset, export, models, scene_files};

/// The JSON lines that a script of tests/js prints for files.
fn node(script: &str, files: &[PathBuf]) -> Option<Vec<Value>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/js");
    if !folder.join("node_modules").is_dir() {
        eprintln!(
            "skipped: no node_modules in {}; scripts/test.sh installs them",
            folder.display()
        );
        return None;
    }
    let output = Command::new("node").arg(folder.join(script)).args(files).output();
    let Ok(output) = output else {
        eprintln!("skipped: Node.js is not there");
        return None;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    Some(text.lines().map(|line| serde_json::from_str(line).unwrap()).collect())
}

/// Every scene with all slots assigned, in both containers: the input (none for an OBJ) and the
/// two outputs.
fn exports(folder: &Path) -> Vec<(Option<PathBuf>, [PathBuf; 2])> {
    let asset = asset();
    let assign = |scene: &Scene, name: &str| {
        let slots = scene.slots();
        let all = [(Pattern::new("*"), ())];
        let resolved = resolve(&slots, &all).unwrap();
        assert!(resolved.iter().all(Option::is_some));
        let assigned: Vec<_> = slots.iter().map(|slot| (slot.id, &asset)).collect();
        ["glb", "gltf"].map(|ending| {
            let target = folder.join(format!("{name}-{ending}")).join(format!("{name}.{ending}"));
            export(scene, &assigned, &target);
            target
        })
    };
    let mut exports = vec![(None, assign(&Scene::ball(8).unwrap(), "ball"))];
    for (i, path) in models().iter().flat_map(|models| scene_files(models)).enumerate() {
        let name = format!("{i}-{}", path.file_stem().unwrap().to_string_lossy());
        let targets = assign(&Scene::open(&path).unwrap(), &name);
        exports.push(((path.extension().unwrap() != "obj").then_some(path), targets));
    }
    exports
}

type Errors = BTreeMap<String, usize>;

fn by_code(report: &Value) -> Errors {
    let mut errors = Errors::new();
    for error in report["errors"].as_array().unwrap() {
        *errors.entry(error["code"].to_string()).or_default() += 1;
    }
    errors
}

#[test]
fn the_validator_finds_no_error_that_the_input_did_not_have() {
    let folder = tempfile::tempdir().unwrap();
    let exports = exports(folder.path());
    let inputs = exports.iter().flat_map(|(input, outputs)| input.iter().chain(outputs));
    let Some(reports) = node("validate.mjs", &inputs.cloned().collect::<Vec<_>>()) else { return };
    let report = |path: &PathBuf| {
        let report = reports.iter().find(|report| report["file"] == *path.to_string_lossy());
        report.expect("the validator reports every file")
    };
    println!("{:<32} {:>6} {:>6} {:>6}  (validator errors)", "scene", "input", ".glb", ".gltf");
    let mut worse = Vec::new();
    for (input, outputs) in &exports {
        let before = input.as_ref().map(|path| by_code(report(path))).unwrap_or_default();
        let after = outputs.each_ref().map(|path| by_code(report(path)));
        let [glb, gltf] = after.each_ref().map(|errors| errors.values().sum::<usize>());
        let name = outputs[0].file_stem().unwrap().to_string_lossy();
        println!("{name:<32} {:>6} {glb:>6} {gltf:>6}", before.values().sum::<usize>());
        let added =
            |errors: &Errors| errors.iter().any(|(code, n)| before.get(code).unwrap_or(&0) < n);
        if after.iter().any(added) {
            worse.push(outputs.each_ref().map(|path| report(path)["errors"].clone()));
        }
    }
    assert!(worse.is_empty(), "{worse:#?}");
}

#[test]
fn three_js_loads_every_export_with_the_material_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let exports = exports(folder.path());
    let files: Vec<_> = exports.iter().flat_map(|(_, outputs)| outputs.clone()).collect();
    let Some(reports) = node("load.mjs", &files) else { return };
    assert_eq!(reports.len(), files.len());
    for (report, file) in reports.iter().zip(&files) {
        let materials = report["materials"].as_object().unwrap();
        assert!(!materials.is_empty(), "{}", file.display());
        for (name, material) in materials {
            let close =
                |key: &str, value: f64| (material[key].as_f64().unwrap() - value).abs() < 1e-6;
            assert!(close("roughness", 0.375) && close("metalness", 1.0), "{name}: {material}");
            assert_eq!(material["sgd"], "gold-paint", "{} {name}", file.display());
            assert_eq!(material["extras"], "gold-paint", "{} {name}", file.display());
        }
    }
}

/// A 2D and a 3D table of two materials in each depth that KTX 2 holds.
fn tables() -> Vec<Table> {
    let materials = ["chrome", "beige-fabric"].map(|name| &find(name).unwrap().material);
    let tables = |depth| {
        let request = Request {
            quantities: vec![Quantity::Masking, Quantity::Brdf3d],
            masking: Default::default(),
            extent: Extent::Size(20),
            depths: Depths::Only(depth),
        };
        bake(&materials, &request).unwrap().tables
    };
    [Depth::Half, Depth::Float].into_iter().flat_map(tables).collect()
}

#[test]
fn ktx_parse_reads_every_texel_as_it_was_baked() {
    let folder = tempfile::tempdir().unwrap();
    let tables = tables();
    let write = |(i, table): (usize, &Table)| {
        let path = folder.path().join(format!("{i}.ktx2"));
        std::fs::write(&path, encode(table, Format::Ktx2).unwrap()).unwrap();
        path
    };
    let files: Vec<PathBuf> = tables.iter().enumerate().map(write).collect();
    let Some(images) = node("ktx2.mjs", &files) else { return };
    assert_eq!(images.len(), 6, "a 2D table and two 3D tables in each depth");
    for (image, table) in images.iter().zip(&tables) {
        // VK_FORMAT_R16G16B16A16_SFLOAT and VK_FORMAT_R32G32B32A32_SFLOAT.
        let (format, bytes) = if table.texels.depth() == Depth::Half { (97, 2) } else { (109, 4) };
        assert_eq!(image["vkFormat"], format);
        assert_eq!(image["typeSize"], bytes);
        let size = ["pixelWidth", "pixelHeight", "pixelDepth"].map(|key| image[key].clone());
        let depth = table.size.get(2).copied().unwrap_or(0);
        assert_eq!(json!(size), json!([table.size[0], table.size[1], depth]));
        let counts = ["layerCount", "faceCount", "levels", "supercompression"];
        assert_eq!(json!(counts.map(|key| image[key].clone())), json!([0, 1, 1, 0]));
        let linear_bt709_rgba = json!({"colorModel": 1, "colorPrimaries": 1, "transferFunction": 1, "texelBytes": 4 * bytes});
        assert_eq!(image["descriptor"], linear_bt709_rgba);
        // Signed floats for R, G, B and A.
        let sample = |(i, channel): (usize, u32)| json!([8 * bytes * i, 8 * bytes, 0xC0 | channel]);
        let samples: Vec<Value> = [0, 1, 2, 15].into_iter().enumerate().map(sample).collect();
        assert_eq!(image["samples"], json!(samples));
        assert_eq!(image["writer"], GENERATOR);
        assert_eq!(image["entry"]["quantity"], table.quantity.name());
        let texels = image["texels"].as_array().unwrap();
        assert_eq!(texels.len(), 4 * table.texels.len());
        for (i, rgba) in texels.chunks(4).enumerate() {
            let [r, g, b] = table.texels.get(i).map(f64::from);
            let read: Vec<f64> = rgba.iter().filter_map(Value::as_f64).collect();
            assert_eq!(read, [r, g, b, 1.0], "texel {i}");
        }
    }
}
