//! Results of commands: files and folders that are written whole or not at all, and never over anyone's work.
//!
//! A [`StagedFolder`] is made before the work begins. It refuses a place that holds anything but an earlier result as
//! that was written, an input, a mount point, a link that leads elsewhere; then it is filled in a hidden folder beside
//! its place and changes places with what stood there, in one step where the system has one. A [`StagedFile`] does the
//! same for one file. What a stopped run left is ended by [`recover`]. Arrays and surfaces are put into the formats that
//! other programs read by [`npy_f32`], [`npy_u8`], [`png_u16`] and [`ply`].
//!
//! ```
//! use domecast_files::{OutputRules, StagedFile, StagedFolder, list_files};
//!
//! let place = tempfile::tempdir()?;
//! let out = place.path().join("result");
//! let rules = OutputRules::default();
//! let staged = StagedFolder::new(&out, "build", &rules)?;
//! staged.write("plots/a.svg", b"<svg/>")?;
//! assert!(!out.exists());
//! staged.commit()?;
//! assert_eq!(list_files(&out)?, ["plots/a.svg"]);
//!
//! // edited by its user: refused, with the file's name, until `force` keeps it under another name
//! std::fs::write(out.join("plots/a.svg"), "<svg>mine</svg>")?;
//! let refused = StagedFolder::new(&out, "build", &rules).unwrap_err();
//! assert!(refused.to_string().contains("plots/a.svg"));
//! let kept = StagedFolder::new(&out, "build", &OutputRules { force: true, ..rules })?.commit()?;
//! assert_eq!(std::fs::read_to_string(kept.ok_or("a copy")?.join("plots/a.svg"))?, "<svg>mine</svg>");
//!
//! let mut table = StagedFile::new(&place.path().join("table.csv"), "track", &rules)?;
//! table.write(b"x,y\n")?;
//! table.commit()?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod arrays;
mod cache;
mod error;
mod listing;
mod marker;
mod place;
mod platform;
mod recovery;
mod staging;
#[cfg(test)]
mod tests;

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

pub use arrays::{npy_f32, npy_u8, ply, png_u16};
pub use cache::Cache;
pub use error::{ForeignEntries, WriteError};
pub use marker::{MARKER_NAME, list_files, marked_files};
pub use place::OutputRules;
use place::{Kind, Place};
pub use recovery::{StopWish, recover, tidy_on_signals};
use staging::Staging;

fn stage(out: &Path, kind: Kind, command: &str, rules: &OutputRules<'_>) -> Result<Staging, WriteError> {
    let place = Place::new(out, kind, command, rules)?;
    Staging::new(&place.base, &place.rest).map_err(WriteError::io("make a temporary folder", &place.base))
}

/// A folder that is filled beside its place. Dropped before [`StagedFolder::commit`], it leaves nothing behind.
#[derive(Debug)]
pub struct StagedFolder {
    staging: Staging,
    fresh: PathBuf,
    out: PathBuf,
    command: &'static str,
}

impl StagedFolder {
    /// Stages the folder `out` for the result of a command, after all that could refuse it was looked at. An unchanged
    /// result is replaced by one of the same command alone.
    ///
    /// # Errors
    /// [`WriteError`]: `out` is a file, holds what no earlier result put there, holds an input, cannot be replaced, or
    /// the system refuses.
    pub fn new(out: &Path, command: &'static str, rules: &OutputRules<'_>) -> Result<Self, WriteError> {
        let staging = stage(out, Kind::Folder, command, rules)?;
        let fresh = staging.draft();
        fs::create_dir(&fresh).map_err(WriteError::io("make the folder", &fresh))?;
        Ok(Self { staging, fresh, out: out.to_path_buf(), command })
    }

    /// Where the folder's files are written until it is committed.
    pub fn path(&self) -> &Path {
        &self.fresh
    }

    /// Writes one file, and the folders that lead to it; `path` is relative, with `/`.
    ///
    /// # Errors
    /// [`WriteError::Io`] with the file's final place.
    pub fn write(&self, path: &str, bytes: &[u8]) -> Result<(), WriteError> {
        let made = self.make_folders(Path::new(path));
        let written = made.and_then(|()| fs::write(self.fresh.join(path), bytes));
        written.map_err(WriteError::io("write the file", &self.out.join(path)))
    }

    /// Makes the folders that lead to a file; not the folder itself, which a signal may have removed.
    fn make_folders(&self, path: &Path) -> io::Result<()> {
        let folders: Vec<&Path> =
            path.ancestors().skip(1).filter(|folder| !folder.as_os_str().is_empty()).collect();
        for folder in folders.into_iter().rev() {
            match fs::create_dir(self.fresh.join(folder)) {
                Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
                _ => {}
            }
        }
        Ok(())
    }

