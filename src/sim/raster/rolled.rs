//! Images of points while the rows are exposed one after the other.
//!
//! A row is exposed at its own time, so a point that moves is seen where its way in the image meets the row that is
//! exposed just then: the root of `y(t) = row(t)`. The way is known at the times of some slices of rows and linear in
//! between; each point of an outline solves for its own time, so that dots are sheared and stretched as they are in a
//! camera, without being drawn in pieces.

use std::ops::Range;

use glam::DVec2;

use crate::raster::sensor_state::SensorState;
use crate::raster::spots::{Followed, Points, Spots};
use crate::scene::Scene;
use glam::DVec3;

/// Rows that are exposed about one time, and the sensor then.
#[derive(Debug, Clone, Copy)]
pub struct Slice<'a> {
    /// Its first row.
    pub first: usize,
    /// The row after its last.
    pub end: usize,
    /// The sensor at the time of its middle.
    pub instant: &'a SensorState,
}

impl Slice<'_> {
    /// Its rows.
    pub fn rows(&self) -> Range<usize> {
        self.first..self.end
    }

    /// The row whose time is its own.
    fn middle(&self) -> f64 {
        0.5 * (self.first + self.end).saturating_sub(1) as f64
    }
}

/// How far beyond the slices' middles a way is followed straight on, in steps from one to the next: a point beyond the
/// picture is not seen, and only has to stay beyond it.
const BEYOND: f64 = 2.0;

/// Images of a scene's points over some slices.
pub struct Rolled<'a> {
    points: &'a Points,
    slices: &'a [Slice<'a>],
    /// By slice, the points on the deformed dome.
    moved: Vec<Option<Vec<Followed<DVec3>>>>,
    /// Pixels that were computed.
    count: u64,
}

impl<'a> Rolled<'a> {
    /// Over slices from the first row to the last.
    pub fn new(points: &'a Points, slices: &'a [Slice<'a>]) -> Self {
        let moved = slices.iter().map(|slice| points.moved(slice.instant)).collect();
        Self { points, slices, moved, count: 0 }
    }

    /// All images, and how many pixels of points were computed for them; `now` is where they are about the same time:
    /// what has not moved from there by more than `moved_px` is found at once.
    pub fn see(mut self, scene: &Scene, now: &Spots, moved_px: f64) -> (Spots, u64) {
        let points = self.points;
        let channels = now.channels();
        let gathered = points.gather(scene, channels, now.surface_mm.clone(), &mut |item, channel, k| {
            let near = now.dot(item, channel).map(|spot| {
                let (low, high) = spot.rows();
                self.about(low - moved_px, high + moved_px)
            });
            let all = 0..self.slices.len();
            let near = near.unwrap_or(all.clone());
            let first = self.meet(item, channel, k, near.clone());
            // Where the way leaves the slices that were looked at, all are.
            match first {
                Some((_, false)) if near != all => self.meet(item, channel, k, all).map(|(pixel, _)| pixel),
                first => first.map(|(pixel, _)| pixel),
            }
        });
        (gathered, self.count)
    }

    /// The slices whose middles enclose some rows, and one more where there is but one.
    fn about(&self, low: f64, high: f64) -> Range<usize> {
        let count = self.slices.len();
        let start = self.slices.partition_point(|slice| slice.middle() <= low).saturating_sub(1);
        let end = (self.slices.partition_point(|slice| slice.middle() < high) + 1).min(count);
        let end = end.max((start + 2).min(count));
        start.min(end.saturating_sub(2))..end
    }

    /// Where a point meets its row, and whether its way leads there within the slices (or there are none beyond).
    fn meet(&mut self, item: usize, channel: usize, k: usize, about: Range<usize>) -> Option<(DVec2, bool)> {
        let mut before: Option<(f64, DVec2)> = None;
        let mut last = None;
        for index in about.clone() {
            let (middle, pixel) = (self.slices.get(index)?.middle(), self.pixel(index, item, channel, k)?);
            // Rows that the point is ahead of the one that is exposed.
            let ahead = pixel.y - middle;
            if let Some((ahead_before, pixel_before)) = before {
                let met = along(ahead_before, ahead).map(|part| (part, pixel_before.lerp(pixel, part)));
                if let Some((part, pixel)) = met
                    && part <= 1.0
                {
                    // Before the first middle only where there is no slice before.
                    let within = part >= 0.0 || index == 1;
                    return Some((pixel, within));
                }
                last = met;
            }
            before = Some((ahead, pixel));
        }
        let (_, only) = before?;
        let at_end = about.end == self.slices.len();
        Some((last.map_or(only, |(_, pixel)| pixel), at_end))
    }

    fn pixel(&mut self, slice: usize, item: usize, channel: usize, k: usize) -> Option<DVec2> {
        self.count += 1;
        let instant = self.slices.get(slice)?.instant;
        let moved = self.moved.get(slice)?.as_ref();
        let points = moved.map_or(self.points.items(), Vec::as_slice).get(item)?;
        self.points.pixel(instant, channel, item, points, k, moved.is_some())
    }
}

/// Where between two slices (0 and 1, or beyond) a point that is so many rows ahead in each is in its row.
fn along(ahead_from: f64, ahead_to: f64) -> Option<f64> {
    let closing = ahead_from - ahead_to;
    // A point that moves with the readout or faster is never caught up with.
    (closing > 0.0).then(|| (ahead_from / closing).clamp(-BEYOND, 1.0 + BEYOND))
}
