//! Reading a set again: labels and readings of its shards.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::index::{FORMAT, INDEX_NAME};
use domecast_design::DesignError;
use domecast_hardness::COLUMNS;

const BLOCK: usize = 512;

/// A row of readings in the order of [`COLUMNS`].
pub type ReadingRow = [f64; COLUMNS.len()];

/// A set as it lies in a folder.
#[derive(Debug, Clone)]
pub struct StoredSet {
    /// Its `dataset.json`.
    pub index: Value,
    /// Shards that are there.
    pub files: Vec<PathBuf>,
}

/// What a set says of one video, its pictures left out.
#[derive(Debug, Clone)]
pub struct StoredVideo {
    /// Its label.
    pub label: Value,
    /// Its readings.
    pub rows: Vec<ReadingRow>,
}

fn fault(path: &Path, field: &str, problem: impl Into<String>, allowed: &str) -> DesignError {
    DesignError::at(field, "", problem.into(), allowed).in_file(path)
}

impl StoredSet {
    /// Opens the set in a folder.
    ///
    /// # Errors
    /// A folder without a set's index, or one of another form.
    pub fn open(folder: &Path) -> Result<Self, DesignError> {
        let path = folder.join(INDEX_NAME);
        let index = domecast_design::parse_json(&domecast_design::read_text(&path)?)
            .map_err(|error| error.in_file(&path))?;
        if index.get("format").and_then(Value::as_str) != Some(FORMAT) {
            return Err(fault(
                &path,
                "format",
                "this is no data set's index",
                "what `domecast dataset` writes",
            ));
        }
        let columns = index.pointer("/readings/columns").and_then(Value::as_array);
        if !columns.is_some_and(|found| found.iter().map(Value::as_str).eq(COLUMNS.map(Some))) {
            let allowed = "the columns that this version writes";
            return Err(fault(&path, "readings.columns", "these are other columns", allowed));
        }
        let names = index.get("shards").and_then(Value::as_array).into_iter().flatten();
        let names = names.filter_map(|shard| shard.get("file").and_then(Value::as_str));
        // names only: what an index says never leads out of its folder
        let names = names.filter(|name| !name.contains(['/', '\\']));
        let files: Vec<PathBuf> = names.map(|name| folder.join(name)).filter(|file| file.is_file()).collect();
        if files.is_empty() {
            return Err(fault(&path, "shards", "none of its shards is there", "a folder with shards"));
        }
        Ok(Self { index, files })
    }

    /// Calls `take` with every video of the shards that are there, in order.
    ///
    /// # Errors
    /// A shard that cannot be read or is not whole.
    pub fn each(&self, take: &mut dyn FnMut(StoredVideo)) -> Result<(), DesignError> {
        for path in &self.files {
            let bytes = std::fs::read(path)
                .map_err(|error| fault(path, "", format!("cannot be read ({error})"), "a readable file"))?;
            let mut rows: Option<(String, Vec<ReadingRow>)> = None;
            for (name, content) in
                entries(&bytes).map_err(|problem| fault(path, "", problem, "a whole shard"))?
            {
                let Some((key, kind)) = name.split_once('.') else { continue };
                if kind == "readings.npy" {
                    let read = readings(content);
                    let read = read.map_err(|problem| fault(path, name, problem, "float32 readings"))?;
                    rows = Some((key.to_owned(), read));
                } else if kind == "json" {
                    let label: Value = serde_json::from_slice(content)
                        .map_err(|error| fault(path, name, error.to_string(), "a label"))?;
                    if let Some((_, rows)) = rows.take().filter(|(of, _)| of == key) {
                        take(StoredVideo { label, rows });
                    }
                }
            }
        }
        Ok(())
    }
}

/// Names and contents of an archive.
fn entries(bytes: &[u8]) -> Result<Vec<(&str, &[u8])>, String> {
    let mut found = Vec::new();
    let mut at = 0;
    loop {
        let header = bytes.get(at..at + BLOCK).ok_or("it ends before its end")?;
        if header.iter().all(|byte| *byte == 0) {
            return Ok(found);
        }
        let text = |from: usize, to: usize| {
            let field = header.get(from..to).unwrap_or_default();
            let end = field.iter().position(|byte| *byte == 0).unwrap_or(field.len());
            std::str::from_utf8(&field[..end]).map_err(|_| "a header is not text".to_owned())
        };
        let size = usize::from_str_radix(text(124, 136)?.trim(), 8).map_err(|_| "a header has no size")?;
        let begin = at + BLOCK;
        let end = begin.checked_add(size).ok_or("a size is too large")?;
        let content = bytes.get(begin..end).ok_or("it ends before its end")?;
        found.push((text(0, 100)?, content));
        at = begin + size.div_ceil(BLOCK) * BLOCK;
    }
}

/// Rows of a float32 array of NumPy's form 1.0.
fn readings(bytes: &[u8]) -> Result<Vec<ReadingRow>, String> {
    let length = bytes.get(8..10).ok_or("no header")?;
    let begin = 10 + usize::from(u16::from_le_bytes([length[0], length[1]]));
    let header =
        bytes.get(10..begin).and_then(|header| std::str::from_utf8(header).ok()).ok_or("no header")?;
    let right = header.contains("'<f4'")
        && header.contains("False")
        && header.contains(&format!(", {},", COLUMNS.len()));
    if !right {
        return Err(format!("it holds {}", header.trim()));
    }
    let values = bytes.get(begin..).unwrap_or_default();
    let (numbers, _) = values.as_chunks::<4>();
    let numbers: Vec<f64> = numbers.iter().map(|four| f64::from(f32::from_le_bytes(*four))).collect();
    Ok(numbers.as_chunks::<{ COLUMNS.len() }>().0.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tar::Archive;

    #[test]
    fn what_is_written_is_read_and_what_is_cut_is_refused() {
        let rows = 3;
        let values = (0..rows * COLUMNS.len()).map(|k| k as f32);
        let array = domecast_files::npy_f32(&[rows, COLUMNS.len()], values);
        assert_eq!(readings(&array).expect("readings")[2][1], (2 * COLUMNS.len() + 1) as f64);
        let mut archive = Archive::default();
        archive.add("000000.readings.npy", &array);
        archive.add("000000.json", b"{}");
        let bytes = archive.finish();
        let found = entries(&bytes).expect("whole");
        assert_eq!(
            found.iter().map(|entry| entry.0).collect::<Vec<_>>(),
            ["000000.readings.npy", "000000.json"]
        );
        for cut in [0, 100, 700, bytes.len() - 1100] {
            assert!(entries(&bytes[..cut]).is_err(), "{cut}");
        }
    }
}
