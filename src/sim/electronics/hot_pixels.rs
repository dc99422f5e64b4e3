//! Pixels that fill in the dark.
//!
//! A defect of the silicon lets some pixels gather electrons without light, at a rate of their own: the dark current. The
//! rates of the defects follow an exponential law about their mean (J. Janesick, Scientific Charge-Coupled Devices, 2001), so what a
//! hot pixel adds to a frame is its rate times the exposure. Which pixels are hot belongs to the sensor, not to the
//! run: they are drawn from a seed of their own and stay where they are from frame to frame.

use std::sync::atomic::{AtomicBool, Ordering};

use domecast_optics::numeric::mix64;

use crate::effect_name::EffectName;
use crate::electronics::pass::{Pass, PassContext, Stage};
use crate::raster::frame::Frame;
use crate::scene::Scene;
use crate::scene::electronics::HotPixelsSection;
use crate::work::Work;

/// Work of asking a pixel whether it is hot, and of adding what a hot one gathers.
pub(crate) const ASK_UNITS: u64 = 4;
pub(crate) const ADD_UNITS: u64 = 2;

/// What the hot pixels of a sensor gather in a frame.
pub(crate) struct DarkCurrent {
    /// For each plane, place and level of each hot pixel.
    planes: Vec<Vec<(u32, f32)>>,
    asked: u64,
    counted: AtomicBool,
}

/// A number in (0, 1) from 53 of the bits.
fn unit(bits: u64) -> f64 {
    ((bits >> 11) as f64 + 0.5) / 9_007_199_254_740_992.0
}

impl DarkCurrent {
    /// The hot pixels of a scene's sensor: behind colour filters of one plane, else of each of the picture's.
    pub fn of(scene: &Scene, hot: &HotPixelsSection) -> Self {
        let (width, height) = scene.image_size();
        let file = scene.file();
        let planes = if file.electronics.bayer.is_some() { 1 } else { scene.planes() };
        let shutter_s = file.electronics.shutter.as_ref().map(|shutter| shutter.exposure_s);
        let exposure_s = shutter_s.unwrap_or(1.0 / file.frames.rate_hz);
        let mean_level = hot.level_per_s * exposure_s;
        let plane = |c: usize| {
            let sensor = mix64(hot.seed ^ mix64(c as u64 + 0x9e37));
            let at = |i: u32| {
                let random = mix64(sensor.wrapping_add(u64::from(i)));
                let level = -mean_level * unit(mix64(random)).ln();
                (unit(random) < hot.share).then_some((i, level as f32))
            };
            (0..(width * height) as u32).filter_map(at).collect()
        };
        Self {
            planes: (0..planes).map(plane).collect(),
            asked: (width * height * planes) as u64,
            counted: false.into(),
        }
    }

    /// Largest level that any of them adds, full scales.
    pub fn largest(&self) -> f64 {
        self.planes.iter().flatten().fold(0.0, |largest, (_, level)| f64::from(*level).max(largest))
    }

    /// Pixels that were asked, and those that are hot.
    pub fn counts(&self) -> (u64, u64) {
        (self.asked, self.planes.iter().map(|plane| plane.len() as u64).sum())
    }
}

impl Pass for DarkCurrent {
    fn effect(&self) -> EffectName {
        EffectName::HotPixels
    }

    fn stage(&self) -> Stage {
        // Before the noise, which it has as any electrons do.
        Stage::Sensor
    }

    fn run(&self, frame: &mut Frame, _context: &PassContext, work: &mut Work) {
        for (plane, hot) in frame.planes.iter_mut().zip(&self.planes) {
            for (i, level) in hot {
                plane.get_mut(*i as usize).into_iter().for_each(|value| *value += level);
            }
        }
        let (asked, hot) = self.counts();
        let once = if self.counted.swap(true, Ordering::Relaxed) { 0 } else { asked * ASK_UNITS };
        work.add(EffectName::HotPixels, once + hot * ADD_UNITS);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{Plan, Renderer};

    /// A colour picture of the dark, for a sensor's seed, a run's, an exposure and colour filters.
    fn dark(sensor: u64, run: u64, exposure_s: f64, more: &str) -> Vec<Vec<u8>> {
        let text = format!(
            r#"{{ "version": 1, "name": "dark", "design": "thumb24.json", "seed": {run},
            "frames": {{ "count": 2, "rate_hz": 30 }}, "tolerance": {{ "px": 0.01, "grey": 0.5 }},
            "light": {{ "membrane_level": 0, "marker_level": 0, "surround_level": 0 }},
            "electronics": {{ "shutter": {{ "exposure_s": {exposure_s} }}, {more}
                "hot_pixels": {{ "share": 0.002, "level_per_s": 10, "seed": {sensor} }} }} }}"#
        );
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs");
        let scene = Scene::from_text(&text, &folder).unwrap();
        let renderer = Renderer::new(&scene, &Plan::of(&scene).unwrap()).unwrap();
        (0..2).map(|k| renderer.frame(k).unwrap().image.unwrap().bytes).collect()
    }

    fn lit(bytes: &[u8]) -> Vec<usize> {
        bytes.iter().enumerate().filter(|(_, value)| **value > 0).map(|(i, _)| i).collect()
    }

    #[test]
    fn hot_pixels_stay_and_fill_with_the_exposure_by_an_exponential_law() {
        let short = dark(1, 1, 0.01, "");
        let values = short[0].len() as f64;
        // Of an exponential law of mean 25.5 levels, exp(-0.5 / 25.5) lie above half a level.
        let share = lit(&short[0]).len() as f64 / values;
        assert!((share / (0.002 * (-0.5_f64 / 25.5).exp()) - 1.0).abs() < 0.08, "{share}");
        let mean = |bytes: &[u8]| bytes.iter().map(|v| f64::from(*v)).sum::<f64>() / values / 0.002;
        assert!((mean(&short[0]) / 25.5 - 1.0).abs() < 0.08, "{}", mean(&short[0]));
        assert_eq!(short[0], short[1], "they stay where they are");
        assert_eq!(short, dark(1, 2, 0.01, ""), "they belong to the sensor, not to the run");
        assert_ne!(short, dark(2, 1, 0.01, ""), "another sensor has others");
        let long = dark(1, 1, 0.02, "");
        let off = short[0].iter().zip(&long[0]).map(|(a, b)| (2 * i32::from(*a)).min(255) - i32::from(*b));
        assert!(off.map(i32::abs).max().unwrap() <= 1, "twice the exposure, twice the level");
    }

    #[test]
    fn behind_colour_filters_a_hot_pixel_leaks_into_its_neighbours() {
        let filtered = dark(1, 1, 0.01, r#""bayer": "rggb","#);
        let width = 640;
        let seen = lit(&filtered[0]);
        // Bilinear interpolation spreads one pixel over nine.
        let beside = seen.iter().filter(|i| {
            seen.binary_search(&(**i + 3)).is_ok() || seen.binary_search(&(**i + 3 * width)).is_ok()
        });
        assert!(beside.count() as f64 > 0.3 * seen.len() as f64, "{}", seen.len());
    }
}
