//! What the program, the painter and the browsers' threads share.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicUsize};
use std::sync::{Arc, Mutex};

use super::latest::Latest;
use crate::reading::LiveReading;

/// Wrenches at most between two pictures: 10 s at 60 Hz.
pub(super) const MAX_SAMPLES: usize = 600;

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
