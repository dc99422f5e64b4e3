//! Sharpening by the camera: what a Gaussian blur would take from the picture is added to it, several times over (unsharp
//! masking; R. C. Gonzalez and R. E. Woods, Digital Image Processing, 2018).
//!
//! It works on the coded values, as camera processors do. Edges overshoot on both sides: that of a step by
//! `amount * (1 - Phi(d / radius))` of it at the distance `d`.

use rayon::prelude::*;

use crate::effect_name::EffectName;
use crate::electronics::pass::{CodedPass, PassContext};
use crate::raster::frame::Image8;
use crate::scene::electronics::SharpeningSection;
use crate::work::Work;

/// Radii of the Gaussian after which its weights end.
const REACH: f64 = 3.0;

/// Work of one weight on one value.
pub(crate) const WEIGHT_UNITS: u64 = 1;

/// Weights of the Gaussian from the middle outwards; all of them, both sides, sum to one.
pub(crate) fn weights(radius_px: f64) -> Vec<f32> {
    let reach = (REACH * radius_px).ceil().max(1.0) as i32;
    let raw: Vec<f64> = (0..=reach).map(|k| (-0.5 * (f64::from(k) / radius_px).powi(2)).exp()).collect();
    let sum = 2.0 * raw.iter().sum::<f64>() - raw[0];
    raw.iter().map(|w| (w / sum) as f32).collect()
}

/// The most by which sharpening makes a difference between two pictures larger: what is added has the difference at the pixel and
/// that of its surroundings.
pub(crate) fn gain(sharpening: &SharpeningSection) -> f64 {
    1.0 + 2.0 * sharpening.amount
}

/// Unsharp masking.
pub(crate) struct Unsharp {
    amount: f32,
    weights: Vec<f32>,
}

impl Unsharp {
    /// The sharpening of a camera.
    pub fn of(sharpening: &SharpeningSection) -> Self {
        Self { amount: sharpening.amount as f32, weights: weights(sharpening.radius_px) }
    }
}

/// Weighted values about a place of a line of `count`, beyond whose ends its last values go on.
#[inline]
fn blurred(weights: &[f32], at: usize, count: usize, value: impl Fn(usize) -> f32) -> f32 {
    let mut sum = 0.0;
    for (k, weight) in weights.iter().enumerate() {
        let both = if k == 0 {
            value(at)
        } else {
            value(at.saturating_sub(k)) + value((at + k).min(count.saturating_sub(1)))
        };
        sum += weight * both;
    }
    sum
}

impl CodedPass for Unsharp {
    fn effect(&self) -> EffectName {
        EffectName::Sharpening
    }

    fn is_lossy(&self) -> bool {
        false
    }

    fn run(&self, image: &mut Image8, _context: &PassContext, work: &mut Work) {
        let (width, height, channels) = (image.width, image.height, image.channels);
        let row = width * channels;
        if row == 0 || height == 0 {
            return;
        }
        let mut along = vec![0.0_f32; image.bytes.len()];
        along.par_chunks_mut(row).zip(image.bytes.par_chunks(row)).for_each(|(out, bytes)| {
            for (i, out) in out.iter_mut().enumerate() {
                let (x, c) = (i / channels, i % channels);
                *out = blurred(&self.weights, x, width, |x| f32::from(bytes[x * channels + c]));
            }
        });
        image.bytes.par_chunks_mut(row).enumerate().for_each(|(y, bytes)| {
            for (i, value) in bytes.iter_mut().enumerate() {
                let smooth = blurred(&self.weights, y, height, |y| along[y * row + i]);
                let sharp = f32::from(*value) + self.amount * (f32::from(*value) - smooth);
                *value = sharp.round().clamp(0.0, 255.0) as u8;
            }
        });
        let each = 2 * (2 * self.weights.len() as u64 - 1) * WEIGHT_UNITS;
        work.add(EffectName::Sharpening, image.bytes.len() as u64 * each);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sharpened(image: &Image8, amount: f64, radius_px: f64) -> Image8 {
        let mut out = image.clone();
        let pass = Unsharp::of(&SharpeningSection { amount, radius_px });
        pass.run(&mut out, &PassContext { frame: 0, seed: 0 }, &mut Work::default());
        out
    }

    /// A step from 80 to 160 between two columns.
    fn step() -> Image8 {
        let bytes = (0..40 * 60).map(|i| if i % 60 < 30 { 80 } else { 160 }).collect();
        Image8 { width: 60, height: 40, channels: 1, bytes }
    }

    #[test]
    fn a_step_overshoots_by_the_gaussians_tail() {
        let found = sharpened(&step(), 0.5, 1.5);
        let raw: Vec<f64> = (-9..=9).map(|k| (-0.5 * (f64::from(k) / 1.5).powi(2)).exp()).collect();
        let tail = |from: i32| {
            let beyond: f64 = (from..=9).map(|k| (-0.5 * (f64::from(k) / 1.5).powi(2)).exp()).sum();
            beyond / raw.iter().sum::<f64>()
        };
        for away in 0..5_usize {
            let over = 0.5 * 80.0 * tail(away as i32 + 1);
            let at = |x: usize| f64::from(found.bytes[20 * 60 + x]);
            assert!((at(30 + away) - 160.0 - over).abs() <= 0.6, "{away}: {} {over}", at(30 + away));
            assert!((80.0 - at(29 - away) - over).abs() <= 0.6, "{away}: {} {over}", at(29 - away));
        }
    }

    #[test]
    fn what_is_even_stays_and_differences_grow_by_no_more_than_the_gain() {
        let even = Image8 { width: 9, height: 7, channels: 3, bytes: vec![77; 9 * 7 * 3] };
        assert_eq!(sharpened(&even, 2.0, 1.0), even);
        let a = step();
        let mut b = a.clone();
        for (i, value) in b.bytes.iter_mut().enumerate() {
            *value = value.saturating_add(if (i * 7919) % 35 == 0 { 4 } else { 0 });
        }
        for amount in [0.3, 1.0, 2.5] {
            let gain = gain(&SharpeningSection { amount, radius_px: 1.2 });
            let (a, b) = (sharpened(&a, amount, 1.2), sharpened(&b, amount, 1.2));
            let largest = a.bytes.iter().zip(&b.bytes).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
            assert!(f64::from(largest) <= 4.0 * gain + 1.0, "{amount}: {largest}");
            assert!(f64::from(largest) > 0.4 * 4.0 * gain, "{amount}: {largest}");
        }
    }
}
