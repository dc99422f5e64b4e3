//! Hot and dead pixels; the passes are [`crate::electronics::defects`].

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::light_bound;
use crate::electronics::defects::{DeadPixels, Defects, HotPixels, PIXEL_UNITS};
use crate::light::bounds;
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct DefectsEffect;

impl Effect for DefectsEffect {
    fn name(&self) -> EffectName {
        EffectName::Defects
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        scene.file().electronics.defects.as_ref().filter(|_| scene.draws())?;
        let defects = Defects::of(scene);
        (defects.count() > 0)
            .then(|| format!("{} hot and {} dead pixels", defects.hot.len(), defects.dead.len()))
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let defects = Defects::of(scene);
        let gamma = scene.file().electronics.gamma;
        // Dark current is gained as light is.
        let gain = light_bound::max_gain(scene);
        let hot = bounds::grey_of_change(gamma, gain * defects.hottest());
        let dead = bounds::grey_of_loss(gamma, gain * light_bound::brightest_level(scene)?, 1.0);
        Ok(Bound::grey(if defects.dead.is_empty() { hot } else { hot.max(dead) }))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let mosaic = scene.file().electronics.bayer.is_some() && scene.planes() == 3;
        let planes = if mosaic { 1 } else { scene.planes() };
        Cost { once: 0, per_frame: (Defects::of(scene).count() * planes) as u64 * PIXEL_UNITS }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        let Defects { hot, dead } = Defects::of(scene);
        pipeline.passes.push(Box::new(HotPixels(hot)));
        pipeline.passes.push(Box::new(DeadPixels(dead)));
        Ok(())
    }
}
