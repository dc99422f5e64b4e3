//! What is not in focus is blurred; the pass is [`crate::electronics::defocus`].

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::electronics::defocus::{Blur, PIXELS_PER_UNIT, Widths, steps_for};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct Defocus;

impl Effect for Defocus {
    fn name(&self) -> EffectName {
        EffectName::Defocus
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let focus = scene.file().electronics.focus.as_ref().filter(|_| scene.draws())?;
        Some(format!("a pupil of {} mm, sharp at {} mm", focus.pupil_diameter_mm, focus.distance_mm))
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let Some(focus) = &scene.file().electronics.focus else { return Ok(Bound::default()) };
        let widths = Widths::of(scene, focus);
        // A spot whose blur widens to one side is pulled there by the slope of the variance.
        Ok(Bound::px(widths.steepest()))
    }

    fn is_drawn(&self) -> bool {
        true
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let Some(focus) = &scene.file().electronics.focus else { return Cost::default() };
        let (width, height) = scene.image_size();
        let steps = steps_for(Widths::of(scene, focus).largest()) as u64;
        let pixels = (width * height * scene.planes()) as u64;
        Cost { once: 0, per_frame: 2 * steps * pixels / PIXELS_PER_UNIT }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        let Some(focus) = &scene.file().electronics.focus else { return Ok(()) };
        pipeline.passes.push(Box::new(Blur::of(scene, focus)));
        Ok(())
    }
}
