//! The rows are exposed one after the other, and what moves is sheared or stretched.
//!
//! The picture is drawn in bands of rows, each at the time of its middle row, as many as keep the motion from one
//! band to the next below a fifth of the scene's tolerance, and below 0.02 px.

use super::speed::fastest_px_per_s;
use crate::sim::effect::{Bound, Cost, Effect, EffectName};
use crate::sim::pipeline::Rolling;
use crate::sim::{Pipeline, Scene, SimError};

/// See the module.
pub struct RollingShutter;

/// Largest motion from band to band, px.
const STEP_PX: f64 = 0.02;

/// Work of one more band: pose, places of dots and markers.
const BAND_UNITS: u64 = 60_000;

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
        Ok(Bound::px(0.5 * roll_px(scene)))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        Cost { once: 0, per_frame: u64::from(bands(scene).saturating_sub(1)) * BAND_UNITS }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.timing.rolling =
            readout_s(scene).map(|readout_s| Rolling { readout_s, bands: bands(scene) });
        Ok(())
    }
}

fn readout_s(scene: &Scene) -> Option<f64> {
    scene.file().electronics.shutter.as_ref().map(|shutter| shutter.readout_s).filter(|s| *s > 0.0)
}

fn roll_px(scene: &Scene) -> f64 {
    readout_s(scene).unwrap_or(0.0) * fastest_px_per_s(scene).unwrap_or(0.0)
}

fn bands(scene: &Scene) -> u32 {
    let step = STEP_PX.min(0.2 * scene.file().tolerance.px);
    let most = scene.image_size().1.max(2) as f64;
    (roll_px(scene) / step).ceil().clamp(2.0, most) as u32
}
