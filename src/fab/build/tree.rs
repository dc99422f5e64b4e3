//! The files of a result, kept in memory until all of them exist.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use domecast_files::{OutputRules, StagedFolder, WriteError};

/// Files by their path in the folder (with `/`), kept in memory until all of them exist.
#[derive(Debug, Default, Clone)]
pub struct Tree {
    files: BTreeMap<String, Vec<u8>>,
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

    /// Writes the folder `out`, whole or not at all, in the place of nothing or of an unchanged earlier result. One that
    /// was changed meanwhile is kept: the path is that of the copy.
    ///
    /// # Errors
    /// [`WriteError`]; then `out` is as it was.
    pub fn write(&self, out: &Path) -> Result<Option<PathBuf>, WriteError> {
        let staged = StagedFolder::new(out, "build", &OutputRules::default())?;
        self.fill(&staged)?;
        staged.commit()
    }

    /// Writes the files into a folder that was staged before they were made.
    ///
    /// # Errors
    /// [`WriteError`]; then the folder's place is as it was.
    pub fn fill(&self, staged: &StagedFolder) -> Result<(), WriteError> {
        self.files().try_for_each(|(path, bytes)| staged.write(path, bytes))
    }
}
