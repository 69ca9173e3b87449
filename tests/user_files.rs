//! What belongs to the user is safe: inputs, files of other programs, names, terminals.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::ffi::OsStr;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use sgdbake::scene::{Scene, SceneError};

fn run<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sgdbake"));
    command.current_dir(folder).arg("--quiet").args(arguments).output().unwrap()
}

fn words(text: &str) -> Vec<&str> {
    text.split(' ').collect()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn material(name: &str) -> String {
    let channel = "rho_d = 0.1\nrho_s = 0.2\nalpha = 0.1\np = 0.5\nf0 = 0.1\nf1 = -0.4\n";
    format!("name = {}\n[r]\n{channel}[g]\n{channel}[b]\n{channel}", json!(name))
}

/// Each of these was taken for a file of sgdbake's own, as it mentions the name.
#[test]
fn files_that_mention_sgdbake_are_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let scene = json!({
        "asset": {"version": "2.0", "generator": "an editor"},
        "materials": [{"extensions": {"SGD_materials_shifted_gamma": {"version": 2}}}],
    });
    for (name, content) in [
        ("ndf.exr", "a note on sgdbake 0.1.0"),
        ("manifest.json", "{\"note\": \"made from sgdbake/manifest/2\"}"),
        ("sgd_lut.glsl", "// My decoder, after sgdbake 0.1.0"),
    ] {
        fs::write(folder.path().join(name), content).unwrap();
        let bake = words("bake --material gold-paint --size 8 -o .");
        let output = run(folder.path(), &bake);
        assert_eq!(output.status.code(), Some(1), "{name}");
        let expected = format!("{name} exists and was not written by sgdbake");
        assert!(stderr(&output).contains(&expected), "{}", stderr(&output));
        let left: Vec<_> = fs::read_dir(folder.path()).unwrap().collect();
        assert_eq!(left.len(), 1, "nothing else is written");
        fs::remove_file(folder.path().join(name)).unwrap();
    }
    fs::write(folder.path().join("out.gltf"), scene.to_string()).unwrap();
    let export = words("export --shape ball --assign *=gold-paint --tolerance 1e-2 -o out.gltf");
    assert_eq!(run(folder.path(), &export).status.code(), Some(1));
    assert_eq!(fs::read_to_string(folder.path().join("out.gltf")).unwrap(), scene.to_string());
    let forced: Vec<&str> = export.into_iter().chain(["--force"]).collect();
    assert!(run(folder.path(), &forced).status.success());
    // Its own files it writes again, also in a scene of another program, until somebody edits them.
    let export = "export out.gltf --assign *=gold-paint --tolerance 1e-2 -o again.gltf";
    let mut other: Value =
        serde_json::from_slice(&fs::read(folder.path().join("out.gltf")).unwrap()).unwrap();
    other["asset"]["generator"] = json!("an editor");
    fs::write(folder.path().join("out.gltf"), other.to_string()).unwrap();
    assert!(run(folder.path(), &words(export)).status.success());
    assert!(run(folder.path(), &words(export)).status.success());
    let again = folder.path().join("again.gltf");
    let edited = fs::read_to_string(&again).unwrap().replace("\"ball\"", "\"bowl\"");
    fs::write(&again, &edited).unwrap();
    assert_eq!(run(folder.path(), &words(export)).status.code(), Some(1));
    assert_eq!(fs::read_to_string(&again).unwrap(), edited);
}

#[test]
fn an_input_is_never_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let export = "export --shape ball --assign *=gold-paint --tolerance 1e-2 -o ball.glb";
    assert!(run(folder.path(), &words(export)).status.success());
    let before = fs::read(folder.path().join("ball.glb")).unwrap();
    std::os::unix::fs::symlink("ball.glb", folder.path().join("link.glb")).unwrap();
    for target in ["ball.glb", "./ball.glb", "link.glb"] {
        let again = format!("export ball.glb --assign *=chrome --force -o {target}");
        let output = run(folder.path(), &words(&again));
        assert_eq!(output.status.code(), Some(2), "{target}");
        assert!(stderr(&output).contains("is an input of this command"), "{}", stderr(&output));
    }
    assert!(fs::read(folder.path().join("ball.glb")).unwrap() == before);
}

