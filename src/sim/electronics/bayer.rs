//! Each pixel sees one colour, by the filter over it; the other two are interpolated from its neighbours.
//!
//! The interpolation is bilinear: every missing colour is the mean of the nearest pixels that have it. Its weights
//! are positive and add up to 1, so it never amplifies what another effect changed.

use crate::effect_name::EffectName;
use crate::electronics::pass::{Pass, PassContext, Stage};
use crate::raster::frame::Frame;
use crate::scene::electronics::BayerPattern;
use crate::work::Work;

/// Work for a pixel: through the filter, and back to three colours.
pub(crate) const FILTER_UNITS: u64 = 1;
pub(crate) const DEMOSAIC_UNITS: u64 = 4;

/// Plane (red 0, green 1, blue 2) that the filter at a pixel lets through.
fn colour(pattern: BayerPattern, x: usize, y: usize) -> usize {
    let square = match pattern {
        BayerPattern::Rggb => [[0, 1], [1, 2]],
        BayerPattern::Bggr => [[2, 1], [1, 0]],
        BayerPattern::Grbg => [[1, 0], [2, 1]],
        BayerPattern::Gbrg => [[1, 2], [0, 1]],
    };
    square[y % 2][x % 2]
}

/// Leaves of three planes the one that the filters let through.
pub(crate) struct Filter {
    pub pattern: BayerPattern,
}

impl Pass for Filter {
    fn effect(&self) -> EffectName {
        EffectName::Bayer
    }

    fn stage(&self) -> Stage {
        Stage::Mosaic
    }

    fn run(&self, frame: &mut Frame, _context: &PassContext, work: &mut Work) {
        let width = frame.width();
        let [red, green, blue] = &mut frame.planes[..] else { return };
        // The green plane becomes the mosaic.
        for (y, row) in green.chunks_exact_mut(width).enumerate() {
            let first = if colour(self.pattern, 0, y) == 1 { 1 } else { 0 };
            let other = if colour(self.pattern, first, y) == 0 { &*red } else { &*blue };
            let from = &other[y * width..(y + 1) * width];
            for (value, seen) in row.iter_mut().zip(from).skip(first).step_by(2) {
                *value = *seen;
            }
        }
        work.add(EffectName::Bayer, (green.len() as u64) * FILTER_UNITS);
        frame.planes.swap(0, 1);
        frame.planes.truncate(1);
    }
}

/// Makes three planes again of the filtered one.
pub(crate) struct Demosaic {
    pub pattern: BayerPattern,
}

impl Pass for Demosaic {
    fn effect(&self) -> EffectName {
        EffectName::Bayer
    }

    fn stage(&self) -> Stage {
        Stage::Demosaic
    }

    fn run(&self, frame: &mut Frame, _context: &PassContext, work: &mut Work) {
        let (width, height) = (frame.width(), frame.height());
        let Some(mosaic) = frame.planes.pop().filter(|_| width > 1 && height > 1) else { return };
        let mut planes = vec![vec![0.0_f32; width * height]; 3];
        // Mirrored at the border, which keeps the colours of the mosaic in step.
        let row_of = |y: usize| &mosaic[y * width..(y + 1) * width];
        for y in 0..height {
            let up = row_of(if y > 0 { y - 1 } else { 1 });
            let down = row_of(if y + 1 < height { y + 1 } else { height - 2 });
            let here = row_of(y);
            for x in 0..width {
                let (left, right) =
                    (if x > 0 { x - 1 } else { 1 }, if x + 1 < width { x + 1 } else { width - 2 });
                let at = y * width + x;
                let own = colour(self.pattern, x, y);
                if own == 1 {
                    let beside = colour(self.pattern, x + 1, y);
                    planes[1][at] = here[x];
                    planes[beside][at] = 0.5 * (here[left] + here[right]);
                    planes[2 - beside][at] = 0.5 * (up[x] + down[x]);
                } else {
                    planes[own][at] = here[x];
                    planes[1][at] = 0.25 * (here[left] + here[right] + up[x] + down[x]);
                    planes[2 - own][at] = 0.25 * (up[left] + up[right] + down[left] + down[right]);
                }
            }
        }
        frame.planes = planes;
        work.add(EffectName::Bayer, (width * height) as u64 * DEMOSAIC_UNITS);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATTERNS: [BayerPattern; 4] =
        [BayerPattern::Rggb, BayerPattern::Bggr, BayerPattern::Grbg, BayerPattern::Gbrg];

    fn through(pattern: BayerPattern, frame: &mut Frame) {
        let context = PassContext::default();
        let mut work = Work::default();
        Filter { pattern }.run(frame, &context, &mut work);
        assert_eq!(frame.planes.len(), 1);
        Demosaic { pattern }.run(frame, &context, &mut work);
        assert_eq!(frame.planes.len(), 3);
        assert_eq!(work.of(EffectName::Bayer), (frame.width() * frame.height()) as u64 * 5);
    }

    #[test]
    fn an_even_colour_and_a_ramp_come_through_unchanged() {
        for pattern in PATTERNS {
            let (width, height) = (12, 10);
            let mut frame = Frame::new(width, height, 3);
            for (c, plane) in frame.planes.iter_mut().enumerate() {
                for (i, value) in plane.iter_mut().enumerate() {
                    *value = 0.1 + 0.2 * c as f32 + 0.01 * (i % width) as f32 + 0.02 * (i / width) as f32;
                }
            }
            let before = frame.clone();
            through(pattern, &mut frame);
            // Away from the border, where the mirror bends the ramp.
            for c in 0..3 {
                for y in 1..height - 1 {
                    for x in 1..width - 1 {
                        let at = y * width + x;
                        assert!((frame.planes[c][at] - before.planes[c][at]).abs() < 1e-6, "{pattern:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_top_left_pixel_has_the_first_letter_of_the_pattern() {
        for (pattern, first) in PATTERNS.into_iter().zip([0, 2, 1, 1]) {
            let mut frame = Frame::new(4, 4, 3);
            frame.planes[first][0] = 1.0;
            let context = PassContext::default();
            Filter { pattern }.run(&mut frame, &context, &mut Work::default());
            assert_eq!(frame.planes[0][0], 1.0);
        }
    }
}
