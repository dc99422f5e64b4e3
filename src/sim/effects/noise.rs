//! Shot, read and quantisation noise; the pass is [`crate::electronics::noise`].

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::light_bound;
use crate::electronics::noise::{SensorNoise, VALUE_UNITS, steps};
use crate::light::bounds;
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct Noise;

/// Levels from dark to the brightest at which the noise is looked at.
const LEVELS: u32 = 64;

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

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let electronics = &scene.file().electronics;
        let Some(noise) = &electronics.noise else { return Ok(Bound::default()) };
        // The 99.9th percentile of a Gaussian's size is 3.29 deviations; Poisson's law reaches further by less than
        // (z^2 - 1) / 6 + 1 electrons. The converter is off by half a step. The steepest place of the code takes it.
        let brightest = light_bound::brightest_value(scene)?.min(1.0);
        // Behind the largest gain full scale stands for the fewest electrons.
        let full = noise.full_scale_electrons / light_bound::max_gain(scene);
        let at = |level: f64| {
            let deviation = (full * level + noise.read_electrons.powi(2)).sqrt();
            let change = (3.29 * deviation + 3.0) / full + 0.5 / steps(noise);
            // Downwards the code of a gamma above 1 is steeper.
            bounds::grey_of_change_from(electronics.gamma, (level - change).max(0.0), change)
        };
        let levels = (0..=LEVELS).map(|k| brightest * f64::from(k) / f64::from(LEVELS));
        Ok(Bound::grey(levels.map(at).fold(0.0, f64::max)))
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
