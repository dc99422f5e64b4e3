//! A folder of results, written whole or not at all.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::manifest::MANIFEST_NAME;

/// Files by their path in the folder (with `/`), kept in memory until all of them exist.
#[derive(Debug, Default, Clone)]
pub struct Tree {
    files: BTreeMap<String, Vec<u8>>,
}

/// Why a folder of results could not be written. The earlier result, if there was one, is whole.
#[derive(Debug)]
pub enum WriteError {
    /// The system refused: permissions, a full disk, a path through a file.
    Io {
        /// What was being done.
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

impl fmt::Display for WriteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io { doing, path, source } => {
                write!(
                    f,
                    "{}: cannot {doing} ({source}); allowed: a folder that can be written, with room on the \
                     disk; nothing was changed there",
                    path.display()
                )
            }
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

impl Tree {
    /// Adds a file; its path is relative, with `/` between folders.
    pub fn add(&mut self, path: impl Into<String>, bytes: Vec<u8>) {
        self.files.insert(path.into(), bytes);
    }

    /// Takes a file out; one that is not there is no fault.
    pub fn remove(&mut self, path: &str) {
        self.files.remove(path);
    }

    /// The files in order of their paths.
    pub fn files(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.files.iter().map(|(path, bytes)| (path.as_str(), bytes.as_slice()))
    }

    /// Writes the folder `out` whole: into a temporary neighbour first, then by renaming.
    ///
    /// # Errors
    /// [`WriteError`]; then `out` is as it was.
    pub fn write(&self, out: &Path) -> Result<(), WriteError> {
        let fault = |doing, path: &Path| {
            let path = path.to_path_buf();
            move |source| WriteError::Io { doing, path, source }
        };
        if let Some(foreign) = foreign_entry(out).map_err(fault("look into the folder", out))? {
            return Err(WriteError::NotOurs { path: out.to_path_buf(), foreign });
        }
        let parent = out.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        fs::create_dir_all(parent).map_err(fault("make the folder", parent))?;
        // a neighbour, so that the rename stays on one file system; removed on drop if anything fails
        let staging = tempfile::Builder::new()
            .prefix(".domecast-")
            .tempdir_in(parent)
            .map_err(fault("make a temporary folder", parent))?;
        let fresh = staging.path().join("new");
        for (path, bytes) in self.files() {
            let file = fresh.join(path);
            if let Some(folder) = file.parent() {
                fs::create_dir_all(folder).map_err(fault("make the folder", folder))?;
            }
            fs::write(&file, bytes).map_err(fault("write the file", &out.join(path)))?;
        }
        let earlier = staging.path().join("earlier");
        let had_earlier = out.exists();
        if had_earlier {
            fs::rename(out, &earlier).map_err(fault("move the earlier result aside", out))?;
        }
        if let Err(source) = fs::rename(&fresh, out) {
            if had_earlier && fs::rename(&earlier, out).is_err() {
                // the earlier result must survive even this: leave the temporary folder where it is
                let kept = staging.keep();
                return Err(WriteError::Io {
                    doing: "put the earlier result back; it is kept",
                    path: kept,
                    source,
                });
            }
            return Err(WriteError::Io {
                doing: "put the new result in place",
                path: out.to_path_buf(),
                source,
            });
        }
        Ok(())
    }
}

/// The first entry of an existing folder that its own manifest does not explain; `None` where the
/// folder is missing, empty, or an earlier result with nothing added.
fn foreign_entry(out: &Path) -> io::Result<Option<String>> {
    match fs::metadata(out) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
        Ok(about) if !about.is_dir() => {
            return Err(io::Error::new(io::ErrorKind::NotADirectory, "this is a file, not a folder"));
        }
        Ok(_) => {}
    }
    let listed = listed_files(&out.join(MANIFEST_NAME));
    let mut entries = list_files(out)?;
    entries.retain(|path| path != MANIFEST_NAME && !listed.contains(path));
    // a manifest alone, or one that cannot be read, explains nothing
    if listed.is_empty() && entries.is_empty() && out.join(MANIFEST_NAME).exists() {
        entries.push(MANIFEST_NAME.to_owned());
    }
    Ok(entries.into_iter().next())
}

fn listed_files(manifest: &Path) -> Vec<String> {
    let text = fs::read_to_string(manifest).unwrap_or_default();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    let files = value.get("files").and_then(serde_json::Value::as_array).cloned().unwrap_or_default();
    files.iter().filter_map(|file| Some(file.get("path")?.as_str()?.to_owned())).collect()
}

/// All files below `folder`, as sorted paths with `/`. Links are listed, not followed.
///
/// # Errors
/// What the system says when the folder cannot be read.
pub fn list_files(folder: &Path) -> io::Result<Vec<String>> {
    let mut found = Vec::new();
    let mut open = vec![(folder.to_path_buf(), String::new())];
    while let Some((path, prefix)) = open.pop() {
        for entry in fs::read_dir(&path)? {
            let entry = entry?;
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            if entry.file_type()?.is_dir() {
                open.push((entry.path(), format!("{name}/")));
            } else {
                found.push(name);
            }
        }
    }
    found.sort();
    Ok(found)
}
