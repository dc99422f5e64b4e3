//! Shards of a data set: plain tar of NumPy arrays and JSON.

use std::path::Path;

/// What is wrong with a data set or an argument, in words.
pub(crate) type Problem = String;

/// Bytes of a shard at most.
const MAX_SHARD_BYTES: u64 = 4 << 30;

/// The members of a tar, in their order: name and content.
///
/// # Errors
/// The file cannot be read, is cut, or a member's head is not that of a plain file.
pub fn members(path: &Path) -> Result<Vec<(String, Vec<u8>)>, Problem> {
    let fault = |problem: &str| {
        format!("{}: {problem}; allowed: a whole shard of `domecast dataset`", path.display())
    };
    let length = std::fs::metadata(path).map_err(|e| fault(&e.to_string()))?.len();
    if length > MAX_SHARD_BYTES {
        return Err(fault("is larger than 4 GiB"));
    }
    let bytes = std::fs::read(path).map_err(|e| fault(&e.to_string()))?;
    let mut rest = bytes.as_slice();
    let mut members = Vec::new();
    while let Some((head, tail)) = rest.split_at_checked(512) {
        if head.iter().all(|byte| *byte == 0) {
            return Ok(members);
        }
        let text = |range: std::ops::Range<usize>| {
            let field = &head[range];
            let end = field.iter().position(|byte| *byte == 0).unwrap_or(field.len());
            String::from_utf8_lossy(&field[..end]).trim().to_string()
        };
        if &head[257..262] != b"ustar" || !matches!(head[156], b'0' | 0) {
            return Err(fault("has a member that is no plain file"));
        }
        let size = usize::from_str_radix(&text(124..136), 8).map_err(|_| fault("has a member of no size"))?;
        let (Some(content), Some(next)) = (tail.get(..size), tail.get(size.div_ceil(512) * 512..)) else {
            return Err(fault("ends early"));
        };
        members.push((text(0..100), content.to_vec()));
        rest = next;
    }
    Err(fault("ends early"))
}

/// The sides and the content of a NumPy file (format 1.0, C order) of an element type such as `|u1` or `<f4`.
///
/// # Errors
/// What is not as it must be.
pub fn npy<'a>(bytes: &'a [u8], kind: &str, size: usize) -> Result<(Vec<usize>, &'a [u8]), Problem> {
    let length = bytes.get(8..10).map_or(0, |b| usize::from(b[0]) | usize::from(b[1]) << 8);
    let head = bytes.get(10..10 + length).filter(|_| bytes.starts_with(b"\x93NUMPY\x01\x00"));
    let head = String::from_utf8_lossy(head.ok_or("is no NumPy file of format 1.0")?).to_string();
    if !head.contains(&format!("'descr': '{kind}'")) || !head.contains("'fortran_order': False") {
        return Err(format!("is no array of {kind} in C order"));
    }
    let sides = head.split_once("'shape': (").and_then(|(_, rest)| rest.split_once(')'));
    let sides = sides.ok_or("has no shape")?.0.split(',').map(str::trim).filter(|side| !side.is_empty());
    let sides: Result<Vec<usize>, _> = sides.map(str::parse).collect();
    let sides = sides.map_err(|_| "has no shape")?;
    let count = sides.iter().try_fold(size, |all, side| all.checked_mul(*side));
    let content = &bytes[10 + length..];
    if count != Some(content.len()) {
        return Err(format!("has {} bytes for the shape {sides:?}", content.len()));
    }
    Ok((sides, content))
}
