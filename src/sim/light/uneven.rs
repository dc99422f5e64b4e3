//! The membrane whose reflectance varies from place to place: over evenly lit ones and those under lights alike.
//!
//! What the membrane's unevenness does to the light that the membrane gives itself is left out: that is the mean over
//! much of the dome, over which the unevenness averages out.

use glam::{DVec3, Vec4};

use super::random_field::{PLACE_UNITS, RandomField};
use super::shading::{Shading, SurfaceSample};
use crate::effect_name::EffectName;
use crate::scene::Scene;
use crate::work::Work;

/// How uneven a membrane is.
#[derive(Debug, Clone)]
pub struct Unevenness {
    /// The level of the membrane where it is evenly lit.
    pub(crate) level: f32,
    /// Standard deviation of the reflectance, part of its mean.
    pub(crate) amplitude: f32,
    /// The reflectance's deviation by place on the undeformed dome, in standard deviations.
    pub(crate) field: RandomField,
}

impl Unevenness {
    /// The brightness of a membrane that is uneven so; `even` is what it would look like without, `None`: evenly lit.
    pub(crate) fn over(self, even: Option<Box<dyn Shading>>) -> Box<dyn Shading> {
        Box::new(UnevenShading { even, uneven: self })
    }
}

struct UnevenShading {
    even: Option<Box<dyn Shading>>,
    uneven: Unevenness,
}

impl Shading for UnevenShading {
    fn level(&self, sample: &SurfaceSample) -> Vec4 {
        let even = self.even.as_ref().map_or(Vec4::splat(self.uneven.level), |even| even.level(sample));
        even * (1.0 + self.uneven.amplitude * self.uneven.field.at_single(sample.material_mm))
    }

    fn count(&self, still: u64, moved: u64, work: &mut Work) {
        if let Some(even) = &self.even {
            even.count(still, moved, work);
        }
        work.add(EffectName::UnevenMembrane, PLACE_UNITS * (still + moved));
    }

    fn marker_level(&self, scene: &Scene, position_mm: DVec3) -> [f32; 3] {
        match &self.even {
            Some(even) => even.marker_level(scene, position_mm),
            None => [scene.file().light.marker_level as f32; 3],
        }
    }
}
