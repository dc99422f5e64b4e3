//! Gains follow the frames before: frames that are drawn in any order are developed as soon as all before them are drawn.

use std::collections::BTreeMap;

use crate::electronics::exposure::Metering;
use crate::electronics::pass::Gains;
use crate::output::drawn::Exposed;

/// A frame that can be developed.
pub(super) type Ready = (u32, Exposed, Gains);

/// Frames on their way from light to code.
pub(super) struct InOrder<'a> {
    metering: &'a Metering,
    /// The next frame, and its gains.
    next: (u32, Gains),
    waiting: BTreeMap<u32, Exposed>,
}

impl<'a> InOrder<'a> {
    /// Before the first frame.
    pub fn new(metering: &'a Metering) -> Self {
        Self { metering, next: (0, metering.first()), waiting: BTreeMap::new() }
    }

    /// Takes a frame; what can be developed now, in order. Without gains that follow, that frame at once.
    pub fn ready(&mut self, number: u32, exposed: Exposed) -> Vec<Ready> {
        if !self.metering.is_used() {
            return vec![(number, exposed, Gains::default())];
        }
        self.waiting.insert(number, exposed);
        let mut ready = Vec::new();
        while let Some(exposed) = self.waiting.remove(&self.next.0) {
            let (number, gains) = self.next;
            let next = exposed.meter.as_ref().map_or(gains, |meter| self.metering.next(gains, meter));
            self.next = (number + 1, next);
            ready.push((number, exposed, gains));
        }
        ready
    }
}
