//! The air gap changes as the platform moves, and the bend with it: without it, the points that a straight ray
//! shows at rest move rigidly with the platform, and no ray is solved in a frame.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::geometry_bound::{called_for, shift_px};
use crate::raster::sensor_state::units;
use crate::raster::settings::Geometry;
use crate::raster::spots::Points;
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct GapChange;

impl Effect for GapChange {
    fn name(&self) -> EffectName {
        EffectName::GapChange
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        called_for(scene)
            .gap_change
            .then(|| "the platform moves, so the air between camera and sheet changes".into())
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        if !scene.objects().is_empty() {
            // Points of a dome out of shape have no apparent place at rest.
            return Ok(Bound::UNBOUNDED);
        }
        let with = called_for(scene);
        Ok(Bound::px(shift_px(scene, with, Geometry { gap_change: false, ..with })?))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        // One frame's worth is done once without it.
        let frames = u64::from(scene.frame_count());
        Cost { once: 0, per_frame: Points::count(scene) * units::BEND * (frames - 1) / frames.max(1) }
    }

    fn needs(&self) -> &'static [EffectName] {
        &[EffectName::Refraction, EffectName::SheetMotion]
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.geometry.gap_change = true;
        Ok(())
    }
}
