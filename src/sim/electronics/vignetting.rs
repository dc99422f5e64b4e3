//! The lens darkens towards the edge: brightness falls as a power of the cosine of the field angle.

use glam::DVec2;

use crate::effect_name::EffectName;
use crate::electronics::pass::{Pass, PassContext, Stage};
use crate::raster::frame::Frame;
use crate::scene::Scene;
use crate::work::Work;
use domecast_optics::camera::Lens;

/// Work of one pixel's factor, once.
pub(crate) const FACTOR_UNITS: u64 = 80;

/// Pixels of a plane that are darkened in one unit of work.
pub(crate) const PIXELS_PER_UNIT: u64 = 3;

/// Beyond a right angle there is no light; the power of the cosine up to there.
pub(crate) fn fall(field_angle_rad: f64, power: f64) -> f64 {
    field_angle_rad.cos().max(0.0).powf(power)
}

/// A factor for each pixel.
pub(crate) struct Darkening {
    factors: Vec<f32>,
    /// Whether the work of making the factors has been counted.
    counted: std::sync::atomic::AtomicBool,
}

impl Darkening {
    /// The factors of a scene's lens.
    pub fn of(scene: &Scene) -> Self {
        let (width, height) = scene.image_size();
        let power = scene.file().electronics.vignetting_exponent;
        let lens = scene.optics().lens();
        let edge = fall(lens.max_field_angle_rad(), power);
        let factor = |at: usize| {
            let pixel = DVec2::new((at % width) as f64, (at / width) as f64);
            // Beyond what the lens shows, the picture is as dark as at its edge.
            lens.unproject(pixel).map_or(edge, |ray| fall(Lens::field_angle_rad(ray), power)) as f32
        };
        let factors = (0..width * height).map(factor).collect();
        Self { factors, counted: false.into() }
    }
}

impl Pass for Darkening {
    fn effect(&self) -> EffectName {
        EffectName::Vignetting
    }

    fn stage(&self) -> Stage {
        Stage::Vignetting
    }

    fn run(&self, frame: &mut Frame, _context: &PassContext, work: &mut Work) {
        let mut units = (self.factors.len() * frame.planes.len()) as u64 / PIXELS_PER_UNIT;
        if !self.counted.swap(true, std::sync::atomic::Ordering::Relaxed) {
            units += self.factors.len() as u64 * FACTOR_UNITS;
        }
        for plane in &mut frame.planes {
            for (value, factor) in plane.iter_mut().zip(&self.factors) {
                *value *= factor;
            }
        }
        work.add(EffectName::Vignetting, units);
    }
}
