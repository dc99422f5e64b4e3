//! A reading with its frame, for those who show and keep it.

use std::sync::Arc;

use crate::decode::Picture;
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::Tracked;

/// A reading with its frame.
#[derive(Debug, Clone)]
pub struct LiveReading {
    /// The frame; `None` where it could not be read.
    pub picture: Option<Arc<Picture>>,
    /// What is tracked in it.
    pub tracked: Tracked,
    /// The skin in it, where it is measured.
    pub skin: Option<Arc<ShapeMap>>,
    /// How old the reading was, ms.
    pub age_ms: f64,
    /// Frames a second, lately.
    pub rate_hz: f64,
    /// Frames that were pushed out of the queue so far.
    pub dropped: u64,
    /// What a model says of the hardness, in words; `None` without a model.
    pub hardness: Option<String>,
    /// What the device is: `ok`, `unplugged`, or what is wrong with all frames.
    pub device: &'static str,
}
