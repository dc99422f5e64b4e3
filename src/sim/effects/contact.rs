//! Objects dent the dome, and press the platform on its springs.

use crate::mechanics::contact::Level;
use crate::sim::effect::{Bound, Cost, Effect, EffectName};
use crate::sim::scene::file::LevelName;
use crate::sim::spots::Points;
use crate::sim::{Pipeline, Scene, SimError};

/// See the module.
pub struct Contact;

/// Times at which an object's way is looked at.
const LOOKS: u32 = 257;

/// Predicted work of a balance by level: contact solves, each over the nodes that may touch.
fn per_frame(level: LevelName) -> u64 {
    match level {
        LevelName::Geometric => 2_000_000,
        LevelName::ClosedForm => 3_000_000,
        LevelName::Linear => 100_000_000,
        LevelName::NeoHookean => 20_000_000_000,
    }
}

/// The level that the scene takes for exact.
pub fn level_of(scene: &Scene) -> Level {
    let element_mm = scene.file().contact.element_mm;
    match scene.file().contact.level {
        LevelName::Geometric => Level::Geometric,
        LevelName::ClosedForm => Level::ClosedForm,
        LevelName::Linear => Level::Linear { element_mm },
        LevelName::NeoHookean => Level::NeoHookean { element_mm },
    }
}

impl Effect for Contact {
    fn name(&self) -> EffectName {
        EffectName::Contact
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let radius_mm = scene.optics().dome_radius_mm();
        let end_s = scene.time_s(scene.frame_count().saturating_sub(1));
        let touches = |object: &&crate::sim::scene::object::SceneObject| {
            (0..LOOKS).any(|k| object.may_touch(end_s * f64::from(k) / f64::from(LOOKS - 1), radius_mm))
        };
        let object = scene.objects().iter().find(touches)?;
        Some(format!("{} may touch the dome; {} level", object.name, level_of(scene).name()))
    }

    fn bound(&self, _scene: &Scene) -> Result<Bound, SimError> {
        // What a touched dome shows without the touch has no bound worth a tolerance.
        Ok(Bound::UNBOUNDED)
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let level = scene.file().contact.level;
        let once = if level >= LevelName::Linear { 2_000_000_000 } else { 0 };
        Cost { once, per_frame: per_frame(level) + Points::count(scene) * 100 }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.contact = Some(level_of(scene));
        Ok(())
    }
}
