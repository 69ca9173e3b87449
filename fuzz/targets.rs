//! What is fuzzed: each function takes any bytes and must return. The fuzz targets and the bounded
//! run in tests/fuzz.rs call the same functions.

use std::{fs, io, path::Path};

use sgdbake::{
    brdf::Reflectance as _,
    material,
    measurement::Measurement,
    scene::{Assignment, Contents, Pattern, Scene, SlotId, resolve},
};

/// A .glb.
pub fn glb(bytes: &[u8]) {
    scene("scene.glb", bytes, &[]);
}

/// A .gltf.
pub fn gltf(bytes: &[u8]) {
    scene("scene.gltf", bytes, &[]);
}

/// An OBJ.
pub fn obj(bytes: &[u8]) {
    scene("scene.obj", bytes, &[]);
}

/// A material library.
pub fn mtl(bytes: &[u8]) {
    let obj = "mtllib scene.mtl\nv 0 0 0\nusemtl a\nf 1 1 1\nusemtl b\nf 1 1 1\n";
    scene("scene.obj", obj.as_bytes(), &[("scene.mtl", bytes)]);
}

/// An SGD material file.
pub fn material(bytes: &[u8]) {
    let _ = material::parse(&String::from_utf8_lossy(bytes), Path::new("material.toml"));
}

/// An assignment file, its patterns resolved.
pub fn assignment(bytes: &[u8]) {
    let Ok(assignments) = Assignment::parse_file(&String::from_utf8_lossy(bytes)) else { return };
    let patterns: Vec<_> =
        assignments.into_iter().map(|a| (Pattern::new(&a.slot), a.material)).collect();
    if let Ok(ball) = Scene::ball(2) {
        let _ = resolve(&ball.slots(), &patterns);
    }
}

/// A manifest, and the same bytes as a texture.
pub fn manifest(bytes: &[u8]) {
    let _ = Contents::of_manifest(&String::from_utf8_lossy(bytes));
    let _ = Contents::of_texture(bytes);
}

/// A measurement in any format; what is read has a value everywhere, and can be written again.
pub fn measurement(bytes: &[u8]) {
    let read = Measurement::from_reader(&mut io::Cursor::new(bytes), bytes.len() as u64);
    let Ok(measurement) = read else { return };
    for sample in measurement.samples().take(50) {
        assert!(sample.weight >= 0.0, "a weight is a solid angle");
        let f = measurement.eval(sample.wi, sample.wo);
        assert!(f.iter().all(|f| f.is_nan() || *f >= 0.0), "{f:?}");
    }
    if let Measurement::Rgl(rgl) = &measurement {
        let mut out = Vec::new();
        rgl.write_to(&mut out).expect("memory takes every write");
        let length = out.len() as u64;
        let again = Measurement::from_reader(&mut io::Cursor::new(out), length);
        let Ok(Measurement::Rgl(again)) = again else { panic!("what was written can be read") };
        assert_eq!(&again, rgl);
    }
}

/// Opens a scene with files beside it, and exports it with every slot assigned to both containers.
/// What opens, and lies in one folder, must come out as it came in.
fn scene(name: &str, bytes: &[u8], beside: &[(&str, &[u8])]) {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = folder.path().join(name);
    for (name, bytes) in beside.iter().chain([&(name, bytes)]) {
        fs::write(folder.path().join(name), bytes).expect("the temporary folder can be written");
    }
    let Ok(scene) = Scene::open(&path) else { return };
    restored(&scene, &folder.path().join("restored.glb"));
    let slots = scene.slots();
    let asset = super::asset();
    let assigned: Vec<_> = slots.iter().map(|slot| (slot.id, &asset)).collect();
    for target in ["out.glb", "out.gltf"] {
        let target = folder.path().join(target);
        for assigned in [&assigned[..], &[]] {
            let Ok(export) = scene.export(assigned, &target) else { continue };
            for file in &export.files {
                file.write_to(&mut io::sink()).expect("what opened can be read");
            }
            let mut out = Vec::new();
            export.files[0].write_to(&mut out).expect("memory takes every write");
            fs::write(&target, &out).expect("the temporary folder can be written");
            if target.extension() == path.extension() && assigned.is_empty() {
                assert_eq!(out, bytes, "without an assignment the file comes out byte for byte");
            }
            for file in export.files.iter().skip(1) {
                let mut content = Vec::new();
                file.write_to(&mut content).expect("memory takes every write");
                fs::write(&file.path, content).expect("the temporary folder can be written");
            }
            let again = Scene::open(&target).expect("what was exported can be opened");
            assert!(
                again.slots().len() >= slots.iter().filter(|s| s.id != SlotId::Unassigned).count()
            );
        }
    }
}

/// Restores every material whose extras can be read. What comes out can be opened.
fn restored(scene: &Scene, target: &Path) {
    let Ok(extras) = scene.extras() else { return };
    let asset = super::asset();
    let restored: Vec<_> = extras.iter().map(|(index, _)| (*index, &asset)).collect();
    let Ok(export) = scene.restored(&restored, target) else { return };
    let mut out = Vec::new();
    export.files[0].write_to(&mut out).expect("what opened can be read");
    fs::write(target, out).expect("the temporary folder can be written");
    let again = Scene::open(target).expect("what was restored can be opened");
    let read: Vec<usize> =
        again.measured().filter(|(_, read)| read.is_ok()).map(|(index, _)| index).collect();
    assert!(restored.iter().all(|(index, _)| read.contains(index)), "{read:?}");
}
