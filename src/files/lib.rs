//! Files and folders of results, written whole or not at all.
//!
//! A [`StagedFolder`] is filled beside its final place and moved there by one rename; an earlier result makes room only
//! then, and comes back if the rename fails. A [`StagedFile`] does the same for one file.
//!
//! ```
//! use domecast_files::{StagedFolder, list_files, write_file};
//!
//! let place = tempfile::tempdir()?;
//! let out = place.path().join("result");
//! let staged = StagedFolder::new(&out, |entries| entries.first().cloned())?;
//! staged.write("plots/a.svg", b"<svg/>")?;
//! assert!(!out.exists());
//! staged.commit()?;
//! assert_eq!(list_files(&out)?, ["plots/a.svg"]);
//! write_file(&place.path().join("table.csv"), b"x,y\n")?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::fmt;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile, TempDir};

/// Why a result could not be written. The earlier result, if there was one, is whole.
#[derive(Debug)]
pub enum WriteError {
    /// The system refused: permissions, a full disk, a path through a file.
    Io {
        /// What was being done, as an infinitive: "write the file".
        doing: &'static str,
        /// Where.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// The folder exists and does not hold an earlier result, so replacing it would destroy other work.
    NotOurs {
        /// The folder.
        path: PathBuf,
        /// The entry in it that no earlier result of ours explains.
        foreign: String,
    },
}

impl WriteError {
    /// Makes an [`WriteError::Io`] of the system's answer; for `map_err`.
    pub fn io(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self + use<> {
        let path = path.to_path_buf();
        move |source| Self::Io { doing, path, source }
    }
}

impl fmt::Display for WriteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io { doing, path, source } => write!(
                f,
                "{}: cannot {doing} ({source}); allowed: a place that can be written, with room on the disk; \
                 nothing was changed there",
                path.display()
            ),
            Self::NotOurs { path, foreign } => write!(
                f,
                "{}: holds \"{foreign}\", which no earlier result put there; allowed: a new or empty folder, or \
                 an earlier result with nothing added; move it away, or name another folder with --out",
                path.display()
            ),
        }
    }
}

impl std::error::Error for WriteError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            Self::NotOurs { .. } => None,
        }
    }
}

/// The folder that holds `path`.
fn parent_of(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A folder that is filled beside its final place. Dropped before [`StagedFolder::commit`], it leaves nothing behind.
#[derive(Debug)]
pub struct StagedFolder {
    staging: TempDir,
    fresh: PathBuf,
    out: PathBuf,
}

impl StagedFolder {
    /// Stages the folder `out`. If it exists, `foreign` gets its entries (sorted paths with `/`; an empty folder ends
    /// in `/`) and names the first one that no earlier result put there.
    ///
    /// # Errors
    /// [`WriteError`]: `out` is a file, holds a foreign entry, or the system refuses.
    pub fn new(out: &Path, foreign: impl FnOnce(&[String]) -> Option<String>) -> Result<Self, WriteError> {
        match fs::metadata(out) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(WriteError::io("look into the folder", out)(error)),
            Ok(about) if !about.is_dir() => {
                let error = io::Error::new(io::ErrorKind::NotADirectory, "this is a file, not a folder");
                return Err(WriteError::io("look into the folder", out)(error));
            }
            Ok(_) => {
                let entries = entries_of(out).map_err(WriteError::io("look into the folder", out))?;
                if let Some(foreign) = foreign(&entries) {
                    return Err(WriteError::NotOurs { path: out.to_path_buf(), foreign });
                }
            }
        }
        let parent = parent_of(out);
        fs::create_dir_all(parent).map_err(WriteError::io("make the folder", parent))?;
        // a neighbour, so that the rename stays on one file system; removed on drop if anything fails
        let staging = Builder::new()
            .prefix(".domecast-")
            .tempdir_in(parent)
            .map_err(WriteError::io("make a temporary folder", parent))?;
        let fresh = staging.path().join("new");
        fs::create_dir(&fresh).map_err(WriteError::io("make the folder", &fresh))?;
        Ok(Self { staging, fresh, out: out.to_path_buf() })
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
        let file = self.fresh.join(path);
        let written = fs::create_dir_all(parent_of(&file)).and_then(|()| fs::write(&file, bytes));
        written.map_err(WriteError::io("write the file", &self.out.join(path)))
    }

    /// Moves the folder to its place. An earlier one makes room, and comes back if the move fails.
    ///
    /// # Errors
    /// [`WriteError::Io`]; then the place is as it was, or the error's path says where the earlier result is kept.
    pub fn commit(self) -> Result<(), WriteError> {
        let earlier = self.staging.path().join("earlier");
        let had_earlier = self.out.exists();
        if had_earlier {
            let moved = fs::rename(&self.out, &earlier);
            moved.map_err(WriteError::io("move the earlier result aside", &self.out))?;
        }
        let Err(source) = fs::rename(&self.fresh, &self.out) else { return Ok(()) };
        if had_earlier && fs::rename(&earlier, &self.out).is_err() {
            // the earlier result must survive even this: leave the temporary folder where it is
            let kept = self.staging.keep();
            return Err(WriteError::io("put the earlier result back; it is kept", &kept)(source));
        }
        Err(WriteError::io("put the new result in place", &self.out)(source))
    }
}

