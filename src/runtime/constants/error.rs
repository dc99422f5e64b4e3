//! Why a file is no constants file.

use std::path::{Path, PathBuf};

/// A file that cannot be read as constants: which, and what is wrong with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConstantsError {
    /// The file that was read; `None` for a text in memory.
    pub file: Option<PathBuf>,
    /// What is wrong, in words.
    pub problem: String,
}

impl ConstantsError {
    /// The same fault, of this file.
    #[must_use]
    pub fn in_file(mut self, path: &Path) -> Self {
        self.file = Some(path.to_owned());
        self
    }
}

impl std::fmt::Display for ConstantsError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.file {
            Some(file) => write!(f, "{}: {}", file.display(), self.problem),
            None => self.problem.fmt(f),
        }
    }
}

impl std::error::Error for ConstantsError {}
