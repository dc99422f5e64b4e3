//! The camera sets its colours by the frames before; the loop is [`crate::electronics::exposure`].

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::auto_exposure::grey_of_gains;
use crate::effects::effect::{Cost, Effect};
use crate::electronics::exposure::{Balance, GAIN_UNITS, METER_UNITS};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct WhiteBalance;

impl Effect for WhiteBalance {
    fn name(&self) -> EffectName {
        EffectName::WhiteBalance
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let section = scene.file().electronics.white_balance.as_ref();
        let section = section.filter(|_| scene.draws() && scene.planes() == 3)?;
        (section.speed > 0.0 || section.first != [1.0; 3])
            .then(|| format!("red and blue follow green at a speed of {} a frame", section.speed))
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let electronics = &scene.file().electronics;
        let Some(section) = &electronics.white_balance else { return Ok(Bound::default()) };
        let moves = section.speed > 0.0 && scene.frame_count() > 1;
        let first =
            section.first.iter().fold([1.0_f64; 2], |[low, high], gain| [low.min(*gain), high.max(*gain)]);
        let range = if moves { section.gain } else { first };
        // Exposure and noise may make any level of it.
        Ok(Bound::grey(grey_of_gains(electronics.gamma, 1.0, range)))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let (width, height) = scene.image_size();
        let values = (width * height * scene.planes()) as u64;
        // A loop of the exposure has measured the picture already.
        let metered = if scene.file().electronics.auto_exposure.is_some() { 0 } else { METER_UNITS };
        Cost { once: 0, per_frame: values * (GAIN_UNITS + metered) }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.metering.balance.clone_from(&scene.file().electronics.white_balance);
        pipeline.passes.push(Box::new(Balance));
        Ok(())
    }
}
