//! The hidden folder beside a result's place in which the result is made, and what becomes of it.
//!
//! `.domecast-XXXXXXXXXXXX/` holds, at any time, some of
//!
//! | entry | what it is | what may be done with it |
//! |---|---|---|
//! | `target` | where the result goes, relative to the hidden folder's parent; locked while the program lives | |
//! | `draft` | the result while it is made | delete |
//! | `swap` | the complete result; after the exchange, what stood in its place | delete if it is an unchanged result of ours, else keep as `NAME.bak-N` |
//! | `old` | where the system has no exchange: what stood in its place | the same |
//!
//! So each entry by itself says what may be done with it, whenever the program was stopped, and [`tidy`] is all that a
//! commit, a failure, a signal and the next run have to do.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tempfile::Builder;

use super::error::WriteError;
use super::marker::{foreign_entries, have_same_content, mark};
use super::platform::{exchange, rename_new, sync_folder};

pub(crate) const PREFIX: &str = ".domecast-";
const RANDOM: usize = 12;
const TARGET: &str = "target";
const DRAFT: &str = "draft";
const SWAP: &str = "swap";
const OLD: &str = "old";
/// The first line of `target`.
const HEAD: &str = "domecast makes a result here, which goes to:\n";
/// Copies of one name that are kept.
const MAX_COPIES: u32 = 10_000;
const MAX_TRIES: u32 = 100;
/// Sweeps of a folder that another thread may still begin to fill.
const MAX_SWEEPS: u32 = 3;
const PAUSE: Duration = Duration::from_millis(2);

/// A staging folder of this process and where its result goes.
#[derive(Debug, Clone)]
pub(crate) struct Live {
    folder: PathBuf,
    /// Where the result goes.
    pub out: PathBuf,
}

/// The staging folders of this process. Whoever creates, commits or removes one holds the lock.
static LIVE: Mutex<Vec<Live>> = Mutex::new(Vec::new());

pub(crate) fn live() -> MutexGuard<'static, Vec<Live>> {
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What became of a staging folder.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Tidied {
    /// Where the entry that was not an unchanged result is kept.
    pub kept: Option<PathBuf>,
    /// What was put in the place.
    pub placed: Option<&'static str>,
}

/// A staging folder; dropped, it leaves what stood in the place.
#[derive(Debug)]
pub(crate) struct Staging {
    base: PathBuf,
    folder: PathBuf,
    rest: PathBuf,
    /// Locked while this lives: the next run leaves the folder alone.
    _lock: File,
}

impl Staging {
    /// Makes a staging folder in `base` for a result that goes to `rest` below it.
    pub fn new(base: &Path, rest: &Path) -> io::Result<Self> {
        let mut live = live();
        for _ in 0..MAX_TRIES {
            // a neighbour of the place, so that a rename stays on one file system
            let folder = Builder::new().prefix(PREFIX).rand_bytes(RANDOM).tempdir_in(base)?.keep();
            let target = folder.join(TARGET);
            let made = File::create_new(&target).and_then(|mut file| {
                // a file system without locks is one on which the next run leaves the folder alone
                let _ = file.lock();
                file.write_all(format!("{HEAD}{}", rest.display()).as_bytes()).map(|()| file)
            });
            match made {
                Ok(lock) if target.exists() => {
                    live.push(Live { folder: folder.clone(), out: base.join(rest) });
                    return Ok(Self { base: base.into(), folder, rest: rest.into(), _lock: lock });
                }
                // another run saw the folder before it was locked, and removed it
                Ok(_) => {}
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(error) => {
                    let _ = fs::remove_dir_all(&folder);
                    return Err(error);
                }
            }
        }
        Err(io::Error::new(io::ErrorKind::ResourceBusy, "another run removes every temporary folder"))
    }

    /// Where the result is made: a file or a folder that the caller creates.
    pub fn draft(&self) -> PathBuf {
        self.folder.join(DRAFT)
    }

