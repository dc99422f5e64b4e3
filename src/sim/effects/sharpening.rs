//! The camera sharpens; the pass is [`crate::electronics::sharpening`].

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::electronics::sharpening::{UnsharpMask, pixel_units, weights};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct Sharpening;

impl Effect for Sharpening {
    fn name(&self) -> EffectName {
        EffectName::Sharpening
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let section = scene.file().electronics.sharpening.as_ref().filter(|_| scene.draws())?;
        (section.amount > 0.0).then(|| {
            format!("{} of what a Gaussian of {} px takes off is added", section.amount, section.radius_px)
        })
    }

    fn bound(&self, _scene: &Scene) -> Result<Bound, SimError> {
        Ok(Bound::default())
    }

    fn is_drawn(&self) -> bool {
        true
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let Some(section) = &scene.file().electronics.sharpening else { return Cost::default() };
        let (width, height) = scene.image_size();
        let values = (width * height * scene.planes()) as u64;
        Cost { once: 0, per_frame: values * pixel_units(weights(section).len()) }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        if let Some(section) = &scene.file().electronics.sharpening {
            pipeline.passes.push(Box::new(UnsharpMask::of(section)));
        }
        Ok(())
    }
}
