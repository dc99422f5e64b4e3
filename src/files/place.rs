//! Where a result may go: looked at before the work begins.

use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use super::error::WriteError;
use super::marker::{command_of, foreign_entries};
use super::platform::is_mount_point;
use super::staging::live;

/// What a command asks of the place of its result.
#[derive(Debug, Clone, Copy, Default)]
pub struct OutputRules<'a> {
    /// Replaces what is not an unchanged earlier result too; it is kept as `NAME.bak-N`.
    pub force: bool,
    /// Files and folders that the command reads: none is replaced, whatever `force` says.
    pub inputs: &'a [&'a Path],
}

/// What a place is to hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    File,
    Folder,
}

/// A place that can take a result.
#[derive(Debug)]
pub(crate) struct Place {
    /// The deepest folder that exists, without links.
    pub base: PathBuf,
    /// The result's path below it.
    pub rest: PathBuf,
}

const ALLOWED_FOLDER: &str = "a new folder, or one inside this one";
const ALLOWED_FILE: &str =
    "a new file in a folder that can be written; without --out, what goes to standard output";

fn refused(path: &Path, problem: impl Into<String>, kind: Kind) -> WriteError {
    let allowed = if kind == Kind::File { ALLOWED_FILE } else { ALLOWED_FOLDER };
    WriteError::Place { path: path.to_path_buf(), problem: problem.into(), allowed }
}

/// The folder that holds `path`.
fn parent_of(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

impl Place {
    /// Looks at a place, and refuses what would lose something or cannot work.
    pub fn new(out: &Path, kind: Kind, command: &str, rules: &OutputRules<'_>) -> Result<Self, WriteError> {
        let looking = || WriteError::io("look into the folder", out);
        // `link/` and `link/.` are the link
        let plain: PathBuf = out.components().collect();
        let out = plain.as_path();
        let place = match fs::symlink_metadata(out) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Self::free(out, kind)?,
            Err(error) => return Err(looking()(error)),
            Ok(about) => {
                let real = if about.is_symlink() {
                    link_target(out, kind)?
                } else {
                    fs::canonicalize(out).map_err(looking())?
                };
                Self::taken(out, &real, kind, command, rules)?
            }
        };
        let real = place.base.join(&place.rest);
        let overlaps = |other: &Path| other.starts_with(&real) || real.starts_with(other);
        if live().iter().any(|live| overlaps(&live.out)) {
            return Err(refused(out, "is the place of two results of this command", kind));
        }
        Ok(place)
    }

    /// A place where nothing stands yet.
    fn free(out: &Path, kind: Kind) -> Result<Self, WriteError> {
        let looking = |path: &Path| WriteError::io("look into the folder", path);
        let full = std::path::absolute(out).map_err(looking(out))?;
        let exists = |path: &&Path| fs::symlink_metadata(path).is_ok();
        let Some(base) = full.ancestors().skip(1).find(exists) else {
            return Err(refused(out, "has no folder that exists above it", kind));
        };
        let rest = full.strip_prefix(base).unwrap_or(out).to_path_buf();
        if !rest.components().all(|part| matches!(part, Component::Normal(_))) {
            return Err(refused(out, "leads back out of a folder that does not exist", kind));
        }
        let base = fs::canonicalize(base).map_err(looking(base))?;
        if !base.is_dir() {
            return Err(looking(out)(io::ErrorKind::NotADirectory.into()));
        }
        Ok(Self { base, rest })
    }

    /// A place where something stands: `real` is its path without links.
    fn taken(
        out: &Path,
        real: &Path,
        kind: Kind,
        command: &str,
        rules: &OutputRules<'_>,
    ) -> Result<Self, WriteError> {
        let looking = || WriteError::io("look into the folder", out);
        let (Some(base), Some(name)) = (real.parent(), real.file_name()) else {
            return Err(refused(out, "is the root of the file system", kind));
        };
        let about = fs::symlink_metadata(real).map_err(looking())?;
        match kind {
            Kind::Folder if !about.is_dir() => {
                return Err(refused(out, "is a file, not a folder", kind));
            }
            Kind::File if about.is_dir() => return Err(refused(out, "is a folder, not a file", kind)),
            Kind::File if !about.is_file() => {
                return Err(refused(out, "is a device or a pipe, which cannot be replaced", kind));
            }
            _ => {}
        }
        if about.permissions().readonly() {
            return Err(refused(out, "is marked read-only", kind));
        }
        if is_mount_point(real, base) {
            return Err(refused(out, "is a mount point, which cannot be replaced", kind));
        }
        if std::env::current_dir().and_then(fs::canonicalize).is_ok_and(|here| here.starts_with(real)) {
            return Err(refused(out, "is the folder in which this command runs, or holds it", kind));
        }
        for input in rules.inputs {
            let Ok(input_real) = fs::canonicalize(input) else { continue };
            if input_real.starts_with(real) {
                let what = if input_real == real { "is an input" } else { "holds an input" };
                return Err(refused(out, format!("{what} of this command, {}", input.display()), kind));
            }
        }
        let found = foreign_entries(real).map_err(looking())?;
        match command_of(real) {
            Some(other) if found.is_empty() && other != command => {
                return Err(refused(out, format!("holds the result of `domecast {other}`"), kind));
            }
            _ if found.is_empty() || rules.force => {}
            _ => return Err(WriteError::NotOurs { path: out.to_path_buf(), found }),
        }
        Ok(Self { base: base.to_path_buf(), rest: PathBuf::from(name) })
    }
}

/// Where a link leads, if that is in the link's own folder: elsewhere, nobody would look for what is replaced.
fn link_target(out: &Path, kind: Kind) -> Result<PathBuf, WriteError> {
    let target =
        fs::canonicalize(out).map_err(|_| refused(out, "is a symbolic link that leads nowhere", kind))?;
    let parent = parent_of(out);
    let folder = fs::canonicalize(parent).map_err(WriteError::io("look into the folder", parent))?;
    if target.starts_with(&folder) && target != folder {
        return Ok(target);
    }
    let problem = format!("is a symbolic link that leads out of its folder, to {}", target.display());
    Err(refused(out, problem, kind))
}
