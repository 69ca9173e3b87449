//! The bake's promises: what is stored, what is left out, and what a wrong texel would do.

mod common;

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use assert_cmd::Command;
use common::materials::shared_lobes;
use sgdbake::brdf::{MaskingKind, SgdBrdf};
use sgdbake::lut::factors::{Subject, measure};
use sgdbake::lut::probe::probes;
use sgdbake::lut::{
    BakeError, Baked, Depth, Depths, Extent, Filter, Placed, Quantity, Request, Rows, Table, Term,
    Texels, bake, bake_with_progress,
};
use sgdbake::material::{Material, find};

const FACTORS: [Quantity; 3] = [Quantity::Ndf, Quantity::Masking, Quantity::Fresnel];

fn material(name: &str) -> &'static Material {
    &find(name).expect("in the catalogue").material
}

fn request(tolerance: f64) -> Request {
    Request {
        quantities: FACTORS.to_vec(),
        masking: MaskingKind::Exact,
        extent: Extent::Tolerance(tolerance),
        depths: Depths::Smallest,
    }
}

fn texels(baked: &Baked) -> usize {
    baked.tables.iter().map(|table| table.texels.len()).sum()
}

#[test]
fn sharp_and_rough_materials_keep_every_tolerance() {
    for name in
        ["chrome-steel", "specular-orange-phenolic", "pink-fabric", "beige-fabric", "blue-fabric"]
    {
        let mut before = 0;
        for tolerance in [1e-2, 1e-3, 1e-4] {
            let baked = bake(&[material(name)], &request(tolerance)).expect("within reach");
            let measured = baked.tables[0].error.measured.expect("measured");
            assert!(measured <= tolerance, "{name}: {measured:e} at {tolerance:e}");
            assert!(
                measured > 0.2 * tolerance,
                "{name}: {measured:e} wastes texels at {tolerance:e}"
            );
            assert!(texels(&baked) > before, "{name}: a smaller error for fewer texels");
            before = texels(&baked);
        }
    }
}

/// Lobes that colour all channels, each with its own row of `fresnel` where two meet in a colour.
#[test]
fn shared_lobes_keep_their_tolerance() {
    for material in shared_lobes() {
        for (tolerance, quantities) in [(1e-2, &Quantity::ALL[..]), (1e-3, &Quantity::ALL[..4])] {
            let wanted = Request { quantities: quantities.to_vec(), ..request(tolerance) };
            let baked = bake(&[&material], &wanted).expect("within reach");
            let stored = material.lobes().len() - baked.left_out.len();
            assert_eq!(baked.placed[0].fresnel_rows.len(), material.lobes().len());
            assert_eq!(baked.tables[2].size[1], stored, "{}: rows of fresnel", material.name);
            for table in &baked.tables {
                let measured = table.error.measured.expect("measured");
                let quantity = table.quantity.name();
                assert!(measured <= tolerance, "{} {quantity}: {measured:e}", material.name);
            }
        }
    }
}

/// The verification finds a probe that refuses the first search's textures.
#[test]
fn a_search_that_missed_the_worst_goes_on() {
    let baked = bake(&[material("yellow-paint")], &request(3e-4)).expect("within reach");
    let measured = baked.tables[0].error.measured.expect("measured");
    assert!(measured <= 3e-4, "{measured:e}");
}

#[test]
fn the_3d_table_keeps_its_tolerance() {
    // The first search for yellow-plastic misses its worst probe.
    for name in ["chrome-steel", "blue-fabric", "yellow-plastic"] {
        let wanted = Request { quantities: vec![Quantity::Brdf3d], ..request(1e-2) };
        let baked = bake(&[material(name)], &wanted).expect("within reach");
        let [table] = &baked.tables[..] else { panic!("one row, one table") };
        assert!(table.error.measured.is_some_and(|error| error <= 1e-2));
        assert!(matches!(table.texels, Texels::Half(_)));
    }
}