    /// Marks the folder and puts it in its place, in one step where the system has one. Something that stood there and
    /// was not an unchanged earlier result, by `force` or because it was changed meanwhile, is kept: the path is that of
    /// the copy.
    ///
    /// # Errors
    /// [`WriteError::Io`]; then the place is as it was, or the error's path says what could not be removed.
    pub fn commit(self) -> Result<Option<PathBuf>, WriteError> {
        self.staging.commit(&self.out, self.command)
    }
}

/// A file that is written beside its place. Dropped before [`StagedFile::commit`], it leaves nothing behind.
#[derive(Debug)]
pub struct StagedFile {
    // before the staging folder, so that it is closed when that goes
    file: BufWriter<File>,
    staging: Staging,
    path: PathBuf,
    command: &'static str,
}

impl StagedFile {
    /// Stages the file `path` for the result of a command, after all that could refuse it was looked at.
    ///
    /// # Errors
    /// [`WriteError`]: `path` is a folder, a file that no earlier result of ours is, an input, a device, or the system
    /// refuses.
    pub fn new(path: &Path, command: &'static str, rules: &OutputRules<'_>) -> Result<Self, WriteError> {
        let staging = stage(path, Kind::File, command, rules)?;
        let file = File::create_new(staging.draft()).map_err(WriteError::io("write the file", path))?;
        Ok(Self { file: BufWriter::new(file), staging, path: path.to_path_buf(), command })
    }

    /// Adds bytes at the end.
    ///
    /// # Errors
    /// [`WriteError::Io`].
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), WriteError> {
        self.file.write_all(bytes).map_err(WriteError::io("write the file", &self.path))
    }

    /// Puts the file in its place, as [`StagedFolder::commit`] does.
    ///
    /// # Errors
    /// [`WriteError::Io`]; then the place is as it was, or the error's path says what could not be removed.
    pub fn commit(self) -> Result<Option<PathBuf>, WriteError> {
        let Self { mut file, staging, path, command } = self;
        file.flush().map_err(WriteError::io("write the file", &path))?;
        drop(file);
        staging.commit(&path, command)
    }
}

/// A file that grows in its place, for recordings that must be readable however the program ends. It refuses and keeps what
/// a [`StagedFile`] does; once [`GrowingFile::end`] was called it is a result like others. One that was not ended is
/// someone's work: only `force` replaces it, and keeps it.
#[derive(Debug)]
pub struct GrowingFile {
    file: File,
    path: PathBuf,
    command: &'static str,
}

impl GrowingFile {
    /// Begins the file `path` as an empty one; also says where the copy of what stood there is, where one is kept.
    ///
    /// # Errors
    /// Those of [`StagedFile::new`].
    pub fn new(
        path: &Path,
        command: &'static str,
        rules: &OutputRules<'_>,
    ) -> Result<(Self, Option<PathBuf>), WriteError> {
        let kept = StagedFile::new(path, command, rules)?.commit()?;
        let opened = File::options().append(true).open(path);
        let file = opened.map_err(WriteError::io("write the file", path))?;
        Ok((Self { file, path: path.to_path_buf(), command }, kept))
    }

    /// Has all that was written on the disk, and marks the file as the command's result.
    ///
    /// # Errors
    /// [`WriteError::Io`]; what was written is there all the same.
    pub fn end(self) -> Result<(), WriteError> {
        self.file.sync_all().map_err(WriteError::io("write the file", &self.path))?;
        drop(self.file);
        marker::mark(&self.path, self.command).map_err(WriteError::io("write the file", &self.path))
    }
}

impl Write for GrowingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Replaces a small file by another in one step: for an index that is ours by its content, which the caller has looked at, and that
/// grows with what lies beside it. Whoever reads it meanwhile sees the one or the other, whole.
///
/// # Errors
/// [`WriteError::Io`]; then the file is as it was.
pub fn replace_file(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let write = || -> io::Result<()> {
        fs::create_dir_all(folder)?;
        // one process writes one index at a time; what a stopped one left has its number and is overwritten or harmless
        let draft = folder.join(format!(".index-{}", std::process::id()));
        let mut file = File::create(&draft)?;
        let written =
            file.write_all(bytes).and_then(|()| file.sync_all()).and_then(|()| fs::rename(&draft, path));
        written.inspect_err(|_| drop(fs::remove_file(&draft)))
    };
    write().map_err(WriteError::io("write the file", path))
}
