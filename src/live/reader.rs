//! A source read by a thread of its own, with a queue that keeps the newest frames.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::source::{ArrivedFrame, LiveSource, SourceInfo};

/// Between two tries to open a device that is gone: five in the second that it may take to be back.
const RETRY: Duration = Duration::from_millis(200);

/// What comes out of a [`LiveReader`].
#[derive(Debug)]
pub enum LiveEvent {
    /// A frame, and how many were pushed out of the queue since the last one.
    Frame(ArrivedFrame, u64),
    /// The device is gone, and why.
    Unplugged(String),
    /// It is back, after so long, with what it says of itself.
    Replugged(Duration, Box<SourceInfo>),
    /// The source has ended, and why where it was not its own end.
    Ended(Option<String>),
}

#[derive(Default)]
struct Queue {
    events: VecDeque<LiveEvent>,
    frames: usize,
    pushed_out: u64,
    has_ended: bool,
}

#[derive(Default)]
struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
    is_stopped: AtomicBool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds an event. A full queue loses its oldest frame, never an event of another kind.
    fn push(&self, event: LiveEvent, max_frames: usize) {
        let mut queue = self.lock();
        if matches!(event, LiveEvent::Frame(..)) {
            if queue.frames >= max_frames
                && let Some(oldest) = queue.events.iter().position(|e| matches!(e, LiveEvent::Frame(..)))
            {
                queue.events.remove(oldest);
                queue.frames -= 1;
                queue.pushed_out += 1;
            }
            queue.frames += 1;
        }
        queue.has_ended |= matches!(event, LiveEvent::Ended(_));
        queue.events.push_back(event);
        drop(queue);
        self.changed.notify_one();
    }
}

/// Reads a source as fast as it gives frames, whatever is done with them.
pub struct LiveReader {
    shared: Arc<Shared>,
}

impl LiveReader {
    /// Starts the thread; the queue holds `max_frames` at most.
    ///
    /// # Errors
    /// The system has no thread.
    pub fn start(mut source: Box<dyn LiveSource>, max_frames: usize) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        thread::Builder::new().name("frames".into()).spawn(move || {
            // a fault of a driver's library must end the reading with a word, not leave it waiting
            let shared = &*of_thread;
            let read = std::panic::AssertUnwindSafe(|| read(&mut *source, shared, max_frames.max(1)));
            if std::panic::catch_unwind(read).is_err() {
                shared.push(LiveEvent::Ended(Some("reading the device failed inside".into())), max_frames);
            }
        })?;
        Ok(Self { shared })
    }

    /// The next event; `None` where none came in time, or after the end.
    pub fn next(&self, wait: Duration) -> Option<LiveEvent> {
        let until = Instant::now() + wait;
        let mut queue = self.shared.lock();
        loop {
            if let Some(mut event) = queue.events.pop_front() {
                if let LiveEvent::Frame(_, pushed_out) = &mut event {
                    queue.frames -= 1;
                    *pushed_out = std::mem::take(&mut queue.pushed_out);
                }
                return Some(event);
            }
            let left = until.checked_duration_since(Instant::now())?;
            if queue.has_ended {
                return None;
            }
            let (guard, _) =
                self.shared.changed.wait_timeout(queue, left).unwrap_or_else(PoisonError::into_inner);
            queue = guard;
        }
    }
}

impl Drop for LiveReader {
    fn drop(&mut self) {
        // a thread that waits for a camera ends with the next frame, or with the program
        self.shared.is_stopped.store(true, Ordering::Relaxed);
    }
}

fn read(source: &mut dyn LiveSource, shared: &Shared, max_frames: usize) {
    while !shared.is_stopped.load(Ordering::Relaxed) {
        match source.next_frame() {
            Ok(Some(frame)) => shared.push(LiveEvent::Frame(frame, 0), max_frames),
            Ok(None) => return shared.push(LiveEvent::Ended(None), max_frames),
            Err(lost) if !source.comes_back() => {
                return shared.push(LiveEvent::Ended(Some(lost.0)), max_frames);
            }
            Err(lost) => {
                let since = Instant::now();
                shared.push(LiveEvent::Unplugged(lost.0), max_frames);
                while source.reopen().is_err() {
                    thread::sleep(RETRY);
                    if shared.is_stopped.load(Ordering::Relaxed) {
                        return;
                    }
                }
                let info = Box::new(source.info().clone());
                shared.push(LiveEvent::Replugged(since.elapsed(), info), max_frames);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::Picture;
    use crate::source::{FrameData, SourceLost};

    /// Gives frames at once, then is gone for some tries, then gives the rest.
    struct Burst {
        number: u64,
        gone: u32,
        info: SourceInfo,
    }

    impl LiveSource for Burst {
        fn info(&self) -> &SourceInfo {
            &self.info
        }

        fn next_frame(&mut self) -> Result<Option<ArrivedFrame>, SourceLost> {
            if self.number == 20 && self.gone > 0 {
                return Err(SourceLost("gone".into()));
            }
            if self.number == 30 {
                return Ok(None);
            }
            let number = self.number;
            self.number += 1;
            let picture = Picture { width: 1, height: 1, channels: 1, bytes: vec![0] };
            let data = FrameData::Pixels(Arc::new(picture));
            Ok(Some(ArrivedFrame { number, time_s: 0.0, complete: Instant::now(), data, file: None }))
        }

        fn reopen(&mut self) -> Result<(), SourceLost> {
            self.gone -= 1;
            if self.gone == 0 { Ok(()) } else { Err(SourceLost("gone".into())) }
        }
    }

    #[test]
    fn a_stream_that_breaks_off_ends() {
        let stream = std::io::Cursor::new(b"P6 640 480 255\ncut off".to_vec());
        let reader = LiveReader::start(Box::new(crate::source::PictureStream::new(stream)), 4).unwrap();
        let event = reader.next(Duration::from_secs(60)).unwrap();
        assert!(matches!(&event, LiveEvent::Ended(Some(why)) if !why.is_empty()), "{event:?}");
    }

    #[test]
    fn a_full_queue_keeps_the_newest_and_counts_the_others() {
        let source = Burst { number: 0, gone: 2, info: SourceInfo::default() };
        let reader = LiveReader::start(Box::new(source), 4).unwrap();
        // all is in the queue once the end is
        while !reader.shared.lock().has_ended {
            thread::sleep(Duration::from_millis(1));
        }
        let (mut numbers, mut pushed_out, mut others) = (Vec::new(), 0, Vec::new());
        while let Some(event) = reader.next(Duration::from_secs(9)) {
            match event {
                LiveEvent::Frame(frame, lost) => {
                    numbers.push(frame.number);
                    pushed_out += lost;
                }
                LiveEvent::Unplugged(_) => others.push("unplugged"),
                LiveEvent::Replugged(..) => others.push("replugged"),
                LiveEvent::Ended(why) => others.push(if why.is_none() { "ended" } else { "failed" }),
            }
        }
        assert_eq!(numbers, [26, 27, 28, 29]);
        assert_eq!(pushed_out, 26);
        assert_eq!(others, ["unplugged", "replugged", "ended"]);
    }
}