#[test]
fn progress_counts_materials_and_3d_tables() {
    let steps = AtomicUsize::new(0);
    let wanted = Request {
        quantities: vec![Quantity::Ndf, Quantity::Brdf3d],
        extent: Extent::Size(8),
        ..request(1.0)
    };
    let step = || {
        steps.fetch_add(1, Ordering::Relaxed);
    };
    bake_with_progress(&[material("chrome"), material("teflon")], &wanted, &step).expect("small");
    assert_eq!(steps.into_inner(), 4, "two materials sampled, two tables filled");
}

#[test]
fn a_wrong_texel_is_noticed() {
    let material = material("gold-paint");
    let brdf = SgdBrdf::new(material, MaskingKind::Exact);
    let mut rows = Rows::default();
    rows.push("gold-paint", &brdf, [true; 3]);
    let placed = Placed::new(material, Some(0), &rows);
    let subject = || [Subject::new(&rows, &placed, probes(&brdf, 5)).expect("it has a row")];
    let mut tables: Vec<Table> =
        Term::ALL.iter().map(|term| term.tabulate(&rows, 128, Depth::Float)).collect();
    let right = measure(&subject(), &tables, &[Filter::Fetched]);
    let Texels::Float(masking) = &mut tables[1].texels else { panic!("float was asked for") };
    masking[90][1] += 0.01;
    let wrong = measure(&subject(), &tables, &[Filter::Fetched]);
    assert!(right < 5e-4 && wrong > 2e-3, "{right:e} {wrong:e}");
}

#[test]
fn equal_lobes_share_a_row_and_invisible_ones_have_none() {
    let lobes = material("gold-paint").lobes().to_vec();
    let twin = Material::new("twin", [0.9, 0.1, 0.1], lobes).expect("in range");
    let materials = [material("gold-paint"), material("black-fabric"), &twin];
    let baked = bake(&materials, &request(1e-3)).expect("within reach");
    let rows: Vec<Option<usize>> = baked.placed.iter().map(|placed| placed.row).collect();
    assert_eq!(rows, [Some(0), None, Some(0)]);
    assert_eq!(baked.tables[0].size[1], 1);
    assert_eq!(baked.left_out.len(), 3, "black-fabric has no visible lobe in any channel");
}

#[test]
fn what_no_texture_can_be_is_refused() {
    let gold = [material("gold-paint")];
    for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-9, 1e9] {
        let refused = bake(&gold, &request(tolerance));
        assert!(matches!(refused, Err(BakeError::Tolerance { .. })), "{tolerance}");
    }
    for size in [0, 1, 16385, usize::MAX] {
        let refused = bake(&gold, &Request { extent: Extent::Size(size), ..request(1.0) });
        assert!(matches!(refused, Err(BakeError::Size { .. })), "{size}");
        let quantities = vec![Quantity::Brdf3d];
        let wanted = Request { extent: Extent::Size(size), quantities, ..request(1.0) };
        assert!(bake(&gold, &wanted).is_err(), "{size}");
    }
    let half = Request { depths: Depths::Only(Depth::Half), ..request(1e-5) };
    let Err(BakeError::NotReached { best, .. }) = bake(&gold, &half) else {
        panic!("half floats cannot keep 1e-5")
    };
    assert!(best > 1e-5 && best < 1e-2);
    let integers = Request { depths: Depths::Only(Depth::Unorm16), ..request(1e-3) };
    assert_eq!(bake(&gold, &integers), Err(BakeError::Range(Quantity::Ndf)));
}

fn sgdbake(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("sgdbake").expect("built with the tests");
    command.args(arguments);
    command
}

fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<(String, Vec<u8>)> = fs::read_dir(folder)
        .expect("the bake wrote it")
        .map(|entry| entry.expect("readable").path())
        .map(|path| {
            (
                path.file_name().expect("a file").to_string_lossy().into_owned(),
                fs::read(path).expect("readable"),
            )
        })
        .collect();
    files.sort();
    files
}

