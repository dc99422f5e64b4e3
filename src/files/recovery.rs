//! What a stopped run left, ended by the next one; and what a signal ends.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

use super::staging::{PREFIX, recover_one};

/// Folders above what a command names in which a result of it may have been made.
const MAX_LEVELS: usize = 5;

/// Ends what stopped runs left in the working folder, in `output`, and beside what `arguments` name: a result that was
/// being made is removed, one that was being replaced is whole in its place. Returns what was done, a sentence each.
pub fn recover(arguments: impl IntoIterator<Item = OsString>) -> Vec<String> {
    let mut places: BTreeSet<PathBuf> = BTreeSet::new();
    for (named, levels) in [(Path::new("."), 1), (Path::new("output"), 1)] {
        places.extend(levels_of(named, levels));
    }
    for argument in arguments {
        let value = match argument.to_str().and_then(|text| text.strip_prefix("--")) {
            Some(option) => OsString::from(option.split_once('=').map_or("", |(_, value)| value)),
            None => argument,
        };
        if !value.is_empty() {
            places.extend(levels_of(Path::new(&value), MAX_LEVELS));
        }
    }
    let mut notes = Vec::new();
    for place in places {
        let Ok(entries) = fs::read_dir(&place) else { continue };
        let ours = |name: &OsString| name.to_str().is_some_and(|name| name.starts_with(PREFIX));
        let mut left: Vec<OsString> =
            entries.filter_map(|entry| Some(entry.ok()?.file_name())).filter(ours).collect();
        left.sort();
        notes.extend(left.iter().filter_map(|name| recover_one(&place.join(name))));
    }
    notes
}

/// A path and folders above it.
fn levels_of(path: &Path, levels: usize) -> Vec<PathBuf> {
    let full = std::path::absolute(path).unwrap_or_default();
    full.ancestors().take(levels).map(Path::to_path_buf).collect()
}

/// Whether an interrupt is taken as a wish to stop soon, and whether one came.
static IS_HEEDED: AtomicBool = AtomicBool::new(false);
static IS_WISHED: AtomicBool = AtomicBool::new(false);

/// While it lives, the first interrupt (Ctrl-C) after [`tidy_on_signals`] ends nothing: the work is to look whether it came,
/// and to end with what it has. The second ends the program as ever.
#[derive(Debug)]
pub struct StopWish(());

impl StopWish {
    /// From now on.
    pub fn heed() -> Self {
        IS_WISHED.store(false, Relaxed);
        IS_HEEDED.store(true, Relaxed);
        Self(())
    }

    /// Whether an interrupt came.
    pub fn came(&self) -> bool {
        IS_WISHED.load(Relaxed)
    }
}

impl Drop for StopWish {
    fn drop(&mut self) {
        IS_HEEDED.store(false, Relaxed);
    }
}

/// From now on an interrupt (Ctrl-C) or a request to terminate first removes the results that are being made. For the
/// program: a library that took its user's signals would surprise them.
///
/// On Windows nothing is done: there the next run removes them.
pub fn tidy_on_signals() {
    #[cfg(unix)]
    {
        use signal_hook::consts::{SIGINT, SIGTERM};
        use signal_hook::iterator::Signals;
        let Ok(mut signals) = Signals::new([SIGINT, SIGTERM]) else { return };
        std::thread::spawn(move || {
            let is_wish = |signal: &i32| *signal == SIGINT && IS_HEEDED.load(Relaxed);
            if let Some(signal) =
                signals.forever().find(|signal| !is_wish(signal) || IS_WISHED.swap(true, Relaxed))
            {
                super::staging::abandon_all();
                // ends the process as the signal would have, so that a shell sees it
                let _ = signal_hook::low_level::emulate_default_handler(signal);
                std::process::exit(128 + signal);
            }
        });
    }
}
