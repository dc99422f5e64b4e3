//! The rows are exposed one after the other, and what moves is sheared or stretched.
//!
//! The sensor is computed at the times of some slices of rows. Each point of a dot or marker is seen where its way in
//! the image meets the row that is exposed just then, exactly; the brightness of the membrane is that of the slice's
//! middle row. There are as many slices as keep the motion within one below 0.1 px and below half of the scene's
//! tolerance, [`MAX_SLICES`] at most.

use super::speed::{farthest_px, fastest_px_per_s};
use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::raster::settings::Rolling;
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct RollingShutter;

/// Largest motion in a slice, px.
const STEP_PX: f64 = 0.1;

/// Most slices: each holds its own tables of the deformed membrane. What moves by more than `MAX_SLICES * STEP_PX`
/// during the readout has its shadows and creases, not its dots, up to half a slice's motion out of place.
const MAX_SLICES: f64 = 64.0;

/// Work of one more slice: pose and tables.
const SLICE_UNITS: u64 = 25_000;

impl Effect for RollingShutter {
    fn name(&self) -> EffectName {
        EffectName::RollingShutter
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let readout_s = readout_s(scene).filter(|_| scene.draws())?;
        let px = fastest_px_per_s(scene)? * readout_s;
        Some(format!("up to {px:.2} px of motion in the {readout_s} s from the first row to the last"))
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        // The first and the last row are half of the readout away from the frame's time.
        Ok(Bound::px(farthest_px(scene, 0.5 * readout_s(scene).unwrap_or(0.0))?))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        Cost { once: 0, per_frame: u64::from(slices(scene)) * SLICE_UNITS }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.timing.rolling =
            readout_s(scene).map(|readout_s| Rolling { readout_s, slices: slices(scene) });
        Ok(())
    }
}

fn readout_s(scene: &Scene) -> Option<f64> {
    scene.file().electronics.shutter.as_ref().map(|shutter| shutter.readout_s).filter(|s| *s > 0.0)
}

fn roll_px(scene: &Scene) -> f64 {
    readout_s(scene).unwrap_or(0.0) * fastest_px_per_s(scene).unwrap_or(0.0)
}

fn slices(scene: &Scene) -> u32 {
    let step = STEP_PX.min(0.5 * scene.file().tolerance.px);
    let rows = scene.image_size().1.max(2) as f64;
    (roll_px(scene) / step).ceil().clamp(2.0, rows.min(MAX_SLICES)) as u32
}
