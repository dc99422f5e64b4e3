//! The lens darkens towards the edge: brightness falls as a power of the cosine of the field angle.

use glam::DVec2;

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::electronics::pass::{Pass, PassContext, Stage};
use crate::raster::frame::Frame;
use crate::{Pipeline, Scene, SimError, Work};
use domecast_optics::camera::Lens;

/// See the module.
pub struct Vignetting;

/// Work of one pixel's factor, once.
const FACTOR_UNITS: u64 = 80;

/// Pixels of a plane that are darkened in one unit of work.
const PIXELS_PER_UNIT: u64 = 3;

impl Effect for Vignetting {
    fn name(&self) -> EffectName {
        EffectName::Vignetting
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let power = scene.file().electronics.vignetting_exponent;
        (scene.draws() && power > 0.0).then(|| {
            let edge = scene.optics().lens().max_field_angle_rad();
            format!(
                "cos^{power} of the field angle: {:.3} of the light at the lens's edge",
                fall(edge, power)
            )
        })
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        // A level is at most full scale when it counts, and (a level darkened by the factor f) the code x^(1/gamma)
        // falls by 1 - f^(1/gamma) of itself.
        let electronics = &scene.file().electronics;
        let edge = fall(scene.optics().lens().max_field_angle_rad(), electronics.vignetting_exponent);
        Ok(Bound::grey(255.0 * (1.0 - edge.powf(1.0 / electronics.gamma))))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let (width, height) = scene.image_size();
        let pixels = (width * height) as u64;
        Cost { once: pixels * FACTOR_UNITS, per_frame: scene.planes() as u64 * pixels / PIXELS_PER_UNIT }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
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
        pipeline.passes.push(Box::new(Darkening { factors, counted: false.into() }));
        Ok(())
    }
}

/// Beyond a right angle there is no light; the power of the cosine up to there.
fn fall(field_angle_rad: f64, power: f64) -> f64 {
    field_angle_rad.cos().max(0.0).powf(power)
}

struct Darkening {
    factors: Vec<f32>,
    /// Whether the work of making the factors has been told.
    counted: std::sync::atomic::AtomicBool,
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
