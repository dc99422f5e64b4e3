//! From light on the sensor to the camera's bytes, with the gains that follow the frames before.

use std::sync::PoisonError;

use crate::SimError;
use crate::contact::between::Around;
use crate::contact::level::map_step_mm;
use crate::electronics::pass::{Gains, PassContext, Stage, run_coded};
use crate::output::depth::DepthMaps;
use crate::output::drawn::{Drawn, Exposed, Scratch};
use crate::output::render::Renderer;
use crate::output::truth::ExposureTruth;
use crate::raster::sensor_state::SensorState;
use crate::work::Work;

/// What looks at a frame, with the touched dome about it.
type See<'a> = dyn FnMut(u32, Option<&Around>) -> Result<(), SimError> + 'a;

impl Renderer<'_> {
    /// What each pixel sees, where the scene wants it.
    pub(super) fn depth(&self, now: &SensorState, around: Option<&Around>) -> Option<DepthMaps> {
        let optics = now.eye.optics(self.eye.reference()).filter(|_| self.scene.file().output.depth)?;
        let step_mm = map_step_mm(self.pipeline.contact);
        let contact = around.map(|around| around.now.contact.as_deref());
        Some(DepthMaps::new(now, optics, self.scene.image_size(), step_mm, contact))
    }

    /// From light on the sensor to the camera's bytes, with the gains of the frame.
    pub(super) fn develop(&self, exposed: Exposed, gains: &Gains, scratch: &mut Scratch) -> Drawn {
        let Exposed { frame, mut truth, contact, depth, mut work, .. } = exposed;
        let context = PassContext { frame: truth.frame, seed: self.scene.file().seed, gains: *gains };
        truth.depth = depth.as_ref().map(|maps| maps.truth);
        let mut coding = None;
        let image = frame.map(|mut frame| {
            self.run_passes(&mut frame, &context, &mut work, |stage| stage > Stage::Focus);
            let bytes = std::mem::take(&mut scratch.bytes);
            let mut image = frame.encode_into(self.scene.file().electronics.gamma, bytes);
            coding = run_coded(&self.pipeline.coded_passes, &mut image, &context, &mut work);
            scratch.frame = Some(frame);
            image
        });
        if self.pipeline.metering.is_used() {
            truth.exposure = Some(ExposureTruth { gain: gains.exposure, white_balance: gains.balance });
        }
        Drawn { image, truth, contact, depth, coding, work }
    }

    /// The gains of a frame: where they follow the frames before, those are drawn for it that are not known yet.
    pub(super) fn gains(&self, number: u32) -> Result<Gains, SimError> {
        let metering = &self.pipeline.metering;
        if !metering.is_used() {
            return Ok(Gains::default());
        }
        // Gains that a panic left behind are right as far as they go. No thread draws while it holds them.
        let known = || self.gains.lock().unwrap_or_else(PoisonError::into_inner);
        let mut gains = known().clone();
        if gains.is_empty() {
            gains.push(metering.first());
        }
        let first = gains.len() as u32 - 1;
        if first < number {
            let mut scratch = Scratch::default();
            self.each_around(number, &mut |k, around| {
                if k < first || k >= number {
                    return Ok(());
                }
                let meter = self.expose(k, around, &mut scratch)?.meter;
                let next = gains.last().zip(meter.as_ref()).map(|(last, meter)| metering.next(*last, meter));
                gains.extend(next);
                Ok(())
            })?;
            let mut known = known();
            if known.len() < gains.len() {
                known.clone_from(&gains);
            }
        }
        Ok(gains.get(number as usize).copied().unwrap_or_default())
    }

    /// All frames up to one, in order, with the touched dome about each.
    pub(super) fn each_around(&self, last: u32, see: &mut See<'_>) -> Result<(), SimError> {
        let Some(mut stepper) = self.stepper()? else {
            return (0..=last).try_for_each(|k| see(k, None));
        };
        let mut work = Work::default();
        let mut touches = Vec::new();
        for k in 0..=last {
            let ahead = k.saturating_add(1).min(self.scene.frame_count().saturating_sub(1)).max(k);
            for next in touches.len() as u32..=ahead {
                touches.push(stepper.next(next, self.scene.time_s(next), &mut work)?);
            }
            see(k, Around::of(&touches, k as usize).as_ref())?;
        }
        Ok(())
    }
}
