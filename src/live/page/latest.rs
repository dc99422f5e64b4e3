//! A place for one value, of which only the newest counts.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The newest value and its number.
pub(super) struct Latest<T> {
    value: Mutex<(u64, Option<T>)>,
    changed: Condvar,
}

impl<T> Default for Latest<T> {
    fn default() -> Self {
        Self { value: Mutex::new((0, None)), changed: Condvar::new() }
    }
}

impl<T: Clone> Latest<T> {
    fn lock(&self) -> MutexGuard<'_, (u64, Option<T>)> {
        self.value.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts a value in place of the last one.
    pub fn set(&self, value: T) {
        let mut place = self.lock();
        // the old one is dropped after the lock
        let _old = place.1.replace(value);
        place.0 += 1;
        drop(place);
        self.changed.notify_all();
    }

    /// Wakes who waits.
    pub fn wake(&self) {
        self.changed.notify_all();
    }

    /// A value newer than the one of this number, with its own; `None` where none came in time.
    pub fn newer(&self, than: u64, wait: Duration) -> Option<(u64, T)> {
        let place = self.lock();
        let waited = self.changed.wait_timeout_while(place, wait, |place| place.0 <= than);
        let (place, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let (number, value) = &*place;
        if *number > than { value.clone().map(|value| (*number, value)) } else { None }
    }
}
