//! Why a sequence could not be made.

use std::fmt;
use std::io;
use std::path::Path;

use domecast_files::WriteError;

use crate::SimError;

/// Why a sequence could not be made. The folder is then as it was.
#[derive(Debug)]
pub enum RunError {
    /// The scene is at fault.
    Scene(SimError),
    /// The files could not be written.
    Write(WriteError),
}

impl From<SimError> for RunError {
    fn from(error: SimError) -> Self {
        Self::Scene(error)
    }
}

impl From<WriteError> for RunError {
    fn from(error: WriteError) -> Self {
        Self::Write(error)
    }
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scene(error) => error.fmt(f),
            Self::Write(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for RunError {}

/// The error of something that was being done at a place.
pub(super) fn fault(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> RunError {
    let error = WriteError::io(doing, path);
    move |source| RunError::Write(error(source))
}
