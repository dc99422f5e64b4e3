//! The skin's heights for a recording, measured beside the reading.

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, channel, sync_channel};
use std::thread;

use crate::decode::Picture;
use domecast_runtime::shape::{ShapeFromColor, ShapeMap};
use domecast_runtime::track::{CameraFrame, Tracked};

/// A frame whose heights are wanted.
struct Wanted {
    time_ns: u64,
    picture: Arc<Picture>,
    tracked: Tracked,
}

/// Measures heights in a thread of its own: of the newest frame whenever it is free, so that no reading waits for it.
pub struct HeightReader {
    wanted: Option<SyncSender<Wanted>>,
    measured: Receiver<(u64, ShapeMap)>,
}

impl HeightReader {
    /// Starts the thread.
    ///
    /// # Errors
    /// The system has none.
    pub fn start(mut skin: ShapeFromColor) -> io::Result<Self> {
        // one is measured, none waits: what would wait is no longer the newest
        let (wanted, of_thread) = sync_channel::<Wanted>(0);
        let (found, measured) = channel();
        thread::Builder::new().name("heights".into()).spawn(move || {
            for Wanted { time_ns, picture, tracked } in of_thread {
                let frame =
                    CameraFrame::new(picture.width, picture.height, picture.channels, &picture.bytes).ok();
                let map = frame.and_then(|frame| skin.measure(&frame, &tracked).ok().cloned());
                if map.is_some_and(|map| found.send((time_ns, map)).is_err()) {
                    return;
                }
            }
        })?;
        Ok(Self { wanted: Some(wanted), measured })
    }

    /// Hands a frame over, if the thread is free; it never waits. `time_ns`: when it was taken, since 1970.
    pub fn offer(&mut self, time_ns: u64, picture: &Arc<Picture>, tracked: &Tracked) {
        let Some(wanted) = &self.wanted else { return };
        let one = Wanted { time_ns, picture: Arc::clone(picture), tracked: tracked.clone() };
        match wanted.try_send(one) {
            Ok(()) | Err(TrySendError::Full(_)) => {}
            Err(TrySendError::Disconnected(_)) => self.wanted = None,
        }
    }

    /// A map that is measured by now, with the time of its frame.
    pub fn take(&mut self) -> Option<(u64, ShapeMap)> {
        self.measured.try_recv().ok()
    }

    /// The maps of the last frames, waited for.
    pub fn finish(mut self) -> impl Iterator<Item = (u64, ShapeMap)> {
        // the thread ends once nobody can want anything
        self.wanted = None;
        self.measured.into_iter()
    }
}