/// Each folder is locked while files are written: one lock per folder, not per spelling.
#[test]
fn a_folder_with_two_spellings_is_written_without_waiting_for_itself() {
    let folder = tempfile::tempdir().unwrap();
    let textures = folder.path().join("in/tex");
    fs::create_dir_all(&textures).unwrap();
    fs::write(textures.join("b.bin"), [0; 4]).unwrap();
    fs::write(textures.join("a.png"), "not really PNG").unwrap();
    // `link` is another spelling of `tex`, in the scene's folder and where the scene goes.
    for link in ["in/link", "link"] {
        std::os::unix::fs::symlink("tex", folder.path().join(link)).unwrap();
    }
    for [buffer, image] in [["./tex/b.bin", "tex/a.png"], ["tex/b.bin", "link/a.png"]] {
        let scene = json!({"asset": {"version": "2.0"},
            "buffers": [{"uri": buffer, "byteLength": 4}], "images": [{"uri": image}]});
        fs::write(folder.path().join("in/a.gltf"), scene.to_string()).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_sgdbake"));
        let command = command.current_dir(folder.path());
        let export = words("--quiet export in/a.gltf --force -o out.gltf");
        let mut child = command.args(export).spawn().unwrap();
        let deadline = Instant::now() + Duration::from_secs(30);
        let status = loop {
            match child.try_wait().unwrap() {
                Some(status) => break Some(status),
                None if Instant::now() > deadline => break None,
                None => std::thread::sleep(Duration::from_millis(10)),
            }
        };
        if status.is_none() {
            child.kill().unwrap();
            child.wait().unwrap();
        }
        assert!(status.is_some_and(|status| status.success()), "{buffer} and {image}: {status:?}");
        assert!(
            folder.path().join("tex/b.bin").exists() && folder.path().join("tex/a.png").exists()
        );
    }
}

#[test]
fn materials_of_one_name_have_sheets_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    for (file, name) in [("a.toml", "same"), ("b.toml", "same"), ("c.toml", "index")] {
        fs::write(folder.path().join(file), material(name)).unwrap();
    }
    let sheet = "sheet --material a.toml --material b.toml --material c.toml -o . --dry-run";
    let output = run(folder.path(), &words(sheet));
    let lines = String::from_utf8(output.stdout).unwrap();
    let expected = "would write ./same.html\nwould write ./same-2.html\n\
                    would write ./index-2.html\nwould write ./view.html\nwould write ./index.html\n";
    assert_eq!(lines, expected);
}

#[test]
fn names_reach_neither_terminal_nor_file_system_raw() {
    let folder = tempfile::tempdir().unwrap();
    let hostile = "a\u{1b}[2J\n../b";
    fs::write(folder.path().join("a.toml"), material(hostile)).unwrap();
    let slot = json!({"asset": {"version": "2.0"}, "materials": [{"name": hostile}],
        "meshes": [{"name": hostile, "primitives": [{"attributes": {}, "material": 0}]}]});
    fs::write(folder.path().join("a.gltf"), slot.to_string()).unwrap();
    for command in [
        "inspect a.gltf",
        "inspect a.gltf --json",
        "materials a.toml",
        "sheet --material a.toml -o . --dry-run",
        "export a.gltf --assign *=nothing -o b.gltf",
        "export a.gltf --assign x=gold-paint -o b.gltf",
    ] {
        let output = run(folder.path(), &words(command));
        let all = [output.stdout, output.stderr].concat();
        let raw = all.iter().any(|byte| byte.is_ascii_control() && *byte != b'\n');
        assert!(!raw, "{command}: {}", String::from_utf8_lossy(&all));
    }
    let output = run(folder.path(), &words("inspect a.gltf"));
    let lines = String::from_utf8(output.stdout).unwrap();
    assert_eq!(lines.lines().count(), 2, "a name stays on its line: {lines}");
    assert!(lines.contains(r"slot #0 a\u{1b}[2J\n../b"), "{lines}");
}

#[test]
fn pipes_and_devices_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe.gltf");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    assert!(matches!(Scene::open(&pipe), Err(SceneError::NotAFile)));
    for command in [
        "inspect pipe.gltf",
        "export pipe.gltf -o out.glb",
        "export --shape ball --assign *=gold-paint --tolerance 1e-2 -o pipe.gltf",
        "materials ./pipe.gltf",
        "eval --material chrome --pairs pipe.gltf",
        "export --shape ball --assign-file pipe.gltf -o out.glb",
        "preview --material chrome --environment pipe.gltf -o out.png",
    ] {
        let output = run(folder.path(), &words(command));
        assert!(stderr(&output).contains("not a regular file"), "{command}: {}", stderr(&output));
    }
}

