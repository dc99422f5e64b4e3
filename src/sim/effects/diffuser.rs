//! The tape before the lights: it spreads their lobes and takes its share.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::light_bound;
use crate::light::{is_lit_by_leds, shade};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct DiffuserEffect;

impl Effect for DiffuserEffect {
    fn name(&self) -> EffectName {
        EffectName::Diffuser
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let tape = scene.design().sections().leds.diffuser.filter(|_| is_lit_by_leds(scene))?;
        Some(format!(
            "tape that lets {} through, {} of it by Lambert's law and the rest in a lobe of {} degrees",
            tape.transmittance, tape.lambert_fraction, tape.lobe_width_deg
        ))
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        light_bound::change(scene, &|name| name == EffectName::Diffuser)
    }

    fn cost(&self, _scene: &Scene) -> Cost {
        Cost { once: shade::DIFFUSER_UNITS, per_frame: 0 }
    }

    fn needs(&self) -> &'static [EffectName] {
        &[EffectName::DirectLight]
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.light.diffuser = true;
        Ok(())
    }
}
