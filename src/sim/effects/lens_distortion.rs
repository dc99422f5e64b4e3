//! The lens bends the image: without it, a pinhole.

use crate::camera::Model;
use crate::sim::effect::{Bound, Cost, Effect, EffectName};
use crate::sim::{Pipeline, Scene, SimError};

/// See the module.
pub struct LensDistortion;

impl Effect for LensDistortion {
    fn name(&self) -> EffectName {
        EffectName::LensDistortion
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let spec = scene.optics().lens().spec();
        let bends = match spec.model {
            Model::Pinhole => false,
            Model::BrownConrady => spec.distortion.iter().any(|k| *k != 0.0),
            // Without coefficients it is still equidistant, not perspective.
            Model::KannalaBrandt => true,
        };
        bends.then(|| format!("the lens is {}", spec.model))
    }

    fn bound(&self, _scene: &Scene) -> Result<Bound, SimError> {
        Ok(Bound::UNBOUNDED)
    }

    fn cost(&self, _scene: &Scene) -> Cost {
        Cost::default()
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.geometry.lens_distortion = true;
        Ok(())
    }
}