#[test]
fn pairs_are_read_line_by_line_from_stdin_too() {
    let folder = tempfile::tempdir().unwrap();
    let eval = |input: &[u8]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sgdbake"));
        command.current_dir(folder.path()).args(words("eval --material chrome --pairs - --json"));
        let command = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        // A refused input closes the pipe early.
        let _ = child.stdin.take().unwrap().write_all(input);
        child.wait_with_output().unwrap()
    };
    let header = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z\n";
    let output = eval(format!("\u{feff}{header}0,0,1,0,0,1\n").as_bytes());
    assert!(output.status.success(), "{}", stderr(&output));
    let line: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(line["wi"], json!([0.0, 0.0, 1.0]));
    let endless = [header.as_bytes(), &vec![b'1'; 1 << 20]].concat();
    let output = eval(&endless);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("-:2: the line has more than 4096 bytes"));
}

/// What does not fit is refused, not cut: a shorter file may be a valid one that says less.
#[test]
fn assignments_from_stdin_are_as_long_as_those_of_a_file_at_most() {
    let folder = tempfile::tempdir().unwrap();
    let line = "\"*\" = \"gold-paint\"\n";
    let text = [line.as_bytes(), &vec![b'\n'; 16 << 20]].concat();
    fs::write(folder.path().join("a.toml"), &text).unwrap();
    for file in ["a.toml", "-"] {
        let export = format!("export --shape ball --assign-file {file} --dry-run -o out.glb");
        let mut command = Command::new(env!("CARGO_BIN_EXE_sgdbake"));
        let command = command.current_dir(folder.path()).args(words(&export));
        let command = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        // A refused input closes the pipe early.
        let _ = child.stdin.take().unwrap().write_all(&text);
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{file}: {}", stderr(&output));
        let expected = "a text of this kind has at most 16777216 bytes";
        assert!(stderr(&output).contains(expected), "{file}: {}", stderr(&output));
    }
}

/// A page is one file, wherever the scene lies.
#[test]
fn a_page_names_the_file_that_it_cannot_take_in() {
    let folder = tempfile::tempdir().unwrap();
    for place in ["page", "other"] {
        fs::create_dir(folder.path().join(place)).unwrap();
        let scene = folder.path().join(place).join("a.gltf");
        let export = "export --shape ball --assign *=gold-paint --tolerance 1e-2 -o";
        let export: Vec<&str> =
            words(export).into_iter().chain([scene.to_str().unwrap()]).collect();
        assert!(run(folder.path(), &export).status.success());
        let mut document: Value = serde_json::from_slice(&fs::read(&scene).unwrap()).unwrap();
        document["extensions"] = json!({"MADE_up": {"uri": "note.txt"}});
        fs::write(&scene, document.to_string()).unwrap();
        fs::write(folder.path().join(place).join("note.txt"), "a note").unwrap();
        let view = format!("view {place}/a.gltf --dry-run -o a.html");
        let output = run(folder.path(), &words(&view));
        let expected = "the scene keeps a file beside it, note.txt";
        assert!(stderr(&output).contains(expected), "{place}: {}", stderr(&output));
    }
}

/// What exists at the output path is told by its head: a file of any size is refused at once.
#[test]
fn a_large_file_in_the_way_is_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let file = fs::File::create(folder.path().join("out.png")).unwrap();
    file.set_len(1 << 40).unwrap();
    let output = run(folder.path(), &words("preview --material chrome -o out.png"));
    assert!(stderr(&output).contains("was not written by sgdbake"), "{}", stderr(&output));
}

fn open(document: &Value) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    fs::write(&path, document.to_string()).unwrap();
    Scene::open(&path)
}

#[test]
fn versions_of_gltf_that_are_not_read_are_named() {
    let old = json!({"asset": {"version": "1.0"}, "materials": {"a": {}}, "scene": "default"});
    let expected =
        "the scene is glTF 1.0; sgdbake reads glTF 2.0. Convert the scene to glTF 2.0 first";
    assert_eq!(open(&old).unwrap_err().to_string(), expected);
    let new = json!({"asset": {"version": "2.1", "minVersion": "2.1"}});
    let message = open(&new).unwrap_err().to_string();
    assert!(message.starts_with("the scene needs glTF 2.1 or later"), "{message}");
    assert!(open(&json!({"asset": {"version": "2.1", "minVersion": "2.0"}})).is_ok());
}

