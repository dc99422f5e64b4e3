//! Falloff with distance and the cosine at the membrane: without it every point is lit like the pole.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::light_bound;
use crate::light::{is_lit_by_leds, shade};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct Falloff;

impl Effect for Falloff {
    fn name(&self) -> EffectName {
        EffectName::Falloff
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let radius = scene.optics().dome_radius_mm();
        let distance = scene.design().sections().leds.center_radius_mm;
        is_lit_by_leds(scene).then(|| {
            format!("lights {distance} mm from the axis of a dome of radius {radius} mm: near, and aslant")
        })
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        light_bound::change(scene, &|name| name == EffectName::Falloff)
    }

    fn cost(&self, scene: &Scene) -> Cost {
        Cost { once: shade::EXACT_UNITS * shade::predicted_evaluations(scene), per_frame: 0 }
    }

    fn needs(&self) -> &'static [EffectName] {
        &[EffectName::DirectLight]
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.light.falloff = true;
        Ok(())
    }
}
