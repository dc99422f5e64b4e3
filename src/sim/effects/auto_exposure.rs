//! The camera sets its exposure by the frames before; the loop is [`crate::electronics::exposure`].

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::light_bound;
use crate::effects::noise::Noise;
use crate::electronics::exposure::{ExposureGain, GAIN_UNITS, METER_UNITS};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct AutoExposure;

impl Effect for AutoExposure {
    fn name(&self) -> EffectName {
        EffectName::AutoExposure
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let section = scene.file().electronics.auto_exposure.as_ref().filter(|_| scene.draws())?;
        let called = section.speed > 0.0 || section.first_gain != 1.0;
        called.then(|| {
            format!(
                "the gain goes to a mean of {} at a speed of {} a frame",
                section.target_level, section.speed
            )
        })
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let electronics = &scene.file().electronics;
        let Some(section) = &electronics.auto_exposure else { return Ok(Bound::default()) };
        let range = if section.speed > 0.0 && scene.frame_count() > 1 {
            section.gain
        } else {
            [section.first_gain; 2]
        };
        let brightest = light_bound::brightest_level(scene)?;
        // Noise is another behind another gain.
        let noise = if electronics.noise.is_some() { Noise.bound(scene)?.grey } else { 0.0 };
        Ok(Bound::grey(grey_of_gains(electronics.gamma, brightest, range) + noise))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let (width, height) = scene.image_size();
        let pixels = (width * height) as u64;
        let mosaic = scene.file().electronics.bayer.is_some() && scene.planes() == 3;
        let gained = if mosaic { 1 } else { scene.planes() as u64 };
        Cost { once: 0, per_frame: pixels * (gained * GAIN_UNITS + scene.planes() as u64 * METER_UNITS) }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.metering.exposure.clone_from(&scene.file().electronics.auto_exposure);
        pipeline.passes.push(Box::new(ExposureGain));
        Ok(())
    }
}

/// The largest change of a code that a gain between two can make to light that is at most `brightest` full scales.
pub(super) fn grey_of_gains(gamma: f64, brightest: f64, [low, high]: [f64; 2]) -> f64 {
    let power = 1.0 / gamma;
    let code = |level: f64| level.clamp(0.0, 1.0).powf(power);
    // What gets brighter changes most where it just becomes white, what gets darker where it is brightest.
    let rises = |gain: f64| {
        let level = brightest.min(1.0 / gain);
        code(gain * level) - code(level)
    };
    let falls = |gain: f64| code(brightest.min(1.0)) - code(gain * brightest.min(1.0));
    255.0 * rises(high.max(1.0)).max(falls(low.min(1.0)))
}
