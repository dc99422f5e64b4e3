//! Which entries of a folder an earlier sequence put there.

use super::parts::{PLAN_NAME, TRUTH_NAME, VIDEO_NAME};

/// The first of a folder's entries that is not part of an earlier, complete sequence; `None` for an empty folder.
pub(super) fn foreign_entry(entries: &[String]) -> Option<String> {
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
    let complete = entries.iter().any(|name| name == TRUTH_NAME);
    entries.iter().find(|name| !complete || !ours(name)).cloned()
}
