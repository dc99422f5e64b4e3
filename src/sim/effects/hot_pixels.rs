//! Pixels that fill in the dark; the pass is [`crate::electronics::hot_pixels`].

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::electronics::hot_pixels::{ADD_UNITS, ASK_UNITS, DarkCurrent};
use crate::light::bounds;
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct HotPixels;

impl Effect for HotPixels {
    fn name(&self) -> EffectName {
        EffectName::HotPixels
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let hot = scene.file().electronics.hot_pixels.as_ref().filter(|_| scene.draws())?;
        (hot.share > 0.0 && hot.level_per_s > 0.0).then(|| {
            format!(
                "{} of the pixels fill in the dark, by {} full scales a second in the mean",
                hot.share, hot.level_per_s
            )
        })
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let Some(hot) = &scene.file().electronics.hot_pixels else { return Ok(Bound::default()) };
        // The hottest of the sensor's own pixels, in the dark.
        let largest = DarkCurrent::of(scene, hot).largest();
        Ok(Bound::grey(bounds::grey_of_change(scene.file().electronics.gamma, largest)))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let Some(hot) = &scene.file().electronics.hot_pixels else { return Cost::default() };
        let (asked, hot) = DarkCurrent::of(scene, hot).counts();
        Cost { once: asked * ASK_UNITS, per_frame: hot * ADD_UNITS }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        if let Some(hot) = &scene.file().electronics.hot_pixels {
            pipeline.passes.push(Box::new(DarkCurrent::of(scene, hot)));
        }
        Ok(())
    }
}
