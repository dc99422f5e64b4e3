//! The platform moves on its springs: without it, it stays at rest.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::geometry_bound::{called_for, shift_px};
use crate::raster::sensor_state::units;
use crate::raster::settings::Geometry;
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct SheetMotion;

impl Effect for SheetMotion {
    fn name(&self) -> EffectName {
        EffectName::SheetMotion
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        called_for(scene).sheet_motion.then(|| "a load, a pose or an object moves the platform".into())
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let with = called_for(scene);
        Ok(Bound::px(shift_px(scene, with, Geometry { sheet_motion: false, gap_change: false, ..with })?))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let _ = scene;
        Cost { once: 0, per_frame: units::BALANCE }
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.geometry.sheet_motion = true;
        Ok(())
    }
}
