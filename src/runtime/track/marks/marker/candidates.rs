//! Candidates for a marker: places whose middle is brighter than what is around.

use glam::DVec2;

use super::view::{GROUND_PX, MarkerView};
use crate::track::frame::Plane;
pub(super) use crate::track::options::MIN_MARKER_RISE_LEVELS as MIN_RISE;

/// Steps from a place in a disc to its middle.
const CENTER_STEPS: u32 = 6;
/// Searches farther than this look at every other pixel, px: markers are wider than that.
const COARSE_REACH_PX: i32 = 24;

/// A place that may be a marker.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::track) struct Candidate {
    /// By what part of itself the middle is brighter than what is around.
    pub rise: f64,
    /// Its middle.
    pub at_px: DVec2,
}

impl MarkerView {
    /// Levels of the middle and of what is around, where the first is brighter.
    fn levels(&self, plane: &Plane<'_>, x: i32, y: i32) -> Option<[f64; 2]> {
        let mut middle = 0;
        for dy in -1..=1 {
            for dx in -1..=1 {
                middle += i32::from(plane.at(x + dx, y + dy));
            }
        }
        // The fourth brightest around: three may fall on the dome beside; between dots, or on an edge, four and more are
        // as bright as the middle.
        let mut top = [0; 4];
        for [dx, dy] in self.around_px {
            let mut value = i32::from(plane.at(x + dx, y + dy));
            for place in &mut top {
                if value > *place {
                    std::mem::swap(&mut value, place);
                }
            }
            if 9 * top[3] >= middle {
                return None;
            }
        }
        Some([f64::from(middle) / 9.0, f64::from(top[3])])
    }

    /// By what part of itself the middle is brighter than what is around; `None` where that is not enough for a marker.
    ///
    /// A part, not levels: a dim marker before the dark rises by less than a bright patch between two dots does.
    fn rise(&self, plane: &Plane<'_>, x: i32, y: i32) -> Option<f64> {
        let [middle, around] = self.levels(plane, x, y)?;
        (middle - around >= MIN_RISE).then(|| (middle - around) / (middle + MIN_RISE))
    }

    /// The middle of what is as bright as a place, in an outline of the marker's size that moves with it.
    fn center(&self, plane: &Plane<'_>, start: DVec2) -> DVec2 {
        let (x, y) = (start.x.round() as i32, start.y.round() as i32);
        let Some([middle, around]) = self.levels(plane, x, y) else { return start };
        let level = 0.5 * (middle + around);
        let mut at = start;
        for _ in 0..CENTER_STEPS {
            let (cx, cy) = (at.x.round() as i32, at.y.round() as i32);
            let (mut sum, mut count) = (DVec2::ZERO, 0.0);
            for y in cy - self.half_px..=cy + self.half_px {
                for x in cx - self.half_px..=cx + self.half_px {
                    let place = DVec2::new(f64::from(x), f64::from(y));
                    let inside = (self.mm_by_px * (place - at)).length() <= 1.1 * self.radius_mm;
                    if inside && f64::from(plane.at(x, y)) > level {
                        sum += place;
                        count += 1.0;
                    }
                }
            }
            if count == 0.0 {
                return start;
            }
            let next = sum / count;
            let moved = next.distance(at);
            at = next;
            if moved < 0.3 {
                break;
            }
        }
        at
    }

    /// The places within `reach_px` of `start` that look most like a marker, the best first, at least its own size
    /// apart. Returns how many of `out` are filled.
    pub fn candidates(&self, plane: &Plane<'_>, start: DVec2, reach_px: f64, out: &mut [Candidate]) -> usize {
        let mut count = 0;
        let (cx, cy) = (start.x.round() as i32, start.y.round() as i32);
        let reach = reach_px.clamp(1.0, 2000.0).ceil() as i32;
        let step = if reach > COARSE_REACH_PX { 2 } else { 1 };
        let apart_px = 1.4 * f64::from(self.half_px) - GROUND_PX;
        let rows = (cy - reach).max(1)..=(cy + reach).min(plane.height() as i32 - 2);
        for y in rows.step_by(step) {
            let columns = (cx - reach).max(1)..=(cx + reach).min(plane.width() as i32 - 2);
            for x in columns.step_by(step) {
                let level = plane.at(x, y);
                if level < MIN_RISE as u8 {
                    continue;
                }
                let at_px = DVec2::new(f64::from(x), f64::from(y));
                if at_px.distance(start) > reach_px {
                    continue;
                }
                if let Some(rise) = self.rise(plane, x, y) {
                    keep_best(out, &mut count, Candidate { rise, at_px }, apart_px);
                }
            }
        }
        out[..count].sort_unstable_by(|a, b| b.rise.total_cmp(&a.rise));
        // A disc is as bright all over: where in it the scan met it first says little.
        for candidate in &mut out[..count] {
            candidate.at_px = self.center(plane, candidate.at_px);
        }
        count
    }
}

/// Puts a candidate into the first `count` of a list: in the place of a worse one nearby, else at the end, else in the
/// place of the worst.
fn keep_best(out: &mut [Candidate], count: &mut usize, new: Candidate, apart_px: f64) {
    match out[..*count].iter().position(|known| known.at_px.distance(new.at_px) < apart_px) {
        Some(i) if out[i].rise < new.rise => out[i] = new,
        Some(_) => {}
        None if *count < out.len() => {
            out[*count] = new;
            *count += 1;
        }
        None => {
            let worst = (0..*count).min_by(|a, b| out[*a].rise.total_cmp(&out[*b].rise));
            if let Some(i) = worst.filter(|i| out[*i].rise < new.rise) {
                out[i] = new;
            }
        }
    }
}
