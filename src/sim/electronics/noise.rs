//! Shot, read and quantisation noise.
//!
//! A value of full scale stands for a number of electrons `F`. A pixel that should gather `N` of them gathers a
//! Poisson number (mean and variance `N`), reading adds a Gaussian error of standard deviation `r`, and the
//! converter rounds to one of `2^bits` steps from 0 to full scale. Every random number is a hash of seed, frame,
//! plane and pixel, so the same picture comes out for any number of threads.

use domecast_optics::numeric::mix64;
use rayon::prelude::*;

use crate::effect_name::EffectName;
use crate::electronics::pass::{Pass, PassContext, Stage};
use crate::raster::frame::Frame;
use crate::scene::electronics::NoiseSection;
use crate::work::Work;

/// Below this many expected electrons the count is drawn from Poisson's law itself; above, from the Gaussian of
/// the same mean and variance, whose skewness is then off by less than 1 / sqrt(this).
const POISSON_BELOW: f32 = 40.0;

/// Work of one value.
pub(crate) const VALUE_UNITS: u64 = 8;

/// Steps of the converter from 0 to full scale.
pub(crate) fn steps(noise: &NoiseSection) -> f64 {
    f64::from((1_u32 << noise.bits.min(24)) - 1)
}

/// Electrons, reading and converter of one camera.
pub(crate) struct SensorNoise {
    electrons: f32,
    read: f32,
    steps: f32,
}

impl SensorNoise {
    /// The camera of a scene.
    pub fn of(noise: &NoiseSection) -> Self {
        Self {
            electrons: noise.full_scale_electrons as f32,
            read: noise.read_electrons as f32,
            steps: steps(noise) as f32,
        }
    }

    /// The value that is read for a value of light.
    #[inline]
    fn value(&self, light: f32, electrons: f32, key: u64) -> f32 {
        let expected = (light * electrons).max(0.0);
        let random = mix64(key);
        let first = normal(random as u32);
        let gathered = if expected < POISSON_BELOW {
            poisson(expected, (random >> 32) as u32) + self.read * first
        } else {
            // Two independent Gaussians add up to one.
            expected + first * (expected + self.read * self.read).sqrt()
        };
        let code = (gathered / electrons * self.steps).round().clamp(0.0, self.steps);
        code / self.steps
    }
}

impl Pass for SensorNoise {
    fn effect(&self) -> EffectName {
        EffectName::Noise
    }

    fn stage(&self) -> Stage {
        Stage::Sensor
    }

    fn run(&self, frame: &mut Frame, context: &PassContext, work: &mut Work) {
        let width = frame.width();
        // Behind a gain full scale stands for fewer electrons.
        let electrons = self.electrons / context.gains.exposure as f32;
        for (c, plane) in frame.planes.iter_mut().enumerate() {
            let stream = mix64(context.seed ^ mix64((u64::from(context.frame) << 2) | c as u64));
            plane.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
                for (x, value) in row.iter_mut().enumerate() {
                    *value = self.value(*value, electrons, stream.wrapping_add((y * width + x) as u64));
                }
            });
        }
        let values: usize = frame.planes.iter().map(Vec::len).sum();
        work.add(EffectName::Noise, values as u64 * VALUE_UNITS);
    }
}

/// A Gaussian of mean 0 and variance 1 from 32 random bits, by the inverse of its distribution (Acklam's rational
/// approximation, relative error below 1.2e-9).
#[inline]
fn normal(bits: u32) -> f32 {
    let p = (f64::from(bits) + 0.5) / 4_294_967_296.0;
    const LOW: f64 = 0.02425;
    if (LOW..=1.0 - LOW).contains(&p) {
        let q = p - 0.5;
        let r = q * q;
        let above = ((((-3.969683028665376e1 * r + 2.209460984245205e2) * r - 2.759285104469687e2) * r
            + 1.38357751867269e2)
            * r
            - 3.066479806614716e1)
            * r
            + 2.506628277459239;
        let below = ((((-5.447609879822406e1 * r + 1.615858368580409e2) * r - 1.556989798598866e2) * r
            + 6.680131188771972e1)
            * r
            - 1.328068155288572e1)
            * r
            + 1.0;
        return (q * above / below) as f32;
    }
    let tail = if p < 0.5 { p } else { 1.0 - p };
    let q = (-2.0 * tail.ln()).sqrt();
    let above = ((((-7.784894002430293e-3 * q - 3.223964580411365e-1) * q - 2.400758277161838) * q
        - 2.549732539343734)
        * q
        + 4.374664141464968)
        * q
        + 2.938163982698783;
    let below = (((7.784695709041462e-3 * q + 3.224671290700398e-1) * q + 2.445134137142996) * q
        + 3.754408661907416)
        * q
        + 1.0;
    let value = (above / below) as f32;
    if p < 0.5 { value } else { -value }
}

