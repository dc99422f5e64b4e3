//! How the light falls off across a marker, over the frames.

use glam::DVec2;

/// How the light falls off across a marker, over the frames in which it was seen.
///
/// A lens darkens its corners and a lamp one side: a disc that is brighter on one side is fitted too far there. One
/// frame's slope is noisy; but it stays, and the mean over some frames is not.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tilt {
    mean: DVec2,
    frames: f64,
}

/// Frames that a slope of the light is averaged over.
const TILT_FRAMES: f64 = 100.0;
/// Frames' worth of belief that there is none.
const LEVEL_FRAMES: f64 = 1.0;
/// Steeper than this in a px, a disc is lit by something else than a lens's or a lamp's fall-off.
const MOST_TILT: f64 = 0.05;

impl Tilt {
    /// What is known of it.
    pub fn known(&self) -> DVec2 {
        self.mean * (self.frames / (self.frames + LEVEL_FRAMES))
    }

    /// Takes in what a frame shows.
    pub fn add(&mut self, seen: Option<DVec2>) {
        if let Some(seen) = seen.filter(|seen| seen.length() < MOST_TILT) {
            self.frames = (self.frames + 1.0).min(TILT_FRAMES);
            self.mean += (seen - self.mean) / self.frames;
        }
    }
}