    /// Puts the draft in its place; where something stood there that is not an unchanged result of ours, returns where
    /// it is kept.
    pub fn commit(self, shown: &Path, command: &str) -> Result<Option<PathBuf>, WriteError> {
        mark(&self.draft(), command).map_err(WriteError::io("write the file", shown))?;
        let live = live();
        let swap = self.folder.join(SWAP);
        let out = self.base.join(&self.rest);
        let placed = fs::rename(self.draft(), &swap)
            .and_then(|()| sync_folder(&self.folder))
            .and_then(|()| out.parent().map_or(Ok(()), fs::create_dir_all))
            .and_then(|()| place(&swap, &out, &self.folder.join(OLD)));
        if placed.is_err() {
            // still ours, and the drop that follows deletes drafts
            let _ = fs::rename(&swap, self.draft());
        }
        placed.map_err(WriteError::io("put the new result in place", shown))?;
        // the result is in place: a failure from here on must not say that it is not
        for parent in self.rest.ancestors().skip(1) {
            let _ = sync_folder(&self.base.join(parent));
        }
        let tidied = tidy(&self.base, &self.folder, &self.rest);
        drop(live);
        tidied.map(|tidied| tidied.kept).map_err(|error| WriteError::Place {
            path: shown.to_path_buf(),
            problem: format!(
                "the new result is there; the earlier one is still in {} ({error})",
                self.folder.display()
            ),
            allowed: "a folder whose entries can be removed; the next run tries again",
        })
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        let mut live = live();
        if self.folder.exists() {
            // what cannot be removed now is removed by the next run
            let _ = tidy(&self.base, &self.folder, &self.rest);
        }
        live.retain(|live| live.folder != self.folder);
    }
}

/// Puts `new` at `out`; what stood there is then at `new`, or at `old`.
fn place(new: &Path, out: &Path, old: &Path) -> io::Result<()> {
    let Ok(about) = fs::symlink_metadata(out) else { return rename_new(new, out) };
    if !about.is_symlink() {
        // whom the user lets read it is theirs to say
        let _ = fs::set_permissions(new, about.permissions());
    }
    match exchange(new, out) {
        Err(error) if error.kind() == io::ErrorKind::Unsupported => replace(new, out, old),
        done => done,
    }
}

/// Puts `new` at `out` where the system cannot exchange. A file is never away; a folder is, for the moment between two
/// renames, and comes back in the next run if the program ends there.
pub(crate) fn replace(new: &Path, out: &Path, old: &Path) -> io::Result<()> {
    // folders have no hard links
    fs::hard_link(out, old).or_else(|_| fs::rename(out, old))?;
    fs::rename(new, out).inspect_err(|_| drop(undo(out, old)))
}

/// Brings `out` back from `old`.
fn undo(out: &Path, old: &Path) -> io::Result<()> {
    if fs::symlink_metadata(out).is_err() { fs::rename(old, out) } else { fs::remove_file(old) }
}

/// Deletes a file, or a folder that other threads may still fill.
fn delete(path: &Path) -> io::Result<()> {
    for _ in 0..MAX_TRIES {
        let deleted = match fs::symlink_metadata(path) {
            Err(_) => return Ok(()),
            Ok(about) if about.is_dir() => fs::remove_dir_all(path),
            Ok(_) => fs::remove_file(path),
        };
        if deleted.is_ok() {
            return Ok(());
        }
        std::thread::sleep(PAUSE);
    }
    fs::remove_dir_all(path)
}

/// Ends a staging folder in whatever state it is; its owner is this process, or gone.
pub(crate) fn tidy(base: &Path, folder: &Path, rest: &Path) -> io::Result<Tidied> {
    let [draft, swap, old] = [DRAFT, SWAP, OLD].map(|name| folder.join(name));
    let exists = |path: &Path| fs::symlink_metadata(path).is_ok();
    let mut tidied = Tidied::default();
    let out = base.join(rest);
    delete(&draft)?;
    if exists(&old) && exists(&swap) {
        // between the two steps of a replacement: nothing was placed
        if !exists(&out) {
            fs::rename(&old, &out)?;
            tidied.placed = Some("the earlier result is back in its place");
        } else if have_same_content(&old, &out) {
            // a second link to the earlier file
            fs::remove_file(&old)?;
        }
    }
    for left in [&swap, &old].into_iter().filter(|path| exists(path)) {
        if foreign_entries(left)?.is_empty() {
            // a draft may be deleted, so a stop while it is needs no second look
            fs::rename(left, &draft)?;
            delete(&draft)?;
        } else {
            tidied.kept = Some(keep(left, &out)?);
        }
    }
    fs::remove_file(folder.join(TARGET)).or_else(none_is_fine)?;
    // another run may have seen it empty, and removed it
    fs::remove_dir(folder).or_else(none_is_fine)?;
    // folders that were made for a result which then did not come
    for parent in rest.ancestors().skip(1).filter(|parent| !parent.as_os_str().is_empty()) {
        if fs::remove_dir(base.join(parent)).is_err() {
            break;
        }
    }
    Ok(tidied)
}