/// A Poisson number of this mean from 32 random bits, by adding up its law. `mean` below [`POISSON_BELOW`]; the
/// bound on the sum is more than twenty deviations away.
fn poisson(mean: f32, bits: u32) -> f32 {
    let target = (f64::from(bits) + 0.5) / 4_294_967_296.0;
    let mean = f64::from(mean);
    let mut probability = (-mean).exp();
    let mut sum = probability;
    let mut count = 0;
    while sum < target && count < 200 {
        count += 1;
        probability *= mean / f64::from(count);
        sum += probability;
    }
    count as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(level: f32, planes: usize) -> Frame {
        let mut frame = Frame::new(400, 300, planes);
        for plane in &mut frame.planes {
            plane.fill(level);
        }
        frame
    }

    fn run(sensor: &SensorNoise, frame: &mut Frame, number: u32, seed: u64) {
        let context = PassContext { frame: number, seed, ..PassContext::default() };
        sensor.run(frame, &context, &mut Work::default());
    }

    fn moments(values: &[f32]) -> (f64, f64) {
        let n = values.len() as f64;
        let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
        let variance = values.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean, variance)
    }

    #[test]
    fn mean_and_variance_are_as_stated_from_one_electron_to_full_scale() {
        let full = 8000.0;
        for (electrons, read) in
            [(1.0, 0.0), (8.0, 3.0), (39.0, 2.0), (41.0, 2.0), (500.0, 5.0), (6000.0, 5.0)]
        {
            // A fine converter, so that its own noise, step^2 / 12, is known and small.
            let sensor = SensorNoise { electrons: full, read, steps: 65535.0 };
            let mut frame = picture(electrons / full, 1);
            run(&sensor, &mut frame, 3, 11);
            let (mean, variance) = moments(&frame.planes[0]);
            let (mean, variance) = (mean * f64::from(full), variance * f64::from(full * full));
            let expected = f64::from(electrons + read * read);
            let n: f64 = 120_000.0;
            // Reading below zero is cut off by the converter: only where that cannot happen is the mean exact.
            if electrons > 5.0 * read {
                assert!(
                    (mean - f64::from(electrons)).abs() < 5.0 * (expected / n).sqrt(),
                    "{electrons}: {mean}"
                );
                assert!(
                    (variance / expected - 1.0).abs() < 5.0 * (3.0 / n).sqrt(),
                    "{electrons}: {variance}"
                );
            }
        }
    }

    #[test]
    fn quantisation_alone_rounds_to_the_nearest_step() {
        let sensor = SensorNoise { electrons: 1e12, read: 0.0, steps: 255.0 };
        let mut frame = picture(0.3001, 1);
        run(&sensor, &mut frame, 0, 0);
        assert!(frame.planes[0].iter().all(|v| (v * 255.0 - 77.0).abs() < 1e-3));
        let mut dark = picture(-0.5, 1);
        run(&sensor, &mut dark, 0, 0);
        assert!(dark.planes[0].iter().all(|v| *v == 0.0));
    }

    #[test]
    fn neighbours_frames_planes_and_seeds_know_nothing_of_each_other() {
        let sensor = SensorNoise { electrons: 1000.0, read: 2.0, steps: 65535.0 };
        let draw = |frame, seed| {
            let mut out = picture(0.5, 3);
            run(&sensor, &mut out, frame, seed);
            out
        };
        let first = draw(0, 1);
        let correlation = |a: &[f32], b: &[f32]| {
            let sum: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a - 0.5) * f64::from(b - 0.5)).sum();
            let scale: f64 = a.iter().map(|a| f64::from(a - 0.5).powi(2)).sum();
            sum / scale
        };
        let plane = &first.planes[0];
        let limit = 5.0 / (plane.len() as f64).sqrt();
        assert!(correlation(plane, &plane[1..]).abs() < limit);
        assert!(correlation(plane, &plane[400..]).abs() < limit);
        assert!(correlation(plane, &first.planes[1]).abs() < limit);
        assert!(correlation(plane, &draw(1, 1).planes[0]).abs() < limit);
        assert!(correlation(plane, &draw(0, 2).planes[0]).abs() < limit);
        assert_eq!(draw(0, 1), first);
    }

    #[test]
    fn the_bytes_are_the_same_for_any_number_of_threads() {
        let sensor = SensorNoise { electrons: 1000.0, read: 2.0, steps: 4095.0 };
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut frame = picture(0.2, 3);
                run(&sensor, &mut frame, 5, 9);
                frame
            })
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn the_inverse_gaussian_is_symmetric_and_has_its_quantiles() {
        let at = |p: f64| normal((p * 4_294_967_296.0) as u32);
        for (p, z) in [(0.5, 0.0), (0.841_344_746, 1.0), (0.977_249_868, 2.0), (0.998_650_102, 3.0)] {
            assert!((at(p) - z).abs() < 1e-5, "{p}");
            assert!((at(1.0 - p) + z).abs() < 1e-5, "{p}");
        }
    }
}
