//! Each colour is bent by its own index: without it, all by that of green.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::geometry_bound::{called_for, shift_px};
use crate::raster::sensor_state::units;
use crate::raster::settings::Geometry;
use crate::raster::spots::Points;
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct Dispersion;

impl Effect for Dispersion {
    fn name(&self) -> EffectName {
        EffectName::Dispersion
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        called_for(scene)
            .dispersion
            .then(|| "the layers have an index for each colour, and the frames are in colour".into())
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let with = called_for(scene);
        Ok(Bound::px(shift_px(scene, with, Geometry { dispersion: false, ..with })?))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        // Two more colours: all that is done for a point, and each dot drawn twice more.
        let point = units::STRAIGHT + units::LENS + units::BEND;
        Cost { once: 0, per_frame: 2 * Points::count(scene) * point }
    }

    fn needs(&self) -> &'static [EffectName] {
        &[EffectName::Refraction]
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.geometry.dispersion = true;
        Ok(())
    }
}
