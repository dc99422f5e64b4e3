//! Sharpening by the camera; the pass is [`crate::electronics::sharpening`].

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::light_bound;
use crate::electronics::sharpening::{Unsharp, WEIGHT_UNITS, weights};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct Sharpening;

impl Effect for Sharpening {
    fn name(&self) -> EffectName {
        EffectName::Sharpening
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let sharpening = scene.file().electronics.sharpening.as_ref().filter(|_| scene.draws())?;
        (sharpening.amount > 0.0).then(|| {
            format!(
                "unsharp mask: {} times what a blur of {} px takes",
                sharpening.amount, sharpening.radius_px
            )
        })
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let Some(sharpening) = &scene.file().electronics.sharpening else { return Ok(Bound::default()) };
        // What the blur takes of a pixel is at most the whole contrast, times the weight of the others.
        let own = f64::from(weights(sharpening.radius_px).first().copied().unwrap_or(1.0)).powi(2);
        let grey = sharpening.amount * (1.0 - own) * light_bound::contrast_grey(scene)?;
        Ok(Bound::grey(grey.min(255.0)))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let Some(sharpening) = &scene.file().electronics.sharpening else { return Cost::default() };
        let (width, height) = scene.image_size();
        let each = 2 * (2 * weights(sharpening.radius_px).len() as u64 - 1) * WEIGHT_UNITS;
        Cost { once: 0, per_frame: (width * height * scene.planes()) as u64 * each }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        if let Some(sharpening) = &scene.file().electronics.sharpening {
            pipeline.coded_passes.push(Box::new(Unsharp::of(sharpening)));
        }
        Ok(())
    }
}
