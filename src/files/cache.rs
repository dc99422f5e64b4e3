//! Tables that take long to compute, kept on disk from one run to the next.
//!
//! An entry's name is the hash of all that its numbers were computed from, the program among it, so it never grows old: what
//! changes has another name. An entry that is not whole, by its length and checksum, is as good as none.

use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use sha2::{Digest, Sha256};
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

/// What an entry begins with; its form's number is in it.
const MAGIC: &[u8; 16] = b"domecast table 2";
/// Name's hash and count of numbers come after it, the checksum of all before at the end.
const HEAD: usize = MAGIC.len() + 32 + 8;
const CHECKSUM: usize = 16;
/// Larger entries are neither written nor read.
const MAX_ENTRY_BYTES: u64 = 100_000_000;
/// Beyond this the entries that were not used for longest go.
const MAX_BYTES: u64 = 500_000_000;
/// Bytes of the program that are read at a time.
const BLOCK: usize = 1 << 17;
const ENDING: &str = "table";
/// Begins the names of files that are being written.
const DRAFT: &str = "draft-";

/// A folder of tables. Whatever the system refuses, the tables are computed: nothing here fails.
#[derive(Debug, Clone)]
pub struct Cache {
    folder: PathBuf,
    computed_by: [u8; 16],
    max_bytes: u64,
}

impl Cache {
    /// A cache in a folder, which is made with the first entry. `computed_by` is what tells one program from another that computes
    /// other numbers: its own bytes, and of the processor what its results may depend on.
    ///
    /// # Errors
    /// `computed_by` cannot be read.
    pub fn new(folder: &Path, mut computed_by: impl Read) -> std::io::Result<Self> {
        let (mut hash, mut block) = (Xxh3::new(), vec![0; BLOCK]);
        loop {
            let count = computed_by.read(&mut block)?;
            if count == 0 {
                let computed_by = hash.digest128().to_le_bytes();
                return Ok(Self { folder: folder.to_owned(), computed_by, max_bytes: MAX_BYTES });
            }
            hash.update(&block[..count]);
        }
    }

    /// The numbers of a key, which says all that they depend on; `None` where there is no whole entry.
    pub fn get(&self, key: &str) -> Option<Vec<f64>> {
        let hash = self.hash(key);
        let path = self.path(&hash);
        let meta = fs::symlink_metadata(&path).ok()?;
        if !meta.is_file() || meta.len() > MAX_ENTRY_BYTES {
            return None;
        }
        let file = File::open(&path).ok()?;
        let mut bytes = Vec::with_capacity(meta.len() as usize);
        (&file).take(MAX_ENTRY_BYTES).read_to_end(&mut bytes).ok()?;
        let numbers = read(&bytes, &hash)?;
        // Used now; where the file may not be touched it only goes earlier.
        let _ = file.set_modified(SystemTime::now());
        Some(numbers)
    }

    /// Keeps numbers under a key, as far as the system lets it.
    pub fn put(&self, key: &str, numbers: &[f64]) {
        let hash = self.hash(key);
        let size = (HEAD + 8 * numbers.len() + CHECKSUM) as u64;
        if size <= MAX_ENTRY_BYTES && self.write(&hash, numbers).is_ok() {
            self.shrink();
        }
    }

    /// So many numbers of a key, from disk or made now and put there.
    pub fn numbers(&self, key: &str, count: usize, make: impl FnOnce() -> Vec<f64>) -> Vec<f64> {
        if let Some(known) = self.get(key).filter(|known| known.len() == count) {
            return known;
        }
        let made = make();
        self.put(key, &made);
        made
    }

    fn hash(&self, key: &str) -> [u8; 32] {
        Sha256::new().chain_update(MAGIC).chain_update(self.computed_by).chain_update(key).finalize().into()
    }

    fn path(&self, hash: &[u8; 32]) -> PathBuf {
        let name: String = hash.iter().map(|byte| format!("{byte:02x}")).collect();
        self.folder.join(name).with_extension(ENDING)
    }

