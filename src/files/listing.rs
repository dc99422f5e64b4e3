//! What lies in a folder.

use std::fs;
use std::io;
use std::path::Path;

/// All files and empty folders below `folder`, sorted. A folder ends in `/`; one that `enters` declines (it gets the
/// path with its `/`) is listed and not entered.
pub(crate) fn entries_of(folder: &Path, enters: &dyn Fn(&str) -> bool) -> io::Result<Vec<String>> {
    let mut found = Vec::new();
    let mut open = vec![(folder.to_path_buf(), String::new())];
    while let Some((path, prefix)) = open.pop() {
        let mut empty = true;
        for entry in fs::read_dir(&path)? {
            let entry = entry?;
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            empty = false;
            if !entry.file_type()?.is_dir() {
                found.push(name);
            } else if enters(&format!("{name}/")) {
                open.push((entry.path(), format!("{name}/")));
            } else {
                found.push(format!("{name}/"));
            }
        }
        if empty && !prefix.is_empty() {
            found.push(prefix);
        }
    }
    found.sort();
    Ok(found)
}
