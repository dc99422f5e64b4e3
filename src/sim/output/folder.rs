//! The folder of a sequence: filled beside its place and moved there whole.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::error::{RunError, fault};
use super::parts::{PLAN_NAME, TRUTH_NAME, VIDEO_NAME};

/// A folder beside the place of the result.
pub(super) struct Staging {
    folder: tempfile::TempDir,
    /// Where the files go meanwhile.
    pub fresh: PathBuf,
}

impl Staging {
    /// Checks that the place holds nothing but an earlier sequence, and makes the folder.
    pub fn new(out: &Path) -> Result<Self, RunError> {
        if let Some(foreign) = foreign_entry(out).map_err(fault("look into the folder", out))? {
            return Err(RunError::NotOurs { path: out.to_path_buf(), foreign });
        }
        let parent = out.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        fs::create_dir_all(parent).map_err(fault("make the folder", parent))?;
        let folder = tempfile::Builder::new()
            .prefix(".domecast-")
            .tempdir_in(parent)
            .map_err(fault("make a temporary folder", parent))?;
        let fresh = folder.path().join("new");
        fs::create_dir_all(&fresh).map_err(fault("make the folder", &fresh))?;
        Ok(Self { folder, fresh })
    }

    /// Moves the files to their place.
    pub fn finish(self, out: &Path) -> Result<(), RunError> {
        put_in_place(self.folder, &self.fresh, out)
    }
}

/// Moves a finished folder to its place; an earlier one makes room, and comes back if the move fails.
fn put_in_place(staging: tempfile::TempDir, fresh: &Path, out: &Path) -> Result<(), RunError> {
    let earlier = staging.path().join("earlier");
    let had_earlier = out.exists();
    if had_earlier {
        fs::rename(out, &earlier).map_err(|source| RunError::Io {
            doing: "move the earlier result aside",
            path: out.to_path_buf(),
            source,
        })?;
    }
    let Err(source) = fs::rename(fresh, out) else { return Ok(()) };
    if had_earlier && fs::rename(&earlier, out).is_err() {
        let kept = staging.keep();
        return Err(RunError::Io { doing: "put the earlier result back; it is kept", path: kept, source });
    }
    Err(RunError::Io { doing: "put the new result in place", path: out.to_path_buf(), source })
}

/// The first entry of an existing folder that is not part of an earlier sequence.
fn foreign_entry(out: &Path) -> io::Result<Option<String>> {
    match fs::metadata(out) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
        Ok(about) if !about.is_dir() => return Ok(Some("a file of that name".into())),
        Ok(_) => {}
    }
    let mut names = Vec::new();
    for entry in fs::read_dir(out)? {
        names.push(entry?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    let ours = |name: &str| {
        let numbered = |start: &str, end: &str| {
            let middle = name.strip_prefix(start).and_then(|rest| rest.strip_suffix(end));
            middle.is_some_and(|digits| digits.len() >= 4 && digits.bytes().all(|b| b.is_ascii_digit()))
        };
        [TRUTH_NAME, VIDEO_NAME, PLAN_NAME].contains(&name)
            || numbered("frame_", ".png")
            || numbered("heights_", ".tif")
            || numbered("pressure_", ".json")
    };
    let complete = names.is_empty() || names.iter().any(|name| name == TRUTH_NAME);
    Ok(names.into_iter().find(|name| !complete || !ours(name)))
}
