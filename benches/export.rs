//! The cost of carrying a scene through, against what the machine needs for the bytes alone.
//! Compare lines of one run: `copy` with `export` for a .glb, `tobj` with `open` for an OBJ.

use std::{
    fmt::Write as _,
    fs::{self, File},
    io::BufReader,
    path::{Path, PathBuf},
    sync::OnceLock,
};

use divan::{Bencher, black_box};
use sgdbake::asset::Asset;
use sgdbake::scene::Scene;

#[path = "../tests/support/asset.rs"]
mod support;

fn main() {
    divan::main();
}

/// A grid of 2·`n`² triangles, as OBJ with normals and texture coordinates.
fn grid(n: usize) -> String {
    let mut text = String::new();
    for i in 0..=n {
        for j in 0..=n {
            let [x, y] = [i, j].map(|i| i as f64 / n as f64);
            let z = 0.1 * (20.0 * x).sin() * (20.0 * y).cos();
            let _ = writeln!(
                text,
                "v {x:.6} {y:.6} {z:.6}\nvt {x:.6} {y:.6}\nvn 0.000000 0.000000 1.000000"
            );
        }
    }
    for i in 0..n {
        for j in 0..n {
            let a = i * (n + 1) + j + 1;
            let [b, c, d] = [a + 1, a + n + 2, a + n + 1];
            let _ = writeln!(
                text,
                "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}\nf {a}/{a}/{a} {c}/{c}/{c} {d}/{d}/{d}"
            );
        }
    }
    text
}

/// A folder with a million triangles as `grid.obj` and `grid.glb`.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, path) = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let path = folder.path().to_owned();
        fs::write(path.join("grid.obj"), grid(708)).expect("the temporary folder can be written");
        let scene = Scene::open(&path.join("grid.obj")).expect("the grid is valid");
        write(&scene, &[], &path.join("grid.glb"));
        (folder, path)
    });
    path
}

fn write(scene: &Scene, assets: &[&Asset], target: &Path) {
    let slots = scene.slots();
    let assigned: Vec<_> = slots.iter().map(|slot| slot.id).zip(assets.iter().copied()).collect();
    for file in scene.export(&assigned, target).expect("the scene can be exported").files {
        let mut out = File::create(&file.path).expect("the temporary folder can be written");
        file.write_to(&mut out).expect("the temporary folder can be written");
    }
}

/// The .glb read and written, nothing else.
#[divan::bench]
fn glb_copy(bencher: Bencher<'_, '_>) {
    let [from, to] = ["grid.glb", "copy.glb"].map(|name| folder().join(name));
    bencher.bench(|| {
        let bytes = fs::read(&from).expect("the grid was written");
        fs::write(&to, bytes).expect("the temporary folder can be written");
    });
}

/// The .glb opened, a material put in, written.
#[divan::bench]
fn glb_export(bencher: Bencher<'_, '_>) {
    let [from, to] = ["grid.glb", "out.glb"].map(|name| folder().join(name));
    let asset = support::asset();
    bencher.bench(|| {
        let scene = Scene::open(&from).expect("the grid is valid");
        write(&scene, &[&asset], &to);
    });
}

/// The OBJ read by tobj alone.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn obj_tobj(bencher: Bencher<'_, '_>) {
    let path = folder().join("grid.obj");
    let options = tobj::LoadOptions { single_index: true, triangulate: true, ..Default::default() };
    bencher.bench(|| {
        let mut reader = BufReader::new(File::open(&path).expect("the grid was written"));
        black_box(tobj::load_obj_buf(&mut reader, &options, |_| Ok(Default::default())))
            .expect("the grid is valid")
    });
}

/// The OBJ opened as a glTF document.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn obj_open(bencher: Bencher<'_, '_>) {
    let path = folder().join("grid.obj");
    bencher.bench(|| black_box(Scene::open(&path)).expect("the grid is valid"));
}
