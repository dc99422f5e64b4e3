//! How a result is known again, and known to be unchanged.
//!
//! A folder holds a marker: our name and version, the hash of every other file (XXH3 of 128 bits) in the form of `xxh128sum`,
//! and a seal, the hash of the lines above it. They tell whether a file was changed, not by whom; SHA-256, which older versions
//! have, took a fifth of the time of `track --shape`. A single file carries its hash as an extended attribute of the file
//! system; where there are none, it is not known again, and takes `--force` to be replaced.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use sha2::{Digest, Sha256};
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

use super::error::ForeignEntries;
use super::listing::entries_of;
use super::platform;

/// The marker's name in the folder of a result.
pub const MARKER_NAME: &str = ".domecast";
/// How the first line begins, before the version.
const HEAD: &str = "# domecast ";
const SEAL: &str = "# seal ";
/// Hexadecimal digits of SHA-256.
const OLD_DIGITS: usize = 64;
/// A marker of a million frames has some 100 MB.
const MAX_MARKER_BYTES: u64 = 1 << 28;
/// Threads that read and sync files: they wait for the disk, not for a core.
const THREADS: usize = 8;

/// Reads a regular file, piece by piece. Links, devices and pipes are none.
fn read(path: &Path, mut each: impl FnMut(&[u8])) -> io::Result<()> {
    if !fs::symlink_metadata(path)?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    let mut file = File::open(path)?;
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok(()),
            Ok(count) => each(&buffer[..count]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

/// Hash of a regular file, hexadecimal.
fn hash_of(path: &Path) -> io::Result<String> {
    let mut digest = Xxh3::new();
    read(path, |bytes| digest.update(bytes))?;
    Ok(format!("{:032x}", digest.digest128()))
}

/// Whether a file has the hash that was noted: by its length also SHA-256, as older versions have it.
fn has_hash(path: &Path, noted: &str) -> bool {
    if noted.len() != OLD_DIGITS {
        return hash_of(path).is_ok_and(|hash| hash == noted);
    }
    let mut digest = Sha256::new();
    read(path, |bytes| digest.update(bytes)).is_ok_and(|()| old_hex(digest) == noted)
}

fn old_hex(digest: Sha256) -> String {
    digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Whether two files hold the same bytes.
pub(crate) fn have_same_content(one: &Path, other: &Path) -> bool {
    matches!((hash_of(one), hash_of(other)), (Ok(one), Ok(other)) if one == other)
}

/// Does `one` for each name, on a few threads; the answers in order.
fn for_each<T: Send>(names: &[String], one: impl Fn(&str) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let found = Mutex::new(BTreeMap::new());
    std::thread::scope(|threads| {
        for _ in 0..THREADS.min(names.len()) {
            threads.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(name) = names.get(index) else { return };
                    let answer = one(name);
                    found.lock().unwrap_or_else(PoisonError::into_inner).insert(index, answer);
                }
            });
        }
    });
    found.into_inner().unwrap_or_else(PoisonError::into_inner).into_values().collect()
}

/// Marks a complete result of a command, and has it on the disk: every file, then the marker, then the folders.
pub(crate) fn mark(result: &Path, command: &str) -> io::Result<()> {
    if !result.is_dir() {
        platform::set_mark(result, &format!("{command} {}", hash_of(result)?));
        return File::open(result)?.sync_all();
    }
    let mut names = entries_of(result, &|_| true)?;
    names.retain(|name| !name.ends_with('/'));
    let hashes = for_each(&names, |name| {
        let path = result.join(name);
        let hash = hash_of(&path)?;
        File::open(&path)?.sync_all().map(|()| hash)
    });
    let mut text = format!(
        "{HEAD}{} {command} wrote this folder, and replaces it only while these files are unchanged\n",
        env!("CARGO_PKG_VERSION")
    );
    for (name, hash) in names.iter().zip(hashes) {
        text += &format!("{}  {name}\n", hash?);
    }
    text += &format!("{SEAL}{:032x}\n", xxh3_128(text.as_bytes()));
    let marker = result.join(MARKER_NAME);
    fs::write(&marker, text)?;
    File::open(&marker)?.sync_all()?;
    let mut folders = vec![result.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder)? {
            let entry = entry?;
            if entry.file_type()?.is_dir() {
                folders.push(entry.path());
            }
        }
        platform::sync_folder(&folder)?;
    }
    Ok(())
}

