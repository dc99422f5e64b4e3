//! The lens darkens towards the edge; the pass is [`crate::electronics::vignetting`].

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::light_bound;
use crate::electronics::vignetting::{Darkening, FACTOR_UNITS, PIXELS_PER_UNIT, fall};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct Vignetting;

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
        // Of a level darkened by the factor f the code x^(1/gamma) falls by 1 - f^(1/gamma) of itself.
        let power = scene.file().electronics.vignetting_exponent;
        let edge_rad = scene.optics().lens().max_field_angle_rad();
        Ok(Bound::grey(light_bound::darkening_grey(scene, edge_rad, |angle| fall(angle, power))?))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let (width, height) = scene.image_size();
        let pixels = (width * height) as u64;
        Cost { once: pixels * FACTOR_UNITS, per_frame: scene.planes() as u64 * pixels / PIXELS_PER_UNIT }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.passes.push(Box::new(Darkening::of(scene)));
        Ok(())
    }
}