    fn write(&self, hash: &[u8; 32], numbers: &[f64]) -> std::io::Result<()> {
        let mut bytes = Vec::with_capacity(HEAD + 8 * numbers.len() + CHECKSUM);
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(hash);
        bytes.extend_from_slice(&(numbers.len() as u64).to_le_bytes());
        bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        bytes.extend_from_slice(&checksum(&bytes));
        fs::create_dir_all(&self.folder)?;
        let mut draft = tempfile::Builder::new().prefix(DRAFT).tempfile_in(&self.folder)?;
        draft.write_all(&bytes)?;
        draft.persist(self.path(hash))?;
        Ok(())
    }

    /// Removes what was not used for longest until the rest fits; nothing that others have put into the folder.
    fn shrink(&self) {
        let Ok(listed) = fs::read_dir(&self.folder) else { return };
        let mut own: Vec<(SystemTime, PathBuf, u64)> = listed
            .flatten()
            .filter(|entry| is_own(&entry.file_name().to_string_lossy()))
            .filter_map(|entry| {
                let meta = entry.metadata().ok().filter(fs::Metadata::is_file)?;
                Some((meta.modified().ok()?, entry.path(), meta.len()))
            })
            .collect();
        own.sort();
        let mut total: u64 = own.iter().map(|(_, _, bytes)| bytes).sum();
        for (_, path, bytes) in own {
            if total <= self.max_bytes {
                return;
            }
            // Another program may have removed it already.
            let _ = fs::remove_file(path);
            total = total.saturating_sub(bytes);
        }
    }
}

fn is_own(name: &str) -> bool {
    let hash = name.strip_suffix(ENDING).and_then(|name| name.strip_suffix('.'));
    let is_hash = |hash: &str| hash.len() == 64 && hash.bytes().all(|byte| byte.is_ascii_hexdigit());
    hash.is_some_and(is_hash) || name.starts_with(DRAFT)
}

/// Of damage, not of malice: who may write to the folder may write a checksum. SHA-256 took a sixth of a short scene's time.
fn checksum(bytes: &[u8]) -> [u8; CHECKSUM] {
    xxh3_128(bytes).to_le_bytes()
}

