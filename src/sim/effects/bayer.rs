//! Each pixel sees one colour; the pass is [`crate::electronics::bayer`].

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::electronics::bayer::{DEMOSAIC_UNITS, Demosaic, FILTER_UNITS, Filter};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct Bayer;

impl Effect for Bayer {
    fn name(&self) -> EffectName {
        EffectName::Bayer
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let pattern = scene.file().electronics.bayer.filter(|_| scene.draws() && scene.planes() == 3)?;
        Some(format!("one colour a pixel, {pattern:?}"))
    }

    fn bound(&self, _scene: &Scene) -> Result<Bound, SimError> {
        // A colour that is sampled at every other pixel places a dot to within that spacing.
        Ok(Bound::px(1.0))
    }

    fn is_drawn(&self) -> bool {
        true
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let (width, height) = scene.image_size();
        Cost { once: 0, per_frame: (width * height) as u64 * (FILTER_UNITS + DEMOSAIC_UNITS) }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        if let Some(pattern) = scene.file().electronics.bayer {
            pipeline.passes.push(Box::new(Filter { pattern }));
            pipeline.passes.push(Box::new(Demosaic { pattern }));
        }
        Ok(())
    }
}
