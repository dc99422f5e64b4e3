//! The platform stands in the light's way: the lip before the lights, the pits' walls, the window's edge.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::light_bound;
use crate::light::{is_lit_by_leds, shade};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct PlatformShadow;

impl Effect for PlatformShadow {
    fn name(&self) -> EffectName {
        EffectName::PlatformShadow
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let leds = &scene.design().sections().leds;
        (is_lit_by_leds(scene) && leds.through_platform < 1.0).then(|| {
            format!(
                "lights in pits, behind a lip that ends {:.2} mm above their middle",
                leds.lip_top_z_mm - leds.center_z_mm
            )
        })
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        light_bound::change(scene, &|name| name == EffectName::PlatformShadow)
    }

    fn cost(&self, scene: &Scene) -> Cost {
        Cost { once: shade::SHADOW_UNITS * shade::predicted_evaluations(scene), per_frame: 0 }
    }

    fn needs(&self) -> &'static [EffectName] {
        &[EffectName::DirectLight]
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.light.platform_shadow = true;
        Ok(())
    }
}
