//! Hot and dead pixels.
//!
//! A hot pixel's dark current adds electrons, which have their own shot noise, so it comes before the noise. A dead pixel
//! reads nothing, whatever light and noise do. Under colour filters each is one pixel of the mosaic, which the
//! interpolation spreads over its neighbours; without filters it is a pixel of every plane.

use domecast_optics::numeric::SeededRandom;

use crate::effect_name::EffectName;
use crate::electronics::pass::{Pass, PassContext, Stage};
use crate::raster::frame::Frame;
use crate::scene::Scene;
use crate::work::Work;

/// Numbers of the streams of random numbers, beside others of the seed.
const HOT_STREAM: u64 = 0x686f_7470;
const LEVEL_STREAM: u64 = 0x686f_746c;
const DEAD_STREAM: u64 = 0x6465_6164;

/// Work of a pixel.
pub(crate) const PIXEL_UNITS: u64 = 4;

/// The pixels of a camera that do not see.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Defects {
    /// Columns and rows of hot pixels, and what their dark current adds.
    pub hot: Vec<([usize; 2], f32)>,
    /// Columns and rows of dead pixels.
    pub dead: Vec<[usize; 2]>,
}

impl Defects {
    /// Those of a scene's camera: the ones that are given, and random ones from the scene's seed.
    pub fn of(scene: &Scene) -> Self {
        let Some(section) = &scene.file().electronics.defects else { return Self::default() };
        let (width, height) = scene.image_size();
        let seed = scene.file().seed;
        let inside = |[x, y]: [u32; 2]| [x as usize, y as usize];
        let pixels = (width * height) as f64;
        let places = |stream: u64, per_million: f64| {
            let mut random = SeededRandom::stream(seed, stream);
            let count = (pixels * per_million * 1e-6).round() as usize;
            let place = move |_| {
                [width, height].map(|side| ((random.uniform() * side as f64) as usize).min(side - 1))
            };
            (0..count).map(place).collect::<Vec<_>>()
        };
        let given = |list: &[[u32; 2]]| {
            list.iter().copied().map(inside).filter(|[x, y]| *x < width && *y < height).collect::<Vec<_>>()
        };
        let mut random = SeededRandom::stream(seed, LEVEL_STREAM);
        let [low, high] = section.hot_level;
        let mut level = || (low * (high / low).powf(random.uniform())) as f32;
        let hot = given(&section.hot).into_iter().chain(places(HOT_STREAM, section.hot_per_million));
        let dead = given(&section.dead).into_iter().chain(places(DEAD_STREAM, section.dead_per_million));
        // A pixel has one dark current, wherever it is named twice.
        let mut hot: Vec<_> = hot.map(|place| (place, level())).collect();
        hot.sort_by(|(a, one), (b, other)| a.cmp(b).then(other.total_cmp(one)));
        hot.dedup_by_key(|(place, _)| *place);
        Self { hot, dead: dead.collect() }
    }

    /// What the dark current of the hottest adds, full scales.
    pub fn hottest(&self) -> f64 {
        self.hot.iter().map(|(_, level)| f64::from(*level)).fold(0.0, f64::max)
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.hot.len() + self.dead.len()
    }
}

/// Adds the dark current of hot pixels.
pub(crate) struct HotPixels(pub Vec<([usize; 2], f32)>);

impl Pass for HotPixels {
    fn effect(&self) -> EffectName {
        EffectName::Defects
    }

    fn stage(&self) -> Stage {
        Stage::Sensor
    }

    fn run(&self, frame: &mut Frame, context: &PassContext, work: &mut Work) {
        let width = frame.width();
        let gain = context.gains.exposure as f32;
        for plane in &mut frame.planes {
            for ([x, y], level) in &self.0 {
                plane.get_mut(y * width + x).into_iter().for_each(|value| *value += gain * level);
            }
            work.add(EffectName::Defects, self.0.len() as u64 * PIXEL_UNITS);
        }
    }
}

/// Takes everything from dead pixels.
pub(crate) struct DeadPixels(pub Vec<[usize; 2]>);

impl Pass for DeadPixels {
    fn effect(&self) -> EffectName {
        EffectName::Defects
    }

    fn stage(&self) -> Stage {
        Stage::Readout
    }

    fn run(&self, frame: &mut Frame, _context: &PassContext, work: &mut Work) {
        let width = frame.width();
        for plane in &mut frame.planes {
            for [x, y] in &self.0 {
                plane.get_mut(y * width + x).into_iter().for_each(|value| *value = 0.0);
            }
            work.add(EffectName::Defects, self.0.len() as u64 * PIXEL_UNITS);
        }
    }
}
