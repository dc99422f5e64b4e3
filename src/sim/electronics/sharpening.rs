//! Sharpening by the camera's processor: an unsharp mask.
//!
//! `out = v + amount (v - G v)`, `G` being a Gaussian of the standard deviation `radius_px`, cut at three of them and its
//! weights scaled to the sum 1, along x and then along y; beyond the border the picture goes on as its last pixel.
//! What the sensor read is at most full scale and not below nothing, so the mask sees values from 0 to 1.

use rayon::prelude::*;

use crate::effect_name::EffectName;
use crate::electronics::pass::{Pass, PassContext, Stage};
use crate::raster::frame::Frame;
use crate::scene::camera::SharpeningSection;
use crate::work::Work;

/// Standard deviations at which the Gaussian ends.
const ENDS_AT: f64 = 3.0;

/// Pixels from the middle to the Gaussian's end.
pub(crate) fn reach(section: &SharpeningSection) -> usize {
    (ENDS_AT * section.radius_px).ceil().max(1.0) as usize
}

/// Weights of the Gaussian from the middle on; both sides add up to 1.
pub(crate) fn weights(section: &SharpeningSection) -> Vec<f64> {
    let bell = |k: usize| (-0.5 * (k as f64 / section.radius_px).powi(2)).exp();
    let bells: Vec<f64> = (0..=reach(section)).map(bell).collect();
    let sum = 2.0 * bells.iter().sum::<f64>() - 1.0;
    bells.iter().map(|bell| bell / sum).collect()
}

/// Part of itself that a pixel does not keep in the blurred picture: the mask changes a picture of values between 0 and
/// `b` by at most `amount` times this times `b`, and a difference of two pictures grows to at most
/// `1 + 2 amount` times this.
pub(crate) fn given_away(section: &SharpeningSection) -> f64 {
    1.0 - weights(section).first().map_or(0.0, |middle| middle * middle)
}

/// Work of a pixel of a plane, for the given reach.
pub(crate) fn pixel_units(reach: usize) -> u64 {
    2 + reach as u64
}

/// The mask of a camera.
pub(crate) struct UnsharpMask {
    weights: Vec<f32>,
    amount: f32,
}

impl UnsharpMask {
    /// As a scene's camera has it.
    pub fn of(section: &SharpeningSection) -> Self {
        Self { weights: weights(section).iter().map(|w| *w as f32).collect(), amount: section.amount as f32 }
    }

    /// The weighted sum of a place and its neighbours at equal distances on both sides.
    fn blur(&self, at: impl Fn(isize) -> f32) -> f32 {
        let (middle, sides) = self.weights.split_first().map_or((1.0, &[][..]), |(m, s)| (*m, s));
        let pairs = sides.iter().zip(1..).map(|(weight, k)| weight * (at(-k) + at(k)));
        middle * at(0) + pairs.sum::<f32>()
    }
}

impl Pass for UnsharpMask {
    fn effect(&self) -> EffectName {
        EffectName::Sharpening
    }

    fn stage(&self) -> Stage {
        Stage::Sharpening
    }

    fn run(&self, frame: &mut Frame, _context: &PassContext, work: &mut Work) {
        let (width, height) = (frame.width(), frame.height());
        let mut blurred = vec![0.0_f32; width * height];
        for plane in &mut frame.planes {
            plane.iter_mut().for_each(|value| *value = value.clamp(0.0, 1.0));
            let source: &[f32] = plane;
            blurred.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
                let row = source.get(y * width..(y + 1) * width).unwrap_or_default();
                let value =
                    |x: isize| row.get(x.clamp(0, width as isize - 1) as usize).copied().unwrap_or(0.0);
                for (x, out) in out.iter_mut().enumerate() {
                    *out = self.blur(|k| value(x as isize + k));
                }
            });
            plane.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
                for (x, value) in row.iter_mut().enumerate() {
                    let down = |k: isize| {
                        let y = (y as isize + k).clamp(0, height as isize - 1) as usize;
                        blurred.get(y * width + x).copied().unwrap_or(0.0)
                    };
                    *value += self.amount * (*value - self.blur(down));
                }
            });
            work.add(EffectName::Sharpening, (width * height) as u64 * pixel_units(self.weights.len()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sharpened(section: &SharpeningSection, frame: &mut Frame) {
        let context = PassContext::default();
        UnsharpMask::of(section).run(frame, &context, &mut Work::default());
    }

    #[test]
    fn an_even_picture_stays_and_an_edge_overshoots_as_the_error_function_says() {
        let section = SharpeningSection { radius_px: 4.0, amount: 0.8, why: None };
        let (width, height) = (81, 9);
        let mut frame = Frame::new(width, height, 1);
        for (i, value) in frame.planes[0].iter_mut().enumerate() {
            *value = if i % width < 40 { 0.3 } else { 0.6 };
        }
        let before = frame.planes[0].clone();
        sharpened(&section, &mut frame);
        // Far from the edge nothing changes; pixel 40 + k is k + 1/2 from the edge: the Gaussian takes erfc of it.
        for x in [0, 20, 60, 80] {
            assert!((frame.planes[0][4 * width + x] - before[4 * width + x]).abs() < 1e-3);
        }
        // Phi(-(k + 1/2) / 4) for k = 0, 2, 5, from tables of the normal distribution.
        for (k, other_side) in [(0, 0.450_26), (2, 0.265_99), (5, 0.084_57)] {
            let expected = 0.6 + 0.8 * 0.3 * other_side;
            let found = frame.planes[0][4 * width + 40 + k];
            assert!((f64::from(found) - expected).abs() < 1.5e-3, "{k}: {found} {expected}");
        }
    }

    #[test]
    fn no_change_passes_what_is_stated() {
        for (radius_px, amount) in [(0.3, 1.0), (1.0, 0.5), (3.0, 2.0)] {
            let section = SharpeningSection { radius_px, amount, why: None };
            // The worst picture of values from 0 to 1: one bright pixel.
            let mut frame = Frame::new(41, 41, 1);
            frame.planes[0][20 * 41 + 20] = 1.0;
            sharpened(&section, &mut frame);
            let found = f64::from(frame.planes[0][20 * 41 + 20] - 1.0);
            assert!((found - amount * given_away(&section)).abs() < 1e-5, "{found}");
            let sum: f32 = frame.planes[0].iter().sum();
            assert!((sum - 1.0).abs() < 1e-4, "{sum}");
        }
    }
}
