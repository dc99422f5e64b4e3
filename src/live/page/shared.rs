//! What the program, the painter and the browsers' threads share.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicUsize};
use std::sync::{Arc, Mutex};

use super::latest::Latest;
use crate::decode::Picture;
use domecast_runtime::track::Tracked;

/// Wrenches at most between two pictures: 10 s at 60 Hz.
pub(super) const MAX_SAMPLES: usize = 600;

/// A reading as the page shows it.
#[derive(Debug, Clone)]
pub struct LiveReading {
    /// The frame; `None` where it could not be read.
    pub picture: Option<Arc<Picture>>,
    /// What is tracked in it.
    pub tracked: Tracked,
    /// How old the reading was, ms.
    pub age_ms: f64,
    /// Frames a second, lately.
    pub rate_hz: f64,
    /// Frames that were pushed out of the queue so far.
    pub dropped: u64,
    /// What the device is: `ok`, `unplugged`, or what is wrong with all frames.
    pub device: &'static str,
}

/// A wrench with its time, s.
pub(super) type Sample = (f64, Option<[f64; 6]>);

/// What the program, the painter and the browsers' threads share.
#[derive(Default)]
pub(super) struct Shared {
    pub reading: Latest<LiveReading>,
    pub samples: Mutex<VecDeque<Sample>>,
    /// The newest picture, as the text of an event.
    pub event: Latest<Arc<str>>,
    pub browsers: AtomicUsize,
    pub is_stopped: AtomicBool,
}
