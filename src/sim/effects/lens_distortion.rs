//! The lens bends the image: without it, a pinhole of the same camera matrix.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::geometry_bound::{called_for, shift_px};
use crate::raster::sensor_state::units;
use crate::raster::settings::Geometry;
use crate::raster::spots::Points;
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct LensDistortion;

impl Effect for LensDistortion {
    fn name(&self) -> EffectName {
        EffectName::LensDistortion
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let spec = scene.optics().lens().spec();
        called_for(scene).lens_distortion.then(|| format!("the lens is {}, not a pinhole", spec.model))
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let with = called_for(scene);
        Ok(Bound::px(shift_px(scene, with, Geometry { lens_distortion: false, ..with })?))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        Cost { once: 0, per_frame: Points::count(scene) * units::LENS }
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.geometry.lens_distortion = true;
        Ok(())
    }
}