/// What a folder's marker says: the command, and the files with their hashes.
struct Marker {
    command: String,
    files: BTreeMap<String, String>,
}

/// A folder's marker; `None` where there is none, or it is not whole.
fn marker_of(folder: &Path) -> Option<Marker> {
    let path = folder.join(MARKER_NAME);
    let about = fs::symlink_metadata(&path).ok()?;
    if !about.is_file() || about.len() > MAX_MARKER_BYTES {
        return None;
    }
    let text = fs::read_to_string(&path).ok()?;
    let at = text.rfind(SEAL)?;
    let (above, seal) = text.split_at(at);
    let noted = seal.strip_prefix(SEAL)?.strip_suffix('\n')?;
    let is_whole = match noted.len() {
        OLD_DIGITS => old_hex(Sha256::new().chain_update(above)) == noted,
        _ => format!("{:032x}", xxh3_128(above.as_bytes())) == noted,
    };
    let mut rows = above.strip_prefix(HEAD).filter(|_| is_whole)?.lines();
    let command = rows.next()?.split(' ').nth(1)?.to_owned();
    let file = |row: &str| row.split_once("  ").map(|(hash, name)| (name.to_owned(), hash.to_owned()));
    Some(Marker { command, files: rows.map(file).collect::<Option<_>>()? })
}

/// All files below `folder`, as sorted paths with `/`; the marker of a result is not among them. Links are listed, not
/// followed.
///
/// # Errors
/// What the system says when the folder cannot be read.
pub fn list_files(folder: &Path) -> io::Result<Vec<String>> {
    let mut files = entries_of(folder, &|_| true)?;
    files.retain(|path| !path.ends_with('/') && path != MARKER_NAME);
    Ok(files)
}

/// The files of a result, as its marker lists them, whether they are still there or not; `None` where there is no whole
/// marker.
pub fn marked_files(folder: &Path) -> Option<Vec<String>> {
    marker_of(folder).map(|marker| marker.files.into_keys().collect())
}

/// The command that wrote a result; `None` for what is none.
pub(crate) fn command_of(path: &Path) -> Option<String> {
    if path.is_dir() {
        return marker_of(path).map(|marker| marker.command);
    }
    Some(platform::mark_of(path)?.split_once(' ')?.0.to_owned())
}

/// What of a folder or file is not as an earlier result left it. A folder that lacks files of the result is unchanged:
/// nothing in it would be lost; so are an empty one and a file without content, as `mktemp` makes them.
pub(crate) fn foreign_entries(path: &Path) -> io::Result<ForeignEntries> {
    let about = fs::symlink_metadata(path)?;
    if about.is_file() && about.len() == 0 {
        return Ok(ForeignEntries::default());
    }
    if !about.is_dir() {
        let mark = platform::mark_of(path).unwrap_or_default();
        let unchanged = mark.split_once(' ').is_some_and(|(_, hash)| has_hash(path, hash));
        let changed = if unchanged { Vec::new() } else { vec![String::new()] };
        return Ok(ForeignEntries { changed, ..ForeignEntries::default() });
    }
    let Some(Marker { files: listed, .. }) = marker_of(path) else {
        // not entered: this may be someone's home
        let added = entries_of(path, &|_| false)?;
        return Ok(ForeignEntries { added, ..ForeignEntries::default() });
    };
    let holds_ours = |folder: &str| {
        listed.range(folder.to_owned()..).next().is_some_and(|(name, _)| name.starts_with(folder))
    };
    let mut entries = entries_of(path, &holds_ours)?;
    entries.retain(|name| name != MARKER_NAME);
    let (ours, mut added): (Vec<_>, Vec<_>) = entries.into_iter().partition(|name| listed.contains_key(name));
    // a folder of the result that lost its files holds nothing of anyone's
    added.retain(|name| !(name.ends_with('/') && holds_ours(name)));
    let unchanged =
        for_each(&ours, |name| listed.get(name).is_some_and(|hash| has_hash(&path.join(name), hash)));
    let changed =
        ours.into_iter().zip(unchanged).filter_map(|(name, same)| (!same).then_some(name)).collect();
    Ok(ForeignEntries { changed, added, marked: true })
}
