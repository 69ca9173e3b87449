//! Where results go: data to stdout, notes and progress to stderr, files under their final name
//! only when complete.

use std::collections::{BTreeSet, HashSet};
use std::fs;
use std::io::{self, BufWriter, IsTerminal as _, Stdout, Write};
use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use tempfile::NamedTempFile;

use crate::cli::failure::Failure;
use crate::cli::ownership::is_ours;
use crate::cli::terminal::{name, printable, printable_json};

/// What a command may write: nothing, new files, or over existing ones.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct Writing {
    /// Say what would be written, and write nothing
    #[arg(long)]
    pub dry_run: bool,
    /// Overwrite files that sgdbake did not write
    #[arg(long)]
    pub force: bool,
}

/// The command's stdout and stderr.
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

    /// One line of data; control characters but line breaks and tabs are shown as escapes.
    ///
    /// # Errors
    ///
    /// stdout cannot be written.
    pub fn line(&mut self, text: impl std::fmt::Display) -> Result<(), Failure> {
        Ok(writeln!(self.stdout, "{}", printable(&text.to_string()))?)
    }

    /// One line that names a file which was written, or would be.
    ///
    /// # Errors
    ///
    /// stdout cannot be written.
    pub fn written(&mut self, path: &Path, writing: Writing) -> Result<(), Failure> {
        let verb = if writing.dry_run { "would write" } else { "wrote" };
        self.line(format_args!("{verb} {}", name(&path.display().to_string())))
    }

    /// One JSON value on a line.
    ///
    /// # Errors
    ///
    /// stdout cannot be written.
    pub fn json(&mut self, value: &impl Serialize) -> Result<(), Failure> {
        let json = serde_json::to_string(value).map_err(Failure::job)?;
        Ok(writeln!(self.stdout, "{}", printable_json(&json))?)
    }

    /// A note to the user on stderr, not part of the result.
    pub fn note(&self, text: impl std::fmt::Display) {
        if !self.quiet {
            eprintln!("{}", printable(&text.to_string()));
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
        // The template is a constant; were it refused, the bar would keep its default look.
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

/// A file to write, and what fills it.
pub struct NewFile<'a> {
    /// Where.
    pub path: PathBuf,
    write: Fill<'a>,
}

/// Fills a file with its content.
type Fill<'a> = Box<dyn Fn(&mut fs::File) -> io::Result<()> + 'a>;

impl<'a> NewFile<'a> {
    /// A file that `write` fills.
    pub fn new(
        path: impl Into<PathBuf>,
        write: impl Fn(&mut fs::File) -> io::Result<()> + 'a,
    ) -> Self {
        Self { path: path.into(), write: Box::new(write) }
    }

    /// A file of these bytes.
    pub fn of_bytes(path: impl Into<PathBuf>, bytes: impl AsRef<[u8]> + 'a) -> Self {
        Self::new(path, move |file| file.write_all(bytes.as_ref()))
    }
}

impl Writing {
    /// Refuses a set of output paths, before any work, where one of them is in the way: a folder,
    /// something that is not a regular file, one of `inputs`, two files of one name, or a file that
    /// sgdbake did not write (unless `--force`).
    ///
    /// # Errors
    ///
    /// The first such path.
    pub fn check<'p>(
        &self,
        paths: impl IntoIterator<Item = &'p Path>,
        inputs: &[&Path],
    ) -> Result<(), Failure> {
        let mut taken = HashSet::new();
        for path in paths {
            if !taken.insert(path) {
                return Err(Failure::usage(format!("two files would be named {}", path.display()))
                    .help("give the materials different names"));
            }
            // Whatever --force says: an input is never overwritten.
            if inputs.iter().any(|input| same_file(input, path)) {
                return Err(Failure::usage(format!(
                    "{} is an input of this command and would be overwritten",
                    path.display()
                ))
                .help("choose another output path"));
            }
            self.check_existing(path)?;
        }
        Ok(())
    }

    fn check_existing(&self, path: &Path) -> Result<(), Failure> {
        // A path that cannot be looked at is left to the write, which says what is wrong.
        let Ok(existing) = fs::metadata(path) else { return Ok(()) };
        if existing.is_dir() {
            return Err(Failure::job(format!("{} is a folder", path.display()))
                .help("name a file to write"));
        }
        if !existing.is_file() {
            return Err(Failure::job(format!("{} is not a regular file", path.display()))
                .help("name a regular file to write"));
        }
        if self.force || is_ours(path) {
            return Ok(());
        }
        Err(Failure::job(format!("{} exists and was not written by sgdbake", path.display()))
            .help("choose another output path, or overwrite it with --force"))
    }

    /// Writes a set of files whole or not at all: each under a temporary name in its folder, and
    /// when all are complete each under its own, in the order given. Until then nobody else writes
    /// into the folders. With `--dry-run` it writes nothing.
    ///
    /// # Errors
    ///
    /// As [`Writing::check`]; a folder or file that cannot be written.
    pub fn write_all(&self, files: &[NewFile<'_>], inputs: &[&Path]) -> Result<(), Failure> {
        let paths = files.iter().map(|file| file.path.as_path());
        // Again: a file may have come since the command checked its paths before the work.
        self.check(paths.clone(), inputs)?;
        if self.dry_run {
            return Ok(());
        }
        // Sorted, so that two runs that share folders lock them in the same order.
        let folders: BTreeSet<&Path> = paths.map(parent).collect();
        let _locks: Vec<Option<fs::File>> =
            folders.into_iter().map(prepared).collect::<Result<_, _>>()?;
        let complete: Vec<NamedTempFile> = files.iter().map(complete).collect::<Result<_, _>>()?;
        // A rename within a folder: a reader finds the old file or the new one, never a part of it.
        for (file, complete) in files.iter().zip(complete) {
            complete.persist(&file.path).map_err(|error| cannot_write(&file.path, &error.error))?;
        }
        Ok(())
    }
}

/// The file under a temporary name, complete.
fn complete(file: &NewFile<'_>) -> Result<NamedTempFile, Failure> {
    let mut temporary =
        temporary_in(parent(&file.path)).map_err(|error| cannot_write(&file.path, &error))?;
    (file.write)(temporary.as_file_mut()).map_err(|error| cannot_write(&file.path, &error))?;
    Ok(temporary)
}

/// Makes a folder, locks it and clears it of what killed runs left. Where a folder cannot be
/// locked, as on Windows, two runs may write into it at a time.
fn prepared(folder: &Path) -> Result<Option<fs::File>, Failure> {
    fs::create_dir_all(folder).map_err(|error| cannot_write(folder, &error))?;
    let lock = fs::File::open(folder).ok().filter(|folder| folder.lock().is_ok());
    // Under the lock, so that no other run is about to create and lock a file here.
    remove_leftovers(folder);
    Ok(lock)
}

fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    Failure::job(format!("cannot write {}: {error}", path.display()))
        .help("choose another output path, or make this one writable")
}

/// Returns whether two paths name one existing file.
fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Prefix of a file's name until the file is complete.
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

/// Returns whether an entry of a folder is a file that a run writes under a temporary name.
fn is_unfinished(entry: &fs::DirEntry) -> bool {
    // `file_type` does not follow links, so a link that leads elsewhere is never opened.
    entry.file_name().to_string_lossy().starts_with(UNFINISHED)
        && entry.file_type().is_ok_and(|kind| kind.is_file())
}

/// Removes the unfinished files of runs that were killed: those that nobody holds a lock on.
fn remove_leftovers(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten().filter(is_unfinished) {
        let file = fs::File::open(entry.path());
        if file.is_ok_and(|file| file.try_lock().is_ok()) {
            // Another run may be quicker; whoever cannot remove it leaves it.
            let _ = fs::remove_file(entry.path());
        }
    }
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
        // The umask of the process narrows this, as for any new file.
        self.permissions(fs::Permissions::from_mode(0o666))
    }

    #[cfg(not(unix))]
    fn permissions_of_a_new_file(&mut self) -> &mut Self {
        self
    }
}
