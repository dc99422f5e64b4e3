//! The camera sharpens; the pass is [`crate::electronics::sharpening`].

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::light_bound;
use crate::electronics::sharpening::{UnsharpMask, given_away, pixel_units, weights};
use crate::light::bounds;
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

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let electronics = &scene.file().electronics;
        let Some(section) = &electronics.sharpening else { return Ok(Bound::default()) };
        // The mask may make any value darker or brighter by so much, from what may be dark.
        let random = electronics.noise.is_some() || electronics.defects.is_some();
        let random = random || electronics.auto_exposure.is_some() || electronics.white_balance.is_some();
        let brightest = if random { 1.0 } else { light_bound::brightest_level(scene)?.min(1.0) };
        let change = section.amount * given_away(section) * brightest;
        Ok(Bound::grey(bounds::grey_of_change(electronics.gamma, change)))
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
