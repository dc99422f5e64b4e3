//! What a frame's levels say before any mark is looked for: its light, whether it is new, whether it is sharp.

use super::mask::Mask;
use super::plane::Plane;

/// In both directions, one of this many pixels is sampled.
const STRIDE_PX: usize = 8;
/// A pixel from this level on counts as saturated.
const SATURATED_LEVEL: u8 = 250;
/// Below this brightest level a frame is dark.
const MIN_BRIGHT_LEVEL: u8 = 24;
/// A larger part of saturated samples spoils the frame.
const MAX_SATURATED: f64 = 0.5;
/// Contrast below which there is nothing to see, levels.
const MIN_CONTRAST: u8 = 10;
/// Mean brightness of a frame over that of the last, or the other way round, from which on it jumped: lamps that flicker,
/// and cameras that follow the light in steps, do less.
const MIN_JUMP: f64 = 1.2;
/// A frame that differs from the last by less than this part of what two frames have differed by is the last one again, coded
/// anew; below so many levels a camera has no noise to tell.
const SAME_PART: f64 = 0.5;
const MIN_CHANGE: f64 = 0.2;
/// What two frames differ by is the second smallest of so many changes: the smallest may be a frame that came again. Changes
/// of the light do not count, nor those that are too large for noise, levels.
const REMEMBERED: usize = 8;
const MAX_NOISE: f64 = 8.0;
/// How two frames differ is the mean over this part of the samples, those that differ least: what moves through a picture
/// says nothing of its noise.
const QUIET_PART: f64 = 0.75;

/// Takes the exposure of frames; keeps the last frame's samples.
#[derive(Debug, Clone, Default)]
pub(crate) struct ExposureMeter {
    samples: Vec<u8>,
    before: Vec<u8>,
    /// What the samples of the last pairs of frames differed by, levels in the mean; how many pairs there were.
    changes: [f64; REMEMBERED],
    pairs: usize,
}

/// Exposure statistics of one frame, inside of the mask.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Exposure {
    /// Levels that 2 % and 98 % of the samples are below.
    pub low: u8,
    pub high: u8,
    /// Part of the samples that is saturated.
    pub saturated: f64,
    /// All samples are those of the last frame, or differ from them by less than the camera's noise.
    pub is_repeated: bool,
    /// The frame is much brighter or darker than the last.
    pub has_jumped: bool,
}

impl Exposure {
    /// Too little light to separate marks from the ground.
    pub fn is_dark(&self) -> bool {
        self.high < MIN_BRIGHT_LEVEL
    }

    /// Most of the frame is at the largest value.
    pub fn is_saturated(&self) -> bool {
        self.saturated > MAX_SATURATED
    }

    /// Nothing stands out.
    pub fn is_flat(&self) -> bool {
        self.high.saturating_sub(self.low) < MIN_CONTRAST
    }
}

