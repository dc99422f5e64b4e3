//! The files of a result, kept in memory until all of them exist.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use super::manifest::MANIFEST_NAME;
use domecast_files::{StagedFolder, WriteError};

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

    /// Writes the folder `out`, whole or not at all.
    ///
    /// # Errors
    /// [`WriteError`]; then `out` is as it was.
    pub fn write(&self, out: &Path) -> Result<(), WriteError> {
        let staged = StagedFolder::new(out, |entries| foreign_entry(out, entries))?;
        for (path, bytes) in self.files() {
            staged.write(path, bytes)?;
        }
        staged.commit()
    }
}

/// The first entry of an existing folder that its own manifest does not explain; `None` where the folder is empty, or an
/// earlier result with nothing added.
fn foreign_entry(out: &Path, entries: &[String]) -> Option<String> {
    let listed = listed_files(&out.join(MANIFEST_NAME));
    let explained = |path: &String| path == MANIFEST_NAME || listed.contains(path);
    // a manifest alone, or one that cannot be read, explains nothing
    let lone_manifest = || entries.first().filter(|_| listed.is_empty());
    entries.iter().find(|path| !explained(path)).or_else(lone_manifest).cloned()
}

fn listed_files(manifest: &Path) -> Vec<String> {
    let text = fs::read_to_string(manifest).unwrap_or_default();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    let files = value.get("files").and_then(serde_json::Value::as_array).cloned().unwrap_or_default();
    files.iter().filter_map(|file| Some(file.get("path")?.as_str()?.to_owned())).collect()
}
