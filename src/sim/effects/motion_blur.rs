//! The exposure takes time: what moves meanwhile is smeared along its way.
//!
//! The picture is the mean of pictures at the middles of equal parts of the exposure, as many as keep the step from
//! one to the next below half a pixel.

use super::speed::{farthest_px, fastest_px_per_s};
use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::raster::settings::Exposure;
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct MotionBlur;

/// Largest step between two of the averaged pictures, px: an edge smeared over steps of half a pixel differs from
/// an even smear by less than an eighth of its height.
const STEP_PX: f64 = 0.5;

/// Largest number of pictures that are averaged.
const MAX_PICTURES: f64 = 48.0;

/// Work of one more picture, a pixel.
const PICTURE_UNITS: u64 = 5;

impl Effect for MotionBlur {
    fn name(&self) -> EffectName {
        EffectName::MotionBlur
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let exposure_s = exposure_s(scene).filter(|_| scene.draws())?;
        let px = fastest_px_per_s(scene)? * exposure_s;
        Some(format!("up to {px:.2} px of motion in {exposure_s} s of exposure"))
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        // The averaged pictures lie up to so far from the one in the middle, and by half of that in the mean.
        Ok(Bound::px(0.5 * farthest_px(scene, 0.5 * exposure_s(scene).unwrap_or(0.0))?))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let (width, height) = scene.image_size();
        let more = u64::from(samples(scene).saturating_sub(1));
        Cost { once: 0, per_frame: more * (width * height * scene.planes()) as u64 * PICTURE_UNITS }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.timing.exposure =
            exposure_s(scene).map(|exposure_s| Exposure { exposure_s, samples: samples(scene) });
        Ok(())
    }
}

fn exposure_s(scene: &Scene) -> Option<f64> {
    scene.file().electronics.shutter.as_ref().map(|shutter| shutter.exposure_s).filter(|s| *s > 0.0)
}

fn smear_px(scene: &Scene) -> f64 {
    exposure_s(scene).unwrap_or(0.0) * fastest_px_per_s(scene).unwrap_or(0.0)
}

fn samples(scene: &Scene) -> u32 {
    (smear_px(scene) / STEP_PX).ceil().clamp(2.0, MAX_PICTURES) as u32
}
