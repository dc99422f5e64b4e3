//! Rows shared out among threads. What comes out of a row hangs on its own input alone and sums are added up in the order of rows, so
//! the bytes are the same for any number of threads.

use std::sync::atomic::{AtomicBool, Ordering};

/// Rows of cells that a thread takes at once, at least.
pub(super) const MIN_ROWS: usize = 24;

/// How often the thread that stays awake looks for work before it lets others have its core, some microseconds.
const MAX_IDLE: u32 = 64;

/// Fewest items that a thread takes at once, of so many: all of them where there is one thread, so that nothing waits for another.
pub(crate) fn share(min_rows: usize) -> usize {
    if rayon::current_num_threads() < 2 { usize::MAX } else { min_rows }
}

/// Runs the work of a frame on threads of rayon's, where there are several. It is many short pieces, between which a thread that
/// has nothing to do would fall asleep, and to wake it takes longer than a piece: so one more stays awake until the frame is done.
pub(crate) fn run<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    if rayon::current_num_threads() < 2 {
        return work();
    }
    let is_done = Done(AtomicBool::new(false));
    let stay_awake = || {
        let mut idle = 0;
        while !is_done.0.load(Ordering::Acquire) {
            if rayon::yield_now() == Some(rayon::Yield::Executed) {
                idle = 0;
            } else if idle < MAX_IDLE {
                idle += 1;
                std::hint::spin_loop();
            } else {
                // Where cores are scarce the frame's own thread may wait for this one.
                std::thread::yield_now();
            }
        }
    };
    let run = || {
        let _ends = Ends(&is_done);
        work()
    };
    rayon::join(run, stay_awake).0
}

/// Whether the frame is done.
struct Done(AtomicBool);

/// Says so when it is dropped: after a panic too.
struct Ends<'a>(&'a Done);

impl Drop for Ends<'_> {
    fn drop(&mut self) {
        self.0.0.store(true, Ordering::Release);
    }
}
