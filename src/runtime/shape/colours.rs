//! Whether a frame's colours come in the order of the constants' light, and of the frame at rest, and from all the lights of that.

use glam::Vec3A;
use rayon::prelude::*;

use super::error::ShapeError;
use super::estimator::ShapeFromColor;
use super::options::ShapeOptions;
use super::rest::{OTHER_ORDERS, Seen, seen};
use super::rows::share;
use crate::constants::Constants;
use crate::track::{CameraFrame, Tracked, Tracker};
use domecast_light::tables::{Prepared, SourceTables};

/// Every seventh cell is asked, in as many parts.
const STEP: usize = 7;
const PARTS: usize = 4;

/// The part of their misfit that another order must leave to be taken for theirs.
const OTHER_ORDER: f32 = 0.5;

/// By so many times coarser than those that heights are read with are the tables of the light that shows the order of colours.
const COARSER: usize = 4;

/// Refuses a frame whose colours lie over the dome as the constants' light does only in another order; `tracker`
/// has just followed it. `false` where this frame does not tell (it is not `ok`): ask with the next one. Takes some tenths of a
/// second, so ask once.
///
/// # Errors
/// [`ShapeError`] with the order that they are in, in `colour_order`.
pub fn are_colours_judged(
    constants: &Constants,
    tracker: &Tracker,
    frame: &CameraFrame<'_>,
) -> Result<bool, ShapeError> {
    if constants.light.is_none() || frame.channels() != 3 {
        return Ok(true);
    }
    let tracked = tracker.result();
    if !tracked.problems.is_empty() {
        return Ok(false);
    }
    let shape = ShapeFromColor::prepared_by(constants, tracker, ShapeOptions::default(), &|ways, _| {
        let coarse = |source| SourceTables::new(ways, source, COARSER);
        let sources: Vec<_> = ways.sources.iter().map(coarse).collect();
        Prepared::of(&sources.iter().collect::<Vec<_>>(), Prepared::default().rooms(ways))
    });
    match shape.and_then(|mut shape| shape.set_rest(frame, tracked)) {
        Err(error) if error.colour_order.is_some() => Err(error),
        _ => Ok(true),
    }
}

impl ShapeFromColor {
    /// Refuses a frame whose colours are those at rest only in another order: a touch changes some of the skin, never all of it so.
    pub(super) fn check_colours(&self) -> Result<(), ShapeError> {
        // Parts of the picture, so that their sums are the same for any number of threads.
        let mut parts = [[0.0_f32; 6]; PARTS];
        let count = self.cells.count();
        parts.par_iter_mut().enumerate().with_min_len(share(1)).for_each(|(part, off)| {
            let cells = (0..count).skip(STEP * part).step_by(STEP * PARTS);
            for Seen { cell, expected, level, .. } in
                seen(&self.levels, &self.covered, &self.view, &self.light, cells)
            {
                let at_rest = self.gain[cell] * expected;
                for (off, [r, g, b]) in off.iter_mut().zip(std::iter::once([0, 1, 2]).chain(OTHER_ORDERS)) {
                    let difference = (Vec3A::new(level[r], level[g], level[b]) - at_rest).abs();
                    *off += if difference.is_finite() { difference.element_sum() } else { 0.0 };
                }
            }
        });
        let off: [f32; 6] = std::array::from_fn(|k| parts.iter().map(|part| part[k]).sum());
        let smallest = off.into_iter().fold(f32::INFINITY, f32::min);
        if smallest < OTHER_ORDER * off[0] {
            let problem = "has its colours in another order than the frame at rest";
            let cure = "give both in the same order: red, green, blue, or say which (--raw ..:rgb or :bgr; rgb=False)";
            return Err(ShapeError::new("frame", problem, cure));
        }
        Ok(())
    }

    /// Whether a light is out that was not at rest; then nothing is known of the skin.
    pub(super) fn is_light_out(&mut self) -> bool {
        let (view, light, gain, covered) = (&self.view, &self.light, &self.gain, &self.covered);
        let is_bare = |cell: usize| view.is_dome[cell] && !covered[cell];
        let at_rest = |cell: usize, channel: usize| {
            (gain[cell] * light.passed(view.ray[cell].z) * light.still(view.place[cell]))[channel]
        };
        let mut out = std::mem::take(&mut self.map.lights_out);
        self.lights.find_out(&self.levels, light.stray, is_bare, at_rest, &mut out);
        if !out.is_empty() {
            self.map.forget();
        }
        self.map.lights_out = out;
        !self.map.lights_out.is_empty()
    }

    /// Takes out of the gain what the lights have lost.
    pub(super) fn take_out_lights(&mut self, tracked: &Tracked) {
        let radius_mm = self.optics.dome().radius_mm();
        self.lights.take_out(&self.cells, &self.view, tracked, radius_mm, &mut self.gain);
        self.map.light_gain.clear();
        self.map.light_gain.extend(self.lights.gains());
    }
}
