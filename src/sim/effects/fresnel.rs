//! Light lost and thrown back at the sheet's faces: on the way in, inside the dome, and on the way to the camera.

use super::direct_light::SAMPLES;
use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::light_bound;
use crate::light::{is_lit_by_leds, shade};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct Fresnel;

impl Effect for Fresnel {
    fn name(&self) -> EffectName {
        EffectName::Fresnel
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let steps = scene.optics().layers().windows(2).any(|pair| pair[0].index != pair[1].index);
        (steps && is_lit_by_leds(scene)).then(|| {
            let indices: Vec<String> =
                scene.optics().layers().iter().map(|layer| layer.index[1].to_string()).collect();
            format!("faces between media of index {}", indices.join(", "))
        })
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        light_bound::change(scene, &|name| name == EffectName::Fresnel)
    }

    fn cost(&self, scene: &Scene) -> Cost {
        Cost {
            once: shade::FRESNEL_UNITS * shade::predicted_evaluations(scene),
            per_frame: SAMPLES * shade::LEAVING_UNITS,
        }
    }

    fn needs(&self) -> &'static [EffectName] {
        &[EffectName::DirectLight]
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.light.fresnel = true;
        Ok(())
    }
}