#[test]
fn any_number_of_threads_writes_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut written = Vec::new();
    for threads in ["1", "2", "5"] {
        let out = folder.path().join(threads);
        let quantities = "--quantity=ndf,masking,fresnel,brdf3d";
        let arguments = [
            "bake",
            "--material=chrome",
            "--material=teflon",
            "--tolerance=1e-2",
            quantities,
            "--threads",
            threads,
            "-o",
        ];
        sgdbake(&arguments).arg(&out).assert().success();
        written.push(files(&out));
    }
    assert_eq!(written[0].len(), 8, "three factors, two volumes, two shaders, a manifest");
    assert!(written.windows(2).all(|pair| pair[0] == pair[1]));
}

#[test]
fn exit_codes_say_what_went_wrong() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("lut");
    let bake = |arguments: &[&str]| {
        let mut command = sgdbake(&["bake", "--material", "chrome", "-o"]);
        command.arg(&out).args(arguments).assert()
    };
    bake(&["--tolerance", "1e-9"]).code(2);
    bake(&["--format", "png"]).code(2);
    bake(&["--tolerance", "1e-5", "--depth", "half"]).code(3);
    bake(&["--dry-run"]).success();
    assert!(!out.exists(), "nothing is written on failure or in a dry run");
    fs::create_dir(&out).expect("writable");
    fs::write(out.join("manifest.json"), "{}").expect("writable");
    bake(&[]).code(1);
    assert_eq!(fs::read_dir(&out).expect("readable").count(), 1, "all or nothing");
    bake(&["--force"]).success();
    bake(&[]).success();
}

#[test]
fn absurd_sizes_and_tolerances_are_told_what_is_accepted() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("lut");
    for command in
        [&["bake", "--material=chrome"][..], &["export", "--shape=ball", "--assign=*=chrome"]]
    {
        let target = out.with_extension("glb");
        let refused = |option: &str, value: &str, said: &str| {
            let output = sgdbake(command).args([option, value, "-o"]).arg(&target).output();
            let output = output.expect("it runs");
            let message = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(2), "{option} {value}: {message}");
            assert!(message.contains(said), "{option} {value}: {message}");
        };
        for tolerance in ["0", "-1", "NaN", "inf", "1e-9", "1e9"] {
            refused("--tolerance", tolerance, "must be between 0.000001 and 0.5");
        }
        for size in ["0", "1", "1000000000"] {
            refused("--size", size, "a texture has 2 to 16384");
        }
        for size in ["-4", "1e3", "99999999999999999999999"] {
            refused("--size", size, size);
        }
        assert!(!target.exists());
    }
    let sizes = sgdbake(&["bake", "--material=chrome", "--quantity=brdf3d", "--size=513", "-o"])
        .arg(&out)
        .assert()
        .code(2);
    let message = String::from_utf8_lossy(&sizes.get_output().stderr).into_owned();
    assert!(message.contains("a 3D texture has 2 to 512"), "{message}");
}

#[test]
fn a_scene_takes_only_what_its_meshes_show() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = folder.path().join("two.obj");
    fs::write(&scene, "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl Seat\nf 1 2 3\n").expect("writable");
    let out = folder.path().join("lut");
    let assert = sgdbake(&["bake"])
        .arg(&scene)
        .args(["--assign=*=chrome", "--tolerance=2e-2", "--compare", "--json", "-o"])
        .arg(&out)
        .assert()
        .success();
    let report: serde_json::Value =
        serde_json::from_slice(&assert.get_output().stdout).expect("one JSON object");
    assert_eq!(report["rows"], 1);
    let [one, all] = ["texture_bytes", "catalogue_texture_bytes"]
        .map(|key| report[key].as_u64().expect("a number"));
    // A hundred times the factors, the albedo, and 3D tables that are larger than both.
    assert!(all > 500 * one, "{report}");
    assert_eq!(report["catalogue_out_of_reach"], 0);
}
