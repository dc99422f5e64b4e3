//! The skin's heights, measured beside the reading, once for all who want them.

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use rayon::ThreadPoolBuilder;

use crate::reading::LiveReading;
use domecast_runtime::shape::ShapeFromColor;

/// Measures heights in a thread of its own: of the newest frame whenever it is free, so that no reading waits for it.
pub struct HeightReader {
    wanted: Option<Sender<LiveReading>>,
    measured: Receiver<LiveReading>,
    is_busy: bool,
}

impl HeightReader {
    /// Starts the thread.
    ///
    /// # Errors
    /// The system has none.
    pub fn start(mut skin: ShapeFromColor) -> io::Result<Self> {
        let (wanted, of_thread) = channel::<LiveReading>();
        let (found, measured) = channel();
        // A pool of one: rows are not shared out, for the other cores are the readings'.
        let pool = ThreadPoolBuilder::new().num_threads(1).thread_name(|_| "heights".into());
        let pool = pool.panic_handler(|_| ()).build().map_err(io::Error::other)?;
        pool.spawn(move || {
            for mut reading in of_thread {
                reading.skin = reading.picture.as_deref().and_then(|picture| {
                    let map = skin.measure(&picture.frame().ok()?, &reading.tracked).ok()?;
                    Some(Arc::new(map.clone()))
                });
                if found.send(reading).is_err() {
                    return;
                }
            }
        });
        Ok(Self { wanted: Some(wanted), measured, is_busy: false })
    }

    /// Hands a reading over, if the thread is free; it never waits. Whatever is handed over is taken once, with its skin or
    /// without where its frame shows none.
    pub fn offer(&mut self, reading: impl FnOnce() -> LiveReading) {
        // one is measured, none waits: what would wait is no longer the newest
        if let (false, Some(wanted)) = (self.is_busy, &self.wanted) {
            self.is_busy = wanted.send(reading()).is_ok();
        }
    }

    /// The reading that was handed over, if it is measured by now.
    pub fn take(&mut self) -> Option<LiveReading> {
        let reading = self.measured.try_recv().ok();
        self.is_busy &= reading.is_none();
        reading
    }

    /// The last one, waited for.
    pub fn finish(mut self) -> Option<LiveReading> {
        // the thread ends once nobody can want anything
        self.wanted = None;
        self.measured.recv().ok()
    }
}
