//! The elastomer yields slowly, and recovers slowly: [`domecast_contact::GelMemory`].

use crate::bound::Bound;
use crate::contact::level::largest_px_per_mm;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::geometry_bound::dome_moved_mm;
use crate::{Pipeline, Scene, SimError};
use domecast_contact::Relaxation;
use domecast_design::DesignError;

/// See the module.
pub struct SlowGel;

/// Contact solves of a frame with springs that are found anew beside what the gel remembers, over those without.
const MORE_SOLVES: u64 = 2;

fn relaxation_of(scene: &Scene) -> Result<Option<(Relaxation, f64)>, SimError> {
    let young_mpa = scene.design().sections().elastomer.young_modulus_mpa;
    let Some(section) = &scene.file().slow_gel else { return Ok(None) };
    let found = section
        .resolved(young_mpa)
        .map_err(|error| DesignError::at("slow_gel.terms", "", error.to_string(), "terms of a relaxation"))?;
    Ok(Some(found))
}

impl Effect for SlowGel {
    fn name(&self) -> EffectName {
        EffectName::SlowGel
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let (relaxation, _) = relaxation_of(scene).ok()??;
        (!scene.objects().is_empty() && relaxation.relaxed() < 1.0).then(|| {
            let slowest_s = relaxation.terms().iter().map(|term| term.time_s).fold(0.0, f64::max);
            format!(
                "the modulus falls to {:.3} of its instant value, the slowest term in {slowest_s} s",
                relaxation.relaxed()
            )
        })
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let Some((relaxation, _)) = relaxation_of(scene)? else { return Ok(Bound::default()) };
        let left = relaxation.relaxed();
        // What is left of a shape that bears no force is at most what the modulus loses. Under a force the dome sinks as that
        // of another modulus, at most Hertz' power of it: then springs move by what the contact's stiffness loses.
        let part = (1.0 - left).max(left.powf(-2.0 / 3.0) - 1.0);
        let px = part * dome_moved_mm(scene)? * largest_px_per_mm(scene);
        // Under the design's lights a membrane of another shape may be lit quite otherwise.
        let lit = scene.draws() && scene.file().light.leds.is_some();
        Ok(Bound { px, grey: if lit && px > 0.0 { 255.0 } else { 0.0 } })
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let contact = super::contact::ContactEffect.cost(scene);
        Cost { once: 0, per_frame: MORE_SOLVES * contact.per_frame }
    }

    fn needs(&self) -> &'static [EffectName] {
        &[EffectName::Contact]
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.slow_gel = relaxation_of(scene)?;
        Ok(())
    }
}
