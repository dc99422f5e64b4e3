//! The printed dots.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::raster::sensor_state::units;
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct Dots;

impl Effect for Dots {
    fn name(&self) -> EffectName {
        EffectName::Dots
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let count = scene.dots().len();
        (scene.draws() && count > 0).then(|| format!("{count} dots are printed on the dome"))
    }

    fn bound(&self, _scene: &Scene) -> Result<Bound, SimError> {
        Ok(Bound::UNBOUNDED)
    }

    fn cost(&self, scene: &Scene) -> Cost {
        Cost { once: 0, per_frame: scene.dots().len() as u64 * 64 * (units::CORNER + 2 * units::PIXEL) }
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.ink.dots = true;
        Ok(())
    }
}
