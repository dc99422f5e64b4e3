//! Why a result could not be written.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Names in a message at most; the others are counted.
const MAX_NAMES: usize = 6;

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
    /// What stands there is not an earlier result as it was written, so replacing it would destroy other work.
    NotOurs {
        /// The folder or file.
        path: PathBuf,
        /// What of it differs from an earlier result.
        found: ForeignEntries,
    },
    /// The place cannot take a result, whatever stands there.
    Place {
        /// The place.
        path: PathBuf,
        /// Why not.
        problem: String,
        /// What would do.
        allowed: &'static str,
    },
}

/// What of a folder or file is not as an earlier result left it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ForeignEntries {
    /// Files of an earlier result that were changed since, by their path in the folder; empty for a single file.
    pub changed: Vec<String>,
    /// What no earlier result put there; an empty folder ends in `/`.
    pub added: Vec<String>,
    /// Whether the marker of an earlier result is there and whole.
    pub marked: bool,
}

impl ForeignEntries {
    /// Whether everything is as an earlier result left it.
    pub fn is_empty(&self) -> bool {
        self.changed.is_empty() && self.added.is_empty()
    }
}

impl WriteError {
    /// Makes an [`WriteError::Io`] of the system's answer; for `map_err`.
    pub fn io(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self + use<> {
        let path = path.to_path_buf();
        move |source| Self::Io { doing, path, source }
    }
}

/// Names in quotation marks, the first few of them.
fn names(list: &[String]) -> String {
    let shown: Vec<String> = list.iter().take(MAX_NAMES).map(|name| format!("\"{name}\"")).collect();
    let more = list.len().saturating_sub(MAX_NAMES);
    shown.join(", ") + &if more > 0 { format!(" and {more} more") } else { String::new() }
}

impl fmt::Display for ForeignEntries {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.marked, self.added.as_slice(), self.changed.as_slice()) {
            (false, [], _) => f.write_str("is a file that domecast did not write, or that was changed since"),
            (false, added, _) => {
                write!(f, "holds {}, and no whole marker of an earlier result explains it", names(added))
            }
            (true, added, []) => write!(f, "holds {}, which no earlier result put there", names(added)),
            (true, [], changed) => write!(f, "was changed since it was written: {}", names(changed)),
            (true, added, changed) => write!(
                f,
                "was changed since it was written: {}; and holds {}, which no earlier result put there",
                names(changed),
                names(added)
            ),
        }
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
            Self::NotOurs { path, found } => write!(
                f,
                "{}: {found}; allowed: a new place, or an earlier result with nothing changed or added; name another \
                 place with --out, or keep this one as {}.bak-N with --force",
                path.display(),
                path.file_name().unwrap_or_default().display()
            ),
            Self::Place { path, problem, allowed } => {
                write!(f, "{}: {problem}; allowed: {allowed}", path.display())
            }
        }
    }
}

impl std::error::Error for WriteError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            Self::NotOurs { .. } | Self::Place { .. } => None,
        }
    }
}