#[test]
fn a_first_buffer_without_content_does_not_go_into_a_glb() {
    let document = json!({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4}]});
    let scene = open(&document).unwrap();
    let error = scene.export(&[], Path::new("out.glb")).unwrap_err();
    assert!(matches!(error, SceneError::NoContent), "{error}");
    assert!(scene.export(&[], Path::new("out.gltf")).is_ok());
}

#[test]
fn a_scene_that_opens_can_be_exported_however_deep_it_nests() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    let depth = 100_000;
    let nest = "[".repeat(depth) + &"]".repeat(depth);
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"extras":{nest},"materials":[{{"extras":{nest}}}]}}"#
    );
    fs::write(&path, &text).unwrap();
    let scene = Scene::open(&path).unwrap();
    for target in ["out.gltf", "out.glb"] {
        scene.export(&[], &folder.path().join(target)).unwrap();
    }
    scene.pruned(&[]).unwrap();
}

/// Whatever a name promises, a file larger than any of its kind is refused by its length or head.
#[test]
fn large_files_are_not_read_to_say_what_is_in_them() {
    let folder = tempfile::tempdir().unwrap();
    for (name, message) in [("a.exr", "not a texture"), ("a.json", "a manifest has at most")] {
        let file = fs::File::create(folder.path().join(name)).unwrap();
        file.set_len(1 << 40).unwrap();
        let output = run(folder.path(), &["inspect", name]);
        assert!(stderr(&output).contains(message), "{name}: {}", stderr(&output));
    }
}

/// A scene in text is held in memory: one of more bytes than that is for is refused by its length,
/// and one without line breaks by its first line.
#[test]
fn large_scenes_are_refused_before_they_are_read() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes, message) in [
        ("a.obj", 6 << 30, "found 6442450944 bytes; an .obj is read up to 4294967296"),
        ("b.obj", 3 << 30, "line 1: the line has more than 16777216 bytes"),
        ("c.gltf", 6 << 30, "the JSON of a glTF is read up to 2147483648"),
    ] {
        let file = fs::File::create(folder.path().join(name)).unwrap();
        file.set_len(bytes).unwrap();
        let start = Instant::now();
        let output = run(folder.path(), &["inspect", name]);
        assert_eq!(output.status.code(), Some(1), "{name}: {}", stderr(&output));
        assert!(stderr(&output).contains(message), "{name}: {}", stderr(&output));
        assert!(start.elapsed().as_secs() < 10, "{name} was read");
    }
    let scene = folder.path().join("d.obj");
    fs::write(&scene, "mtllib big.mtl\nv 0 0 0\nf 1 1 1\n").unwrap();
    fs::File::create(folder.path().join("big.mtl")).unwrap().set_len(1 << 30).unwrap();
    let output = run(folder.path(), &["inspect", "d.obj"]);
    assert!(stderr(&output).contains("an .mtl is read up to"), "{}", stderr(&output));
}

/// A bake that needs more memory than the process may have says so before it starts.
#[cfg(target_os = "linux")]
#[test]
fn a_bake_asks_for_its_memory() {
    let folder = tempfile::tempdir().unwrap();
    let bake = |limit: usize, arguments: &str| {
        let sgdbake = env!("CARGO_BIN_EXE_sgdbake");
        let script = format!(
            "ulimit -v {limit}; exec {sgdbake} bake --material chrome --quantity brdf3d -o out {arguments}"
        );
        Command::new("sh").current_dir(folder.path()).args(["-c", &script]).output().unwrap()
    };
    for arguments in ["--size 512", "--size 512 --dry-run", "--tolerance 1e-4"] {
        let output = bake(1_500_000, &format!("--threads 2 {arguments}"));
        assert_eq!(output.status.code(), Some(1), "{arguments}: {}", stderr(&output));
        let message = stderr(&output);
        assert!(message.contains("MB of memory"), "{arguments}: {message}");
        assert!(message.contains("choose a smaller --size"), "{arguments}: {message}");
    }
    let output = bake(1_500_000, "--threads 2 --size 32");
    assert!(output.status.success(), "{}", stderr(&output));
}
