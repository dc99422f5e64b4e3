//! The membrane lights itself: straight across the dome, and by way of the sheet's underside.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::light_bound;
use crate::light::{is_lit_by_leds, shade};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct Interreflection;

impl Effect for Interreflection {
    fn name(&self) -> EffectName {
        EffectName::Interreflection
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let largest = largest_reflectance(scene);
        (is_lit_by_leds(scene) && largest > 0.0)
            .then(|| format!("a membrane that gives back {largest} of the light into the dome"))
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        light_bound::change(scene, &|name| name == EffectName::Interreflection)
    }

    fn cost(&self, _scene: &Scene) -> Cost {
        Cost { once: shade::ROOM_UNITS, per_frame: 0 }
    }

    fn needs(&self) -> &'static [EffectName] {
        &[EffectName::DirectLight]
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.light.interreflection = true;
        Ok(())
    }
}

fn largest_reflectance(scene: &Scene) -> f64 {
    scene.design().sections().elastomer.membrane_reflectance.to_array().into_iter().fold(0.0, f64::max)
}
