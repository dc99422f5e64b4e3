//! The dots of a reading, as the forces take them.

use super::forces::ForceDistribution;
use super::model::Dot;
use super::posterior::USUAL_DOT_SD_PX;
use crate::track::{DotResult, Tracked};

/// What the elastic model may be off, as a part of each dot's motion: coarse elements and small strain.
const MODEL_PART: f64 = 0.05;
/// Least standard deviation of a dot on each axis, px: what `track` is off by on clean frames, which its noise does not say.
const MIN_DOT_SD_PX: f64 = 0.01;
/// Dots whose motions' sum of squares is no more than so many deviations over that of noise have not moved.
const MIN_MOTION_OVER_SD: f64 = 4.0;
/// Dots at least that must be seen.
const MIN_DOTS: usize = 8;
/// From so many px on, an undeformed dot is not that of these constants: the two lie within some hundredths.
const FOREIGN_PX: f64 = 2.0;

impl ForceDistribution {
    /// Whether the undeformed dots of a reading are where these constants have them; every eighth is asked.
    pub(super) fn is_ours(&self, tracked: &Tracked) -> bool {
        let is_off = |(dot, found): (&Dot, &DotResult)| {
            let here = self.optics.project_deformed(dot.surface_mm).ok();
            here.zip(found.undeformed_px).is_some_and(|(here, there)| here.distance(there) > FOREIGN_PX)
        };
        let pairs = self.dots.iter().zip(&tracked.black_dots);
        self.dots.len() == tracked.black_dots.len() && !pairs.step_by(8).any(is_off)
    }

    /// Takes the dots of a frame; whether there are enough.
    pub(super) fn see(&mut self, tracked: &Tracked) -> bool {
        let (mut count, mut over) = (0, 0.0);
        for (dot, found) in self.dots.iter_mut().zip(&tracked.black_dots) {
            dot.per_sd = 0.0;
            let Some((now, rest)) = found.image_px.zip(found.undeformed_px) else { continue };
            dot.seen_px = now - rest;
            let sd_px = found.sd_px.unwrap_or(USUAL_DOT_SD_PX).max(MIN_DOT_SD_PX);
            let off_px = MODEL_PART * dot.seen_px.length();
            dot.per_sd = 1.0 / (sd_px * sd_px + off_px * off_px).sqrt();
            over += dot.seen_px.length_squared() / (sd_px * sd_px);
            count += 1;
        }
        // Of 2 n squares of noise the sum is 2 n, and the deviation of that the root of 4 n.
        let squares = 2.0 * count as f64;
        self.is_moved = over > squares + MIN_MOTION_OVER_SD * (2.0 * squares).sqrt();
        count >= MIN_DOTS.min(self.dots.len())
    }
}
