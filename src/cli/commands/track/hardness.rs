//! `track --hardness`: what a model reads from the frames and from what is tracked in them.

use glam::DVec3;
use serde_json::Value;

use super::arguments::TrackArguments;
use super::rest_frame::RestFrame;
use crate::commands::input::input_fault;
use crate::commands::output::Failure;
use domecast_hardness::physics::Hardness;
use domecast_hardness::{HardnessModel, HardnessReader};
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::{CameraFrame, Tracked};

/// A model, and which of the frames it sees.
pub(super) struct HardnessLines {
    model: HardnessModel,
    every: u64,
}

impl HardnessLines {
    /// `None` where no model is named.
    pub(super) fn open(
        arguments: &TrackArguments,
        at_rest: Option<&RestFrame>,
        at_mm: DVec3,
    ) -> Result<Option<Self>, Failure> {
        let Some(path) = &arguments.hardness else { return Ok(None) };
        arguments.need_jsonl(path)?;
        if arguments.tracker.is_turned() {
            return Err(input_fault(
                path,
                "knows no picture that is turned",
                "frames as the constants have them",
            ));
        }
        let made = HardnessReader::load(path).and_then(HardnessModel::new);
        let mut model =
            made.map_err(|e| input_fault(path, format!("{}: {}", e.at, e.problem), &e.allowed))?;
        let Some(at_rest) = at_rest else {
            let allowed = "--rest FRAME of the untouched sensor";
            return Err(input_fault(path, "is given without --rest", allowed));
        };
        if !model.set_rest(&at_rest.frame()?, at_rest.counted_from(at_mm)?) {
            return Err(at_rest.fault("is not whole".into()));
        }
        Ok(Some(Self { model, every: arguments.hardness_every }))
    }

    /// Takes the frame in; what its line says of hardness, or nothing of a frame that the model does not look at.
    pub(super) fn member(
        &mut self,
        frame: Option<&CameraFrame<'_>>,
        tracked: &Tracked,
        skin: Option<&ShapeMap>,
        by_contact: Option<&Hardness>,
    ) -> Option<Value> {
        if let Some(skin) = skin {
            self.model.see_skin(skin);
        }
        tracked.frame.is_multiple_of(self.every).then(|| {
            let found = self.model.update(frame, tracked, by_contact);
            self.model.to_json(found.as_ref())
        })
    }
}
