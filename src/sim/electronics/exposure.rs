//! Automatic exposure and white balance: gains that follow the frames before.
//!
//! The camera measures each picture as it leaves the lens, in linear light, and sets its gains for the next one. With the
//! mean `m = mean(min(1, g v))` over all pixels and colours, the gain goes on as `g (t / m)^s`, `t` being the target level
//! and `s` the speed; with the means `m_c` of the colours the balance of a colour goes on as `w_c (m_green / (w_c m_c))^s`.
//! In the first a mean counts as an eighth of the target at least, in the second as 0.02 of full scale, so that the dark does
//! not run away. Gains stay within their range.
//! For a speed of at most 1 they never swing: each step goes at most to the target.
//!
//! The gain is in front of the converter: a full code then stands for `1 / g` of the electrons, and noise grows with it.
//! The balance is the processor's, on what the converter gives.

use crate::effect_name::EffectName;
use crate::electronics::pass::{Gains, Pass, PassContext, Stage};
use crate::raster::frame::Frame;
use crate::scene::camera::{AutoExposureSection, WhiteBalanceSection};
use crate::work::Work;

/// Classes of brightness that a picture is counted in, and the brightness where they end, full scales; what is brighter
/// falls into the last.
const CLASSES: usize = 1024;
const END: f32 = 4.0;

/// A mean counts as this part of the exposure's target, at least.
pub(crate) const MIN_PART: f64 = 0.125;

/// A colour's mean counts as so much of full scale, at least.
pub(crate) const MIN_MEAN: f64 = 0.02;

/// Work of a value that is measured, and of one that is multiplied.
pub(crate) const METER_UNITS: u64 = 3;
pub(crate) const GAIN_UNITS: u64 = 1;

/// How bright a picture is, as the camera counts it.
#[derive(Debug, Clone, PartialEq)]
pub struct Meter {
    /// By plane and class: number of values and their sum.
    planes: Vec<Vec<(u32, f64)>>,
}

impl Meter {
    /// Counts a picture.
    pub fn of(frame: &Frame) -> Self {
        let count = |plane: &Vec<f32>| {
            let mut classes = vec![(0_u32, 0.0_f64); CLASSES];
            for value in plane {
                let class = (value.max(0.0) * (CLASSES as f32 / END)) as usize;
                if let Some((count, sum)) = classes.get_mut(class.min(CLASSES - 1)) {
                    *count += 1;
                    *sum += f64::from(*value);
                }
            }
            classes
        };
        Self { planes: frame.planes.iter().map(count).collect() }
    }

    /// Mean of the values of a plane, each multiplied by a gain and at most full scale.
    pub fn mean(&self, plane: usize, gain: f64) -> f64 {
        let classes = self.planes.get(plane).map_or(&[][..], Vec::as_slice);
        let count: f64 = classes.iter().map(|(count, _)| f64::from(*count)).sum();
        let clipped = |(count, sum): &(u32, f64)| (gain * sum).clamp(0.0, f64::from(*count));
        if count > 0.0 { classes.iter().map(clipped).sum::<f64>() / count } else { 0.0 }
    }

    /// The same over all planes.
    pub fn mean_of_all(&self, gain: f64) -> f64 {
        let count = self.planes.len().max(1);
        (0..count).map(|plane| self.mean(plane, gain)).sum::<f64>() / count as f64
    }
}

/// The loops that take part.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Metering {
    /// That of the exposure.
    pub exposure: Option<AutoExposureSection>,
    /// That of the colours.
    pub balance: Option<WhiteBalanceSection>,
}

impl Metering {
    /// Whether any takes part.
    pub fn is_used(&self) -> bool {
        self.exposure.is_some() || self.balance.is_some()
    }

    /// The gains of the first frame.
    pub fn first(&self) -> Gains {
        Gains {
            exposure: self.exposure.as_ref().map_or(1.0, |section| section.first_gain),
            balance: self.balance.as_ref().map_or([1.0; 3], |section| section.first),
        }
    }

