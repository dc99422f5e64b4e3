//! The entrance pupil moves along the axis with the field angle: without it, all rays cross one point.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::geometry_bound::{called_for, shift_px};
use crate::raster::sensor_state::units;
use crate::raster::settings::Geometry;
use crate::raster::spots::Points;
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct PupilShift;

impl Effect for PupilShift {
    fn name(&self) -> EffectName {
        EffectName::PupilShift
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let end = scene.optics().lens().pupil_range_mm();
        called_for(scene)
            .pupil_shift
            .then(|| format!("the pupil moves between {:.3} and {:.3} mm", end.0, end.1))
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let with = called_for(scene);
        Ok(Bound::px(shift_px(scene, with, Geometry { pupil_shift: false, ..with })?))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        Cost { once: 0, per_frame: Points::count(scene) * units::PUPIL }
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.geometry.pupil_shift = true;
        Ok(())
    }
}
