//! What can be said of a frame before anything is looked for: its light, whether it is new, whether it is sharp.

use super::frame::Plane;
use super::mask::Mask;

/// Every so many pixels in both directions one is looked at.
const EVERY: usize = 8;
/// A pixel from here on counts as saturated.
const SATURATED: u8 = 250;

/// A frame at a glance; keeps the last frame's samples.
#[derive(Debug, Clone, Default)]
pub(super) struct Glance {
    samples: Vec<u8>,
    before: Vec<u8>,
}

/// What the samples say.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Light {
    /// Levels that 2 %, half and 98 % of the samples are below.
    pub low: u8,
    pub middle: u8,
    pub high: u8,
    /// Part of the samples that is saturated.
    pub saturated: f64,
    /// All samples are those of the last frame.
    pub same: bool,
}

impl Glance {
    /// Looks at a frame through the mask.
    pub fn look(&mut self, plane: &Plane<'_>, mask: &Mask) -> Light {
        std::mem::swap(&mut self.samples, &mut self.before);
        self.samples.clear();
        let mut counts = [0_u32; 256];
        for y in (EVERY / 2..plane.height()).step_by(EVERY) {
            let [start, end] = mask.span(y);
            for x in (start..end).step_by(EVERY) {
                let value = plane.at(x as i32, y as i32);
                counts[usize::from(value)] += 1;
                self.samples.push(value);
            }
        }
        let total = self.samples.len() as f64;
        let below = |part: f64| {
            let mut sum = 0.0;
            counts.iter().position(|n| {
                sum += f64::from(*n);
                sum > part * total
            })
        };
        let level = |part: f64| below(part).unwrap_or(255) as u8;
        let bright: u32 = counts[usize::from(SATURATED)..].iter().sum();
        Light {
            low: level(0.02),
            middle: level(0.5),
            high: level(0.98),
            saturated: if total > 0.0 { f64::from(bright) / total } else { 0.0 },
            same: !self.samples.is_empty() && self.samples == self.before,
        }
    }

    /// Forgets the last frame.
    pub fn forget(&mut self) {
        self.samples.clear();
    }
}

/// The steepest rise over four pixels along some rows, as a part of the frame's contrast: an edge in focus takes all
/// of it in less, a blurred one does not.
pub(super) fn sharpness(plane: &Plane<'_>, mask: &Mask, light: &Light) -> f64 {
    let contrast = f64::from(light.high) - f64::from(light.low);
    let mut steepest = 0;
    for y in (EVERY / 2..plane.height()).step_by(EVERY) {
        let [start, end] = mask.span(y);
        for x in start..end.saturating_sub(4) {
            let (a, b) = (plane.at(x as i32, y as i32), plane.at(x as i32 + 4, y as i32));
            steepest = steepest.max(a.abs_diff(b));
        }
    }
    if contrast > 0.0 { f64::from(steepest) / contrast } else { 0.0 }
}
