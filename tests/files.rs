//! The disk after a bake that was killed, met a full disk or was not allowed to write: all files of
//! the set, or none.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Instant;

const BINARY: &str = env!("CARGO_BIN_EXE_sgdbake");

/// Several files, the largest of some megabytes.
const BAKE: [&str; 9] = [
    "--quiet",
    "bake",
    "--material=gold-paint",
    "--material=chrome",
    "--quantity=ndf,masking,fresnel,brdf3d",
    "--size=96",
    "--depth=float",
    "--format=ktx2",
    "--output",
];

fn bake(folder: &Path) -> Command {
    let mut command = Command::new(BINARY);
    command.args(BAKE).arg(folder).stdout(Stdio::null());
    command
}

/// Every file of a folder by its name.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .map(|entry| {
            (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap_or_default())
        })
        .collect()
}

fn is_unfinished(name: &str) -> bool {
    name.starts_with(".sgdbake-")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_killed_run_leaves_no_half_file_and_the_next_one_cleans_up() {
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole");
    let start = Instant::now();
    assert!(bake(&whole).status().unwrap().success());
    let (duration, whole) = (start.elapsed(), files(&whole));
    let (mut killed, mut unfinished) = (0, 0);
    for run in 0..8 {
        let out = folder.path().join(run.to_string());
        let mut child = bake(&out).spawn().unwrap();
        // Most kills fall into the second half, where files are written.
        std::thread::sleep(duration.mul_f64(0.4 + 0.08 * f64::from(run)));
        child.kill().unwrap();
        killed += i32::from(!child.wait().unwrap().success());
        let left = files(&out);
        unfinished += left.keys().filter(|name| is_unfinished(name)).count();
        for (name, bytes) in left.iter().filter(|(name, _)| !is_unfinished(name)) {
            assert!(whole.get(name) == Some(bytes), "{name} is not the whole file");
        }
        assert!(bake(&out).status().unwrap().success());
        assert!(files(&out) == whole, "the next run writes what the killed one should have");
    }
    println!("{killed} runs killed, {unfinished} unfinished files left and removed");
    assert!(killed > 0, "every run was over before it was killed");
}

#[test]
fn only_what_nobody_writes_any_more_is_removed() {
    let folder = tempfile::tempdir().unwrap();
    let [dead, alive, foreign] =
        [".sgdbake-dead", ".sgdbake-alive", ".other"].map(|name| folder.path().join(name));
    for path in [&dead, &alive, &foreign] {
        fs::write(path, "half").unwrap();
    }
    let held = File::open(&alive).unwrap();
    held.lock().unwrap();
    assert!(bake(folder.path()).status().unwrap().success());
    assert!(!dead.exists() && alive.exists() && foreign.exists());
    drop(held);
    assert!(bake(folder.path()).status().unwrap().success());
    assert!(!alive.exists());
}

#[test]
fn a_file_size_limit_is_a_failed_write() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("lut");
    // Blocks of 512 bytes: the factors would fit, the 3D tables do not.
    let limited = format!("ulimit -f 100; exec \"{BINARY}\" \"$@\"");
    let output =
        Command::new("sh").args(["-c", &limited, "sh"]).args(BAKE).arg(&out).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("brdf3d-0.ktx2: File too large"), "{}", stderr(&output));
    let left = files(&out);
    assert!(left.is_empty(), "a set of files is written whole or not at all: {:?}", left.keys());
}

/// A bake in a mount namespace of its own, into a file system that `mount` makes at `$1`; what
/// remains there stands in the last lines of the output.
fn bake_into(mount: &str, folder: &Path) -> Option<Output> {
    let script = format!("{mount} || exit 99\nshift\n\"$@\"\ncode=$?\nls -A \"$0\"\nexit $code");
    let mut command = Command::new("unshare");
    command.args(["--mount", "sh", "-c", &script]).arg(folder).arg(folder);
    let output = command.arg(BINARY).args(BAKE).arg(folder).output().ok()?;
    let mounted = output.status.code() != Some(99) && !stderr(&output).contains("unshare");
    if !mounted {
        eprintln!("skipped: no file system can be mounted here: {}", stderr(&output));
    }
    mounted.then_some(output)
}

#[test]
fn a_full_disk_is_reported_and_left_tidy() {
    let folder = tempfile::tempdir().unwrap();
    let mount = "mount -t tmpfs -o size=64k none \"$1\"";
    let Some(output) = bake_into(mount, folder.path()) else { return };
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let message = stderr(&output);
    assert!(message.contains("brdf3d-0.ktx2: No space left on device"), "{message}");
    let left = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(left, "", "a set of files is written whole or not at all");
}

#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let mount = "mount -t tmpfs -o ro none \"$1\"";
    if let Some(output) = bake_into(mount, folder.path()) {
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        assert!(stderr(&output).contains("Read-only file system"), "{}", stderr(&output));
        assert!(output.stdout.is_empty(), "nothing is there");
    }
    let file = folder.path().join("file");
    fs::write(&file, "mine").unwrap();
    let below = file.join("lut");
    let output = bake(&below).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains(&format!("cannot write {}", below.display())));
    assert_eq!(fs::read(&file).unwrap(), b"mine");
}

#[test]
fn a_report_that_cannot_be_printed_is_a_failed_job() {
    let full = File::options().write(true).open("/dev/full");
    let Ok(full) = full else { return eprintln!("skipped: no /dev/full") };
    let folder = tempfile::tempdir().unwrap();
    let output = bake(folder.path()).stdout(full).stderr(Stdio::piped()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("No space left"), "{}", stderr(&output));
}
