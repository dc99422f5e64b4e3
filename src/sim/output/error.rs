//! Why a sequence could not be made.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use crate::SimError;

/// Why a sequence could not be made. The folder is then as it was.
#[derive(Debug)]
pub enum RunError {
    /// The scene is at fault.
    Scene(SimError),
    /// The system refused.
    Io {
        /// What was being done.
        doing: &'static str,
        /// Where.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// The folder holds something that no earlier sequence put there.
    NotOurs {
        /// The folder.
        path: PathBuf,
        /// What it holds.
        foreign: String,
    },
}

impl From<SimError> for RunError {
    fn from(error: SimError) -> Self {
        Self::Scene(error)
    }
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scene(error) => error.fmt(f),
            Self::Io { doing, path, source } => write!(f, "{}: cannot {doing} ({source})", path.display()),
            Self::NotOurs { path, foreign } => {
                write!(f, "{}: holds \"{foreign}\", which no earlier sequence put there", path.display())
            }
        }
    }
}

impl std::error::Error for RunError {}

/// The error of something that was being done at a place.
pub(super) fn fault(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> RunError {
    let path = path.to_path_buf();
    move |source| RunError::Io { doing, path, source }
}
