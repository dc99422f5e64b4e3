//! Hardness by contact mechanics, frame by frame of a run: each touch for itself.

use crate::physics::{Dome, Hardness, PressRow, Prior, hardness};

/// Frames of a touch that are kept; of a longer one every second, then every fourth, and so on.
const MAX_FRAMES: usize = 256;

/// The frames of the touch that goes on, and what they say together.
///
/// ```
/// use domecast_hardness::physics::{Dome, HardnessStatus, PressRow, Prior};
/// use domecast_hardness::touch::TouchHardness;
///
/// let at_mm = glam::DVec3::ZERO;
/// let dome = Dome { radius_mm: 10.0, center_mm: at_mm, young_mpa: 0.56, young_sd_mpa: 0.03, poisson: 0.49, at_mm };
/// let prior = Prior { young_mpa: [0.01, 10.0], poisson: 0.47, travel_sd_mm: 0.02, force_sd_part: 0.0 };
/// let mut touch = TouchHardness::new(dome, prior);
/// // one frame says nothing yet
/// assert_eq!(touch.push(&PressRow::default(), 0.05).status, HardnessStatus::NotMeasured);
/// ```
#[derive(Debug, Clone)]
pub struct TouchHardness {
    dome: Dome,
    prior: Prior,
    rows: Vec<PressRow>,
    /// Each so many-th frame is kept.
    every: u64,
    frames: u64,
}

impl TouchHardness {
    /// Nothing is touched yet.
    pub fn new(dome: Dome, prior: Prior) -> Self {
        Self { dome, prior, rows: Vec::with_capacity(MAX_FRAMES + 1), every: 1, frames: 0 }
    }

    /// Nothing touches: what comes is another touch.
    pub fn end(&mut self) {
        self.rows.clear();
        (self.every, self.frames) = (1, 0);
    }

    /// Frames of the touch so far.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Takes a frame of the touch in, with the standard deviation of its forces' scale as a part of them ([`Prior::force_sd_part`]); what
    /// all frames say. A row with numbers that are not finite says nothing.
    pub fn push(&mut self, row: &PressRow, force_sd_part: f64) -> Hardness {
        self.rows.push(*row);
        // the newest frame is looked at in any case
        let found = hardness(&self.rows, &self.dome, &Prior { force_sd_part, ..self.prior });
        if !self.frames.is_multiple_of(self.every) {
            self.rows.pop();
        } else if self.rows.len() > MAX_FRAMES {
            self.thin();
        }
        self.frames += 1;
        found
    }

    /// Keeps every second frame, the first and the last among them.
    fn thin(&mut self) {
        let mut at = 0;
        self.rows.retain(|_| {
            at += 1;
            at % 2 == 1
        });
        self.every *= 2;
    }
}