/// The numbers of a whole entry.
fn read(bytes: &[u8], hash: &[u8; 32]) -> Option<Vec<f64>> {
    let (content, last) = bytes.split_last_chunk::<CHECKSUM>()?;
    if *last != checksum(content) {
        return None;
    }
    let (head, numbers) = content.split_at_checked(HEAD)?;
    let (count, named) = (head.last_chunk::<8>()?, head.strip_prefix(MAGIC)?);
    let fits = u64::from_le_bytes(*count).checked_mul(8) == Some(numbers.len() as u64);
    if !named.starts_with(hash) || !fits {
        return None;
    }
    Some(
        numbers.chunks_exact(8).filter_map(|eight| Some(f64::from_le_bytes(*eight.first_chunk()?))).collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(folder: &Path, computed_by: &str) -> Cache {
        Cache::new(folder, computed_by.as_bytes()).expect("text is read")
    }

    fn only(cache: &Cache) -> PathBuf {
        let listed: Vec<PathBuf> = fs::read_dir(&cache.folder).unwrap().map(|e| e.unwrap().path()).collect();
        assert_eq!(listed.len(), 1, "{listed:?}");
        listed[0].clone()
    }

    #[test]
    fn numbers_come_back_to_the_bit_and_only_to_their_key_and_program() {
        let place = tempfile::tempdir().unwrap();
        let cache = of(&place.path().join("deep/cache"), "one");
        let numbers = [0.1, -0.0, f64::MIN_POSITIVE / 8.0, f64::INFINITY, 1e300];
        assert_eq!(cache.get("key"), None);
        cache.put("key", &numbers);
        let found = cache.get("key").unwrap();
        assert!(found.iter().zip(numbers).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert_eq!(cache.get("key "), None);
        assert_eq!(of(&cache.folder, "two").get("key"), None);
        assert_eq!(cache.numbers("key", 5, || unreachable!()).len(), 5);
        assert_eq!(cache.numbers("key", 1, || vec![2.0]), [2.0]);
        assert_eq!(cache.get("key").unwrap(), [2.0]);
        cache.put("none", &[]);
        assert_eq!(cache.get("none").unwrap(), [0.0; 0]);
    }

    #[test]
    fn no_damaged_or_foreign_entry_is_trusted_and_all_are_made_anew() {
        let place = tempfile::tempdir().unwrap();
        let cache = of(place.path(), "");
        let numbers = [1.0, 2.0, 3.0];
        cache.put("key", &numbers);
        let path = only(&cache);
        let whole = fs::read(&path).unwrap();
        let mut damaged: Vec<Vec<u8>> = (0..whole.len()).map(|end| whole[..end].to_vec()).collect();
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 1;
            damaged.push(bytes);
        }
        let longer = [&whole[..], &[0; 8]].concat();
        // whole and checked, and yet not of this form: other-endian, of another name, of another number of numbers
        let sealed = |change: &dyn Fn(&mut Vec<u8>)| {
            let mut bytes = whole[..whole.len() - CHECKSUM].to_vec();
            change(&mut bytes);
            [&bytes[..], &checksum(&bytes)].concat()
        };
        damaged.extend([
            longer,
            vec![0; whole.len()],
            sealed(&|bytes| bytes[HEAD - 8..HEAD].reverse()),
            sealed(&|bytes| bytes[20] ^= 1),
            sealed(&|bytes| bytes[15] = b'1'),
            sealed(&|bytes| bytes.truncate(bytes.len() - 8)),
            sealed(&|bytes| bytes.truncate(10)),
            sealed(&|bytes| bytes[HEAD - 8..HEAD].fill(0xff)),
        ]);
        for bytes in damaged {
            fs::write(&path, &bytes).unwrap();
            assert_eq!(cache.get("key"), None);
        }
        assert_eq!(cache.numbers("key", 3, || numbers.to_vec()), numbers);
        assert_eq!(fs::read(&path).unwrap(), whole);
        // a folder in its place: it is left, and the numbers are made
        fs::remove_file(&path).unwrap();
        fs::create_dir(&path).unwrap();
        assert_eq!(cache.numbers("key", 3, || numbers.to_vec()), numbers);
        assert!(path.is_dir());
    }

    #[test]
    fn a_folder_that_cannot_be_written_costs_nothing_but_time() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("file");
        fs::write(&file, "mine").unwrap();
        for folder in [file.clone(), file.join("below"), PathBuf::from("\0")] {
            assert_eq!(of(&folder, "").numbers("key", 1, || vec![4.0]), [4.0]);
        }
        assert_eq!(fs::read_to_string(&file).unwrap(), "mine");
    }

    #[test]
    fn what_was_not_used_for_longest_goes_and_nothing_of_others() {
        let place = tempfile::tempdir().unwrap();
        let cache = Cache { max_bytes: 1000, ..of(place.path(), "") };
        fs::write(place.path().join("notes.txt"), [0; 5000]).unwrap();
        let aged = |key: &str, seconds: u64| {
            let path = cache.path(&cache.hash(key));
            let then = SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(seconds);
            File::options().write(true).open(path).unwrap().set_modified(then).unwrap();
        };
        for (key, seconds) in [("a", 1), ("b", 2), ("c", 3)] {
            cache.put(key, &[0.0; 25]);
            aged(key, seconds);
        }
        assert!(cache.get("a").is_some());
        cache.put("d", &[0.0; 25]);
        let left = ["a", "b", "c", "d"].map(|key| cache.get(key).is_some());
        assert_eq!(left, [true, false, true, true]);
        assert!(place.path().join("notes.txt").exists());
    }

    #[test]
    fn many_may_write_the_same_entry_at_once() {
        let place = tempfile::tempdir().unwrap();
        let cache = of(place.path(), "");
        std::thread::scope(|threads| {
            for _ in 0..8 {
                threads.spawn(|| {
                    for _ in 0..20 {
                        assert_eq!(cache.numbers("key", 300, || vec![5.0; 300]), [5.0; 300]);
                        cache.put("key", &[5.0; 300]);
                    }
                });
            }
        });
        only(&cache);
    }
}