    /// The gains of the frame after one with these gains.
    pub fn next(&self, gains: Gains, meter: &Meter) -> Gains {
        let mut out = gains;
        if let Some(section) = &self.exposure {
            let target = section.target_level;
            let mean = meter.mean_of_all(gains.exposure).max(MIN_PART * target);
            let [low, high] = section.gain;
            out.exposure = (gains.exposure * (target / mean).powf(section.speed)).clamp(low, high);
        }
        if let Some(section) = &self.balance {
            let wanted = (gains.balance[1] * meter.mean(1, gains.exposure)).max(MIN_MEAN);
            let [low, high] = section.gain;
            for (c, balance) in out.balance.iter_mut().enumerate().filter(|(c, _)| *c != 1) {
                let mean = (*balance * meter.mean(c, gains.exposure)).max(MIN_MEAN);
                *balance = (*balance * (wanted / mean).powf(section.speed)).clamp(low, high);
            }
        }
        out
    }
}

/// Multiplies light by the gain before the converter.
pub(crate) struct ExposureGain;

impl Pass for ExposureGain {
    fn effect(&self) -> EffectName {
        EffectName::AutoExposure
    }

    fn stage(&self) -> Stage {
        Stage::Sensor
    }

    fn run(&self, frame: &mut Frame, context: &PassContext, work: &mut Work) {
        let gain = context.gains.exposure as f32;
        for plane in &mut frame.planes {
            plane.iter_mut().for_each(|value| *value *= gain);
            work.add(EffectName::AutoExposure, plane.len() as u64 * GAIN_UNITS);
        }
    }
}

/// Multiplies what the converter gives by the gains of the colours.
pub(crate) struct Balance;

impl Pass for Balance {
    fn effect(&self) -> EffectName {
        EffectName::WhiteBalance
    }

    fn stage(&self) -> Stage {
        Stage::Balance
    }

    fn run(&self, frame: &mut Frame, context: &PassContext, work: &mut Work) {
        for (plane, gain) in frame.planes.iter_mut().zip(context.gains.balance) {
            // What the converter cut off stays cut off.
            plane.iter_mut().for_each(|value| *value = value.clamp(0.0, 1.0) * gain as f32);
            work.add(EffectName::WhiteBalance, plane.len() as u64 * GAIN_UNITS);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(levels: [f32; 3]) -> Frame {
        let mut frame = Frame::new(20, 10, 3);
        for (plane, level) in frame.planes.iter_mut().zip(levels) {
            plane.fill(level);
        }
        frame
    }

    fn exposure(speed: f64) -> AutoExposureSection {
        AutoExposureSection { target_level: 0.4, speed, first_gain: 1.0, gain: [0.1, 10.0], why: None }
    }

    #[test]
    fn the_gain_goes_to_the_target_as_a_power_of_the_speed_says() {
        let meter = Meter::of(&picture([0.1; 3]));
        for speed in [0.2, 0.5, 1.0] {
            let metering = Metering { exposure: Some(exposure(speed)), balance: None };
            let mut gains = metering.first();
            for k in 0..6 {
                // Without clipping the logarithm's distance to the target shrinks by 1 - s a frame.
                let expected = 4.0 * 0.25_f64.powf((1.0 - speed).powi(k));
                assert!(
                    (gains.exposure - expected).abs() < 1e-6,
                    "{speed} {k}: {} {expected}",
                    gains.exposure
                );
                gains = metering.next(gains, &meter);
            }
        }
    }

    #[test]
    fn a_picture_that_is_all_white_darkens_and_colours_become_alike() {
        let metering = Metering {
            exposure: Some(exposure(0.5)),
            balance: Some(WhiteBalanceSection { speed: 0.5, first: [1.0; 3], gain: [0.25, 4.0], why: None }),
        };
        let meter = Meter::of(&picture([3.0, 6.0, 2.0]));
        let mut gains = metering.first();
        for _ in 0..60 {
            let next = metering.next(gains, &meter);
            assert!(next.exposure <= gains.exposure, "it never swings");
            gains = next;
        }
        assert!((meter.mean_of_all(gains.exposure) - 0.4).abs() < 1e-3 || gains.exposure == 0.1);
        let seen = [0, 1, 2].map(|c| gains.balance[c] * meter.mean(c, gains.exposure));
        assert!(seen.iter().all(|mean| (mean - seen[1]).abs() < 1e-3), "{seen:?}");
    }

    #[test]
    fn a_dark_picture_ends_at_the_largest_gain() {
        let metering = Metering { exposure: Some(exposure(1.0)), balance: None };
        let meter = Meter::of(&picture([0.0; 3]));
        let gains = (0..5).fold(metering.first(), |gains, _| metering.next(gains, &meter));
        assert_eq!(gains.exposure, 10.0);
    }
}
