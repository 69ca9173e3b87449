//! Where results go: data to stdout, notes and progress to stderr, files under their final name
//! only when complete.

use std::fs;
use std::io::{self, BufWriter, IsTerminal as _, Stdout, Write};
use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use tempfile::NamedTempFile;

use crate::cli::failure::Failure;

/// Whether a command writes its files, and over what.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct Writing {
    /// Say what would be written, and write nothing
    #[arg(long)]
    pub dry_run: bool,
    /// Overwrite files that sgdbake did not write
    #[arg(long)]
    pub force: bool,
}

/// The command's stdout, stderr and habits.
#[derive(Debug)]
pub struct Output {
    stdout: BufWriter<Stdout>,
    quiet: bool,
}

impl Output {
    /// Output that shows progress and notes unless `quiet`.
    #[must_use]
    pub fn new(quiet: bool) -> Self {
        Self { stdout: BufWriter::new(io::stdout()), quiet }
    }

    /// One line of data.
    ///
    /// # Errors
    ///
    /// stdout cannot be written.
    pub fn line(&mut self, text: impl std::fmt::Display) -> Result<(), Failure> {
        Ok(writeln!(self.stdout, "{text}")?)
    }

    /// One JSON value on a line.
    ///
    /// # Errors
    ///
    /// stdout cannot be written.
    pub fn json(&mut self, value: &impl Serialize) -> Result<(), Failure> {
        serde_json::to_writer(&mut self.stdout, value).map_err(io::Error::from)?;
        Ok(writeln!(self.stdout)?)
    }

    /// A note to the user on stderr, not part of the result.
    pub fn note(&self, text: impl std::fmt::Display) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }

    /// A progress bar over `steps`, shown only where stderr is a terminal.
    #[must_use]
    pub fn progress(&self, steps: u64, what: &'static str) -> ProgressBar {
        if self.quiet || !io::stderr().is_terminal() {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}");
        let bar = ProgressBar::new(steps).with_message(what);
        style.map_or_else(|_| bar.clone(), |style| bar.clone().with_style(style))
    }

    /// Flushes stdout, so that a full disk or a closed pipe is not missed.
    ///
    /// # Errors
    ///
    /// stdout cannot be written.
    pub fn finish(&mut self) -> Result<(), Failure> {
        Ok(self.stdout.flush()?)
    }
}

/// Writes a file under a temporary name beside it and renames it when complete: readers see the
/// old file or the new one, never half of either.
///
/// # Errors
///
/// The folder or the file cannot be written, or a file that this tool did not write stands there
/// and `force` is not set.
pub fn write_file(path: &Path, bytes: &[u8], force: bool) -> Result<(), Failure> {
    refuse_foreign(path, force)?;
    write_with(path, |file| file.write_all(bytes))
}

/// Lets `write` fill a temporary file beside `path`, and renames it when complete.
///
/// # Errors
///
/// The folder or the file cannot be written.
pub fn write_with(
    path: &Path,
    write: impl FnOnce(&mut fs::File) -> io::Result<()>,
) -> Result<(), Failure> {
    let folder = parent(path);
    let cannot = |error: io::Error| {
        Failure::job(format!("cannot write {}: {error}", path.display()))
            .help("choose another output path, or make this one writable")
    };
    fs::create_dir_all(folder).map_err(cannot)?;
    remove_leftovers(folder);
    let mut file = temporary_in(folder).map_err(cannot)?;
    write(file.as_file_mut()).map_err(cannot)?;
    file.persist(path).map_err(|error| cannot(error.error))?;
    Ok(())
}

/// What the name of a file starts with until it is complete.
const UNFINISHED: &str = ".sgdbake-";

/// A new file in `folder`, locked for as long as this process lives and holds it.
fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    loop {
        let file = tempfile::Builder::new()
            .prefix(UNFINISHED)
            .permissions_of_a_new_file()
            .tempfile_in(folder)?;
        // A file system without locks keeps what killed runs leave, and nothing else changes.
        let _ = file.as_file().lock();
        // Before it was locked another run may have taken it for a leftover.
        if file.path().exists() {
            return Ok(file);
        }
    }
}

/// Removes the unfinished files of runs that were killed: those that nobody holds a lock on.
fn remove_leftovers(folder: &Path) {
    let unfinished = |entry: &fs::DirEntry| {
        entry.file_name().to_string_lossy().starts_with(UNFINISHED)
            && entry.file_type().is_ok_and(|kind| kind.is_file())
    };
    for entry in fs::read_dir(folder).into_iter().flatten().flatten().filter(unfinished) {
        let file = fs::File::open(entry.path());
        if file.is_ok_and(|file| file.try_lock().is_ok()) {
            // Another run may be quicker; whoever cannot remove it leaves it.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Refuses to replace a file that this tool did not write, unless `force`.
///
/// # Errors
///
/// Such a file stands at `path`.
pub fn refuse_foreign(path: &Path, force: bool) -> Result<(), Failure> {
    if path.is_dir() {
        return Err(
            Failure::job(format!("{} is a folder", path.display())).help("name a file to write")
        );
    }
    if force || !path.exists() || written_by_sgdbake(path) {
        return Ok(());
    }
    Err(Failure::job(format!("{} exists and was not written by sgdbake", path.display()))
        .help("choose another output path, or overwrite it with --force"))
}

/// Marks that every kind of file the tool writes carries: a generator or schema, or the glTF
/// extension.
const MARKS: [&[u8]; 3] = [b"sgdbake/", b"sgdbake ", b"SGD_materials_shifted_gamma"];

/// Whether this tool wrote the file at `path`.
pub fn written_by_sgdbake(path: &Path) -> bool {
    fs::read(path)
        .is_ok_and(|bytes| MARKS.iter().any(|mark| memchr::memmem::find(&bytes, mark).is_some()))
}

fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Temporary files are private by default; a finished file is as readable as any other.
trait FilePermissions {
    fn permissions_of_a_new_file(&mut self) -> &mut Self;
}

impl FilePermissions for tempfile::Builder<'_, '_> {
    #[cfg(unix)]
    fn permissions_of_a_new_file(&mut self) -> &mut Self {
        use std::os::unix::fs::PermissionsExt as _;
        self.permissions(fs::Permissions::from_mode(0o666))
    }

    #[cfg(not(unix))]
    fn permissions_of_a_new_file(&mut self) -> &mut Self {
        self
    }
}
