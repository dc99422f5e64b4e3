//! What all effects have in common.

use serde::Serialize;

use crate::SimError;
use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::pipeline::Pipeline;
use crate::scene::Scene;

/// Predicted work, in the units of [`crate::Work`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Cost {
    /// Once for a scene: tables, factorisations.
    pub once: u64,
    /// For each frame.
    pub per_frame: u64,
}

impl Cost {
    /// For a whole sequence.
    pub fn total(&self, frames: u64) -> u64 {
        self.once.saturating_add(self.per_frame.saturating_mul(frames))
    }
}

/// One effect: one file.
pub trait Effect: Sync {
    /// Which one it is.
    fn name(&self) -> EffectName;

    /// Why the scene calls for it, with the numbers that say so; `None` where the scene does not.
    fn calls_for(&self, scene: &Scene) -> Option<String>;

    /// How large it can be in a scene that calls for it.
    ///
    /// # Errors
    /// A scene on which the bound cannot be computed (the fault is then the scene's).
    fn bound(&self, scene: &Scene) -> Result<Bound, SimError>;

    /// Whether the plan looks up in pictures of the scene what it does to a pixel: then `bound` tells of places alone.
    fn is_drawn(&self) -> bool {
        false
    }

    /// What it costs in a scene that calls for it.
    fn cost(&self, scene: &Scene) -> Cost;

    /// Other effects without which this one has nothing to act on: where one of them is left out, so is this.
    fn needs(&self) -> &'static [EffectName] {
        &[]
    }

    /// Puts its part into the pipeline: a flag of the geometry, a pass over the picture, a table. Called only
    /// for effects that the plan uses, in the order of [`EffectName`]; whatever memory it takes is taken here.
    ///
    /// # Errors
    /// A scene that the effect cannot be computed for.
    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError>;
}
