//! Whether a frame is torn: the dots above a row moved, those below it did not, or otherwise.

use glam::DVec2;

use super::smooth_motion::{MotionSums, Terms, affine_terms};
use crate::track::identities::DotTrack;

/// Rows at which a tear is looked for.
const ROWS: usize = 24;
/// Fewest dots on each side of it.
const MIN_SIDE: usize = 6;
/// Fewest dots, and least rms of their motion beside an affine one, px, that are looked at.
const MIN_DOTS: usize = 24;
const MIN_ROUGH_PX: f64 = 0.05;
/// A tear moves one side by this against the other, px, and explains this part of what an affine motion does not.
const MIN_STEP_PX: f64 = 0.12;
const MIN_SHARE: f64 = 0.6;

/// Compares the dots with the last frame that was whole; keeps its buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct TearCheck {
    whole_px: Vec<Option<DVec2>>,
    /// Place, and motion beside the affine one.
    moved: Vec<(Terms, DVec2)>,
}

impl TearCheck {
    /// For so many dots.
    pub fn new(dots: usize) -> Self {
        Self { whole_px: vec![None; dots], moved: Vec::with_capacity(dots) }
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        self.whole_px.fill(None);
    }

    /// Whether the frame is torn. If not, the next one is compared with it.
    pub fn is_torn(&mut self, tracks: &[DotTrack], middle_px: DVec2) -> bool {
        let is_torn = self.find(tracks, middle_px).is_some();
        if !is_torn {
            for (whole, track) in self.whole_px.iter_mut().zip(tracks) {
                *whole = if track.fault.is_none() { track.now_px() } else { None };
            }
        }
        is_torn
    }

    /// The step across the row that explains most of what no affine motion does.
    fn find(&mut self, tracks: &[DotTrack], middle_px: DVec2) -> Option<DVec2> {
        self.moved.clear();
        let mut sums = MotionSums::affine();
        for (track, whole) in tracks.iter().zip(&self.whole_px) {
            let (Some(now), Some(whole), None) = (track.now_px(), whole, track.fault) else { continue };
            let (place, motion) = (affine_terms(now, middle_px), now - *whole);
            sums.add(&place, motion);
            self.moved.push((place, motion));
        }
        let affine = sums.solve(MIN_DOTS)?;
        let mut left = 0.0;
        for (place, motion) in &mut self.moved {
            *motion -= affine.at(place);
            left += motion.length_squared();
        }
        if left < self.moved.len() as f64 * MIN_ROUGH_PX * MIN_ROUGH_PX {
            return None;
        }
        let mut best: Option<(f64, DVec2)> = None;
        for row in 1..ROWS {
            let at = 2.0 * row as f64 / ROWS as f64 - 1.0;
            let (mut below, mut sum, mut moment) = (0, Terms::zeros(), DVec2::ZERO);
            for (place, rest) in self.moved.iter().filter(|(place, _)| place[2] > at) {
                below += 1;
                sum += place;
                moment += *rest;
            }
            if below < MIN_SIDE || self.moved.len() - below < MIN_SIDE {
                continue;
            }
            // The part of the step that no affine motion has.
            let spread = below as f64 - sum.dot(&(affine.inverse * sum));
            if spread > 1e-6 && best.is_none_or(|(gain, _)| moment.length_squared() / spread > gain) {
                best = Some((moment.length_squared() / spread, moment / spread));
            }
        }
        best.filter(|(gain, step)| *gain > MIN_SHARE * left && step.length() > MIN_STEP_PX)
            .map(|(_, step)| step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::marks::DarkSpot;

    fn dots(moved: impl Fn(DVec2) -> DVec2) -> Vec<DotTrack> {
        let at = |i: usize| DVec2::new(40.0 + 50.0 * (i % 10) as f64, 30.0 + 50.0 * (i / 10) as f64);
        let spot = |i: usize| DarkSpot { at_px: at(i) + moved(at(i)), ..DarkSpot::default() };
        (0..90).map(|i| DotTrack { spot: Some(spot(i)), ..DotTrack::default() }).collect()
    }

    #[test]
    fn a_step_across_a_row_is_a_tear_and_other_motions_are_none() {
        let middle = DVec2::new(320.0, 240.0);
        let mut check = TearCheck::new(90);
        assert!(!check.is_torn(&dots(|_| DVec2::ZERO), middle));
        assert!(check.is_torn(&dots(|at| if at.y > 200.0 { DVec2::X } else { DVec2::ZERO }), middle));
        // The torn frame does not count: the next one is compared with the one before.
        assert!(!check.is_torn(&dots(|at| DVec2::new(2.0 + 0.01 * at.y, 0.003 * at.x)), middle));
        check.restart();
        check.is_torn(&dots(|_| DVec2::ZERO), middle);
        let press = |at: DVec2| {
            (at - DVec2::new(300.0, 200.0))
                * 0.1
                * (-at.distance_squared(DVec2::new(300.0, 200.0)) / 8e3).exp()
        };
        assert!(!check.is_torn(&dots(press), middle));
    }
}