impl ExposureMeter {
    /// Samples a frame inside of the mask.
    pub fn measure(&mut self, plane: &Plane<'_>, mask: &Mask) -> Exposure {
        std::mem::swap(&mut self.samples, &mut self.before);
        self.samples.clear();
        let mut counts = [0_u32; 256];
        for y in (STRIDE_PX / 2..plane.height()).step_by(STRIDE_PX) {
            let [start, end] = mask.span(y);
            for x in (start..end).step_by(STRIDE_PX) {
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
        let bright: u32 = counts[usize::from(SATURATED_LEVEL)..].iter().sum();
        let sum = |samples: &[u8]| samples.iter().map(|v| u64::from(*v)).sum::<u64>() as f64;
        let brighter = sum(&self.samples).max(1.0) / sum(&self.before).max(1.0);
        let has_before = !self.samples.is_empty() && self.samples.len() == self.before.len();
        let has_jumped = has_before && !(1.0 / MIN_JUMP..MIN_JUMP).contains(&brighter);
        Exposure {
            low: level(0.02),
            high: level(0.98),
            saturated: if total > 0.0 { f64::from(bright) / total } else { 0.0 },
            is_repeated: has_before && !has_jumped && self.is_same(),
            has_jumped,
        }
    }

    /// Whether the samples are the last ones, but for less than what always changes between two frames.
    fn is_same(&mut self) -> bool {
        let mut counts = [0_u64; 256];
        for (a, b) in self.samples.iter().zip(&self.before) {
            counts[usize::from(a.abs_diff(*b))] += 1;
        }
        if counts[0] == self.samples.len() as u64 {
            return true;
        }
        let quiet = (self.samples.len() as f64 * QUIET_PART).max(1.0) as u64;
        let (mut left, mut sum) = (quiet, 0);
        for (apart, count) in counts.into_iter().enumerate() {
            let taken = count.min(left);
            sum += taken * apart as u64;
            left -= taken;
        }
        let change = sum as f64 / quiet as f64;
        let known = self.changes.get(..self.pairs.min(REMEMBERED)).unwrap_or_default();
        // The two smallest.
        let smallest = known.iter().fold([f64::INFINITY; 2], |[first, second], change| {
            if *change < first { [*change, first] } else { [first, second.min(*change)] }
        });
        let usual = if known.len() > 1 { smallest[1] } else { 0.0 };
        let is_same = usual > MIN_CHANGE && change < SAME_PART * usual;
        if change < MAX_NOISE {
            self.changes[self.pairs % REMEMBERED] = change;
            self.pairs += 1;
        }
        is_same
    }

    /// Forgets the last frame.
    pub fn forget(&mut self) {
        self.samples.clear();
    }
}

/// The steepest rise over four pixels along some rows, as a part of the frame's contrast: an edge in focus takes all
/// of it in less, a blurred one does not.
pub(crate) fn sharpness(plane: &Plane<'_>, mask: &Mask, exposure: &Exposure) -> f64 {
    let contrast = f64::from(exposure.high) - f64::from(exposure.low);
    let mut steepest = 0;
    for y in (STRIDE_PX / 2..plane.height()).step_by(STRIDE_PX) {
        let [start, end] = mask.span(y);
        for x in start..end.saturating_sub(4) {
            let (a, b) = (plane.at(x as i32, y as i32), plane.at(x as i32 + 4, y as i32));
            steepest = steepest.max(a.abs_diff(b));
        }
    }
    if contrast > 0.0 { f64::from(steepest) / contrast } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::frame::CameraFrame;
    use crate::track::options::Channel;

    fn measured(meter: &mut ExposureMeter, level: impl Fn(usize, usize) -> u8) -> (Exposure, f64) {
        let bytes: Vec<u8> = (0..64 * 48).map(|i| level(i % 64, i / 64)).collect();
        let frame = CameraFrame::new(64, 48, 1, &bytes).unwrap();
        let (plane, mask) = (Plane::new(&frame, Channel::Luma), Mask::all(64, 48));
        let exposure = meter.measure(&plane, &mask);
        (exposure, sharpness(&plane, &mask, &exposure))
    }

    #[test]
    fn flat_dark_bright_and_repeated_frames_are_recognized() {
        let mut meter = ExposureMeter::default();
        let (dark, _) = measured(&mut meter, |_, _| 3);
        assert!(dark.is_dark() && dark.is_flat() && !dark.is_repeated);
        let (again, _) = measured(&mut meter, |_, _| 3);
        assert!(again.is_repeated);
        let (bright, _) = measured(&mut meter, |_, _| 255);
        assert!(bright.is_saturated() && bright.is_flat() && !bright.is_repeated);
        meter.forget();
        assert!(!measured(&mut meter, |_, _| 255).0.is_repeated);
    }

    #[test]
    fn an_edge_is_sharper_than_a_slope() {
        let mut meter = ExposureMeter::default();
        let (edge, sharp) = measured(&mut meter, |x, _| if x < 30 { 20 } else { 220 });
        assert!(!edge.is_dark() && !edge.is_flat() && !edge.is_saturated());
        assert_eq!(sharp, 1.0);
        let (_, soft) = measured(&mut meter, |x, _| 3 * x as u8);
        assert!(soft < 0.1, "{soft}");
    }
}
