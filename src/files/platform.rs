//! What the systems do in different ways: renaming, syncing, marks on files, mount points.

use std::fs;
use std::io;
use std::path::Path;

#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
mod renaming {
    use std::io;
    use std::path::Path;

    use rustix::fs::{CWD, RenameFlags, renameat_with};
    use rustix::io::Errno;

    fn with(flags: RenameFlags, from: &Path, to: &Path) -> io::Result<()> {
        renameat_with(CWD, from, CWD, to, flags).map_err(|error| match error {
            Errno::INVAL | Errno::NOSYS | Errno::NOTSUP | Errno::XDEV => io::ErrorKind::Unsupported.into(),
            other => other.into(),
        })
    }

    pub(super) fn exchange(one: &Path, other: &Path) -> io::Result<()> {
        with(RenameFlags::EXCHANGE, one, other)
    }

    pub(super) fn rename_new(from: &Path, to: &Path) -> io::Result<()> {
        with(RenameFlags::NOREPLACE, from, to)
    }
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
mod renaming {
    use std::io;
    use std::path::Path;

    pub(super) fn exchange(_: &Path, _: &Path) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
    }

    pub(super) fn rename_new(_: &Path, _: &Path) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
    }
}

/// Lets two entries of one file system change places in one step.
///
/// # Errors
/// `Unsupported` where the system or the file system has no such step.
pub(crate) fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    renaming::exchange(one, other)
}

/// Renames to a name that must be free.
pub(crate) fn rename_new(from: &Path, to: &Path) -> io::Result<()> {
    match renaming::rename_new(from, to) {
        Err(error) if error.kind() == io::ErrorKind::Unsupported => {
            if fs::symlink_metadata(to).is_ok() {
                return Err(io::ErrorKind::AlreadyExists.into());
            }
            fs::rename(from, to)
        }
        done => done,
    }
}

/// Has a folder's entries on the disk; a system that cannot sync folders does so by itself.
pub(crate) fn sync_folder(folder: &Path) -> io::Result<()> {
    if cfg!(unix) { fs::File::open(folder)?.sync_all() } else { Ok(()) }
}

#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
const MARKS: [&str; 2] = if cfg!(target_vendor = "apple") {
    ["domecast.xxh128", "domecast.sha256"]
} else {
    ["user.domecast.xxh128", "user.domecast.sha256"]
};

/// Notes a file's hash beside its content; a file system without attributes keeps none.
#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
pub(crate) fn set_mark(file: &Path, hash: &str) {
    // without its mark the file is taken for someone else's, which loses nothing
    let _ = rustix::fs::setxattr(file, MARKS[0], hash.as_bytes(), rustix::fs::XattrFlags::empty());
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
pub(crate) fn set_mark(_: &Path, _: &str) {}

/// The hash that was noted, by this version or an older one.
#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
pub(crate) fn mark_of(file: &Path) -> Option<String> {
    let mut buffer = [0_u8; 128];
    let read = |mark: &&str| rustix::fs::lgetxattr(file, *mark, &mut buffer[..]).ok();
    let count = MARKS.iter().find_map(read)?;
    String::from_utf8(buffer.get(..count)?.to_vec()).ok()
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
pub(crate) fn mark_of(_: &Path) -> Option<String> {
    None
}

/// Whether something is mounted here: such a place cannot be renamed.
#[cfg(any(target_os = "linux", target_os = "android"))]
pub(crate) fn is_mount_point(path: &Path, parent: &Path) -> bool {
    use rustix::fs::{AtFlags, CWD, StatxAttributes, StatxFlags, statx};
    let about = statx(CWD, path, AtFlags::SYMLINK_NOFOLLOW, StatxFlags::BASIC_STATS);
    match about {
        Ok(about) if about.stx_attributes_mask.contains(StatxAttributes::MOUNT_ROOT) => {
            about.stx_attributes.contains(StatxAttributes::MOUNT_ROOT)
        }
        _ => is_on_another_device(path, parent),
    }
}

/// Whether something is mounted here: such a place cannot be renamed.
#[cfg(not(any(target_os = "linux", target_os = "android")))]
pub(crate) fn is_mount_point(path: &Path, parent: &Path) -> bool {
    is_on_another_device(path, parent)
}

/// Whether a folder lies on another device than the one that holds it. Files of layered file systems may, and are not
/// mounted.
#[cfg(unix)]
fn is_on_another_device(path: &Path, parent: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let about = |path: &Path| fs::symlink_metadata(path).ok();
    match (about(path), about(parent)) {
        (Some(own), Some(above)) => own.is_dir() && own.dev() != above.dev(),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_on_another_device(_: &Path, _: &Path) -> bool {
    false
}