/// A file that is written beside its final place. Dropped before [`StagedFile::commit`], it leaves nothing behind.
#[derive(Debug)]
pub struct StagedFile {
    file: BufWriter<NamedTempFile>,
    path: PathBuf,
}

impl StagedFile {
    /// Stages the file `path`, in a folder that exists.
    ///
    /// # Errors
    /// [`WriteError::Io`].
    pub fn new(path: &Path) -> Result<Self, WriteError> {
        let file = NamedTempFile::new_in(parent_of(path)).map_err(WriteError::io("write the file", path))?;
        Ok(Self { file: BufWriter::new(file), path: path.to_path_buf() })
    }

    /// Adds bytes at the end.
    ///
    /// # Errors
    /// [`WriteError::Io`].
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), WriteError> {
        self.file.write_all(bytes).map_err(WriteError::io("write the file", &self.path))
    }

    /// Moves the file to its place; one that was there is replaced.
    ///
    /// # Errors
    /// [`WriteError::Io`]; then the place is as it was.
    pub fn commit(self) -> Result<(), WriteError> {
        let file = self.file.into_inner().map_err(io::IntoInnerError::into_error);
        let placed = file.and_then(|file| file.persist(&self.path).map_err(|error| error.error));
        placed.map(drop).map_err(WriteError::io("write the file", &self.path))
    }
}

/// Writes a file whole or not at all, in a folder that exists.
///
/// # Errors
/// [`WriteError::Io`]; then the place is as it was.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let mut file = StagedFile::new(path)?;
    file.write(bytes)?;
    file.commit()
}

/// All files below `folder`, as sorted paths with `/`. Links are listed, not followed.
///
/// # Errors
/// What the system says when the folder cannot be read.
pub fn list_files(folder: &Path) -> io::Result<Vec<String>> {
    let mut files = entries_of(folder)?;
    files.retain(|path| !path.ends_with('/'));
    Ok(files)
}

/// [`list_files`], with the empty folders, which end in `/`.
fn entries_of(folder: &Path) -> io::Result<Vec<String>> {
    let mut found = Vec::new();
    let mut open = vec![(folder.to_path_buf(), String::new())];
    while let Some((path, prefix)) = open.pop() {
        let mut empty = true;
        for entry in fs::read_dir(&path)? {
            let entry = entry?;
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            empty = false;
            if entry.file_type()?.is_dir() {
                open.push((entry.path(), format!("{name}/")));
            } else {
                found.push(name);
            }
        }
        if empty && !prefix.is_empty() {
            found.push(prefix);
        }
    }
    found.sort();
    Ok(found)
}
