//! The lights, their colours and lobes, through the sheet.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::light::{is_lit_by_leds, shade};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct DirectLightEffect;

/// Samples of the membrane that a frame asks for, about: for the prediction of work.
pub(super) const SAMPLES: u64 = 8_000;

impl Effect for DirectLightEffect {
    fn name(&self) -> EffectName {
        EffectName::DirectLight
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let light = scene.file().light.leds.as_ref().filter(|_| is_lit_by_leds(scene))?;
        let count = scene.design().sections().leds.list.len();
        Some(format!("{count} lights at {} of their flux instead of an even light", light.power))
    }

    fn bound(&self, _scene: &Scene) -> Result<Bound, SimError> {
        // Without it the membrane is lit evenly, at a level that has nothing to do with the lights'.
        Ok(Bound::grey(255.0))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let lights = shade::source_count(scene);
        Cost { once: shade::EXACT_UNITS * lights, per_frame: SAMPLES * shade::STILL_UNITS }
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.light.direct = true;
        Ok(())
    }
}
