//! Frames in files: which a folder holds, and their numbers.
//!
//! ```
//! use domecast_live::frame_files::numbered;
//!
//! let files = numbered(vec!["b_7.png".into(), "a_12.png".into()]);
//! assert_eq!(files, [(7, "b_7.png".into()), (12, "a_12.png".into())]);
//! ```

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Bytes at most of a picture's file.
const MAX_FILE_BYTES: u64 = 1 << 28;
const PICTURES: [&str; 5] = ["png", "jpg", "jpeg", "pgm", "ppm"];

/// Whether a file's name ends in one of these, in small or capital letters.
pub fn has_extension(path: &Path, list: &[&str]) -> bool {
    path.extension().and_then(|e| e.to_str()).is_some_and(|e| list.contains(&e.to_ascii_lowercase().as_str()))
}

/// The bytes of a picture's file.
///
/// # Errors
/// What the system says.
pub fn read_whole(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(MAX_FILE_BYTES).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The pictures in a folder, by name.
///
/// # Errors
/// What the system says.
pub fn pictures_in(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if has_extension(&path, &PICTURES) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// The last number in a file's name.
fn number_of(path: &Path) -> Option<u64> {
    let name = path.file_stem()?.to_str()?;
    let digits: String =
        name.chars().rev().skip_while(|c| !c.is_ascii_digit()).take_while(char::is_ascii_digit).collect();
    digits.chars().rev().collect::<String>().parse().ok()
}

/// Frames by the numbers in their names, so that a missing file shows as a gap; by their order where some have none,
/// or two have the same.
pub fn numbered(files: Vec<PathBuf>) -> Vec<(u64, PathBuf)> {
    let mut by_name: Vec<(u64, PathBuf)> =
        files.iter().filter_map(|path| Some((number_of(path)?, path.clone()))).collect();
    by_name.sort_by_key(|(number, _)| *number);
    let distinct = by_name.windows(2).all(|pair| pair[0].0 != pair[1].0);
    if by_name.len() == files.len() && distinct {
        return by_name;
    }
    files.into_iter().enumerate().map(|(i, path)| (i as u64, path)).collect()
}
