//! Shot, read and quantisation noise; the pass is [`crate::electronics::noise`].

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::electronics::noise::{SensorNoise, VALUE_UNITS};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct Noise;

impl Effect for Noise {
    fn name(&self) -> EffectName {
        EffectName::Noise
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let noise = scene.file().electronics.noise.as_ref().filter(|_| scene.draws())?;
        Some(format!(
            "{} electrons at full scale, {} of reading, {} bits",
            noise.full_scale_electrons, noise.read_electrons, noise.bits
        ))
    }

    fn bound(&self, _scene: &Scene) -> Result<Bound, SimError> {
        Ok(Bound::default())
    }

    fn is_drawn(&self) -> bool {
        true
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let (width, height) = scene.image_size();
        let mosaic = scene.file().electronics.bayer.is_some();
        let planes = if mosaic { 1 } else { scene.planes() };
        Cost { once: 0, per_frame: (width * height * planes) as u64 * VALUE_UNITS }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        if let Some(noise) = &scene.file().electronics.noise {
            pipeline.passes.push(Box::new(SensorNoise::of(noise)));
        }
        Ok(())
    }
}