fn none_is_fine(error: io::Error) -> io::Result<()> {
    if error.kind() == io::ErrorKind::NotFound { Ok(()) } else { Err(error) }
}

/// Moves what is not ours beside its place, under the first free name.
fn keep(left: &Path, out: &Path) -> io::Result<PathBuf> {
    if let Some(parent) = out.parent() {
        fs::create_dir_all(parent)?;
    }
    for number in 1..MAX_COPIES {
        let mut name = out.file_name().unwrap_or_default().to_owned();
        name.push(format!(".bak-{number}"));
        let copy = out.with_file_name(name);
        match rename_new(left, &copy) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            done => return done.map(|()| copy),
        }
    }
    Err(io::ErrorKind::AlreadyExists.into())
}

/// Removes the staging folders of this process, and holds their lock for good: nothing more is placed or removed.
#[cfg(unix)]
pub(crate) fn abandon_all() {
    let live = live();
    for Live { folder, out } in live.iter() {
        if let (Some(base), true) = (folder.parent(), folder.exists()) {
            let rest = out.strip_prefix(base).unwrap_or(out);
            // a draft that another thread begins between its removal and the folder's holds the folder: once more, then
            (0..MAX_SWEEPS).find(|_| tidy(base, folder, rest).is_ok());
        }
    }
    std::mem::forget(live);
}

/// Ends a staging folder that a stopped run left; what became of it, for people. `None` where it is none, or its run
/// still lives.
pub(crate) fn recover_one(folder: &Path) -> Option<String> {
    let name = folder.file_name()?.to_str()?.strip_prefix(PREFIX)?;
    if name.len() != RANDOM || !name.bytes().all(|byte| byte.is_ascii_alphanumeric()) {
        return None;
    }
    if !fs::symlink_metadata(folder).ok()?.is_dir() {
        return None;
    }
    let base = folder.parent()?;
    let mut entries = fs::read_dir(folder).ok()?.map(|entry| entry.map(|entry| entry.file_name()));
    let known = |name: &std::ffi::OsStr| [TARGET, DRAFT, SWAP, OLD].iter().any(|known| name == *known);
    if !entries.all(|name| name.is_ok_and(|name| known(&name))) {
        return None;
    }
    let removed = |place: &Path, what: &str| format!("{}: a run was stopped here; {what}", place.display());
    let target = folder.join(TARGET);
    if fs::symlink_metadata(&target).is_err() {
        // before a run began or after it ended: whether it was stopped cannot be seen, and nothing is lost
        let _ = fs::remove_dir(folder);
        return None;
    }
    let mut lock = File::open(&target).ok()?;
    lock.try_lock().ok()?;
    if !target.exists() {
        // its run ended between the look and the lock: a run removes this file before it lets the lock go
        return None;
    }
    let mut text = String::new();
    lock.read_to_string(&mut text).ok()?;
    // stopped while it was written: nothing else is there then
    let rest = text.strip_prefix(HEAD).map_or("", |rest| rest);
    let rest = PathBuf::from(if rest.is_empty() { "result" } else { rest });
    let is_whole = text.starts_with(HEAD) || HEAD.starts_with(&text);
    if !is_whole || !rest.components().all(|part| matches!(part, Component::Normal(_))) {
        return None;
    }
    let place = base.join(&rest);
    if text.is_empty() {
        // a run that is just starting, or was stopped there: as above
        let _ = tidy(base, folder, &rest);
        return None;
    }
    Some(match tidy(base, folder, &rest) {
        Err(error) => {
            removed(&place, &format!("what it left in {} cannot be removed ({error})", folder.display()))
        }
        Ok(Tidied { kept: Some(copy), .. }) => {
            removed(&place, &format!("what stood there before is kept as {}", copy.display()))
        }
        Ok(Tidied { placed: Some(what), .. }) => removed(&place, what),
        Ok(_) => removed(&place, "what it left behind is removed"),
    })
}
