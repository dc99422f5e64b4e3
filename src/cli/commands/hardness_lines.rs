//! `--hardness MODEL`: what a model reads from the frames and from what is tracked in them.

use std::path::Path;

use glam::DVec3;
use serde_json::Value;

use super::input::input_fault;
use super::output::Failure;
use super::rest_frame::RestFrame;
use super::tracker_arguments::TrackerArguments;
use domecast_hardness::physics::Hardness;
use domecast_hardness::{HardnessModel, HardnessReader};
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::{CameraFrame, Tracked};

/// A model, and which of the frames it sees.
pub struct HardnessLines {
    model: HardnessModel,
    every: u64,
}

impl HardnessLines {
    /// Over a model, which sees each `every`-th frame.
    pub fn open(
        (path, every): (&Path, u64),
        tracker: &TrackerArguments,
        at_rest: Option<&RestFrame>,
        at_mm: DVec3,
    ) -> Result<Self, Failure> {
        if tracker.is_turned() {
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
        Ok(Self { model, every })
    }

    /// Takes in what a frame's shape says of the frame at rest.
    pub fn see_skin(&mut self, skin: &ShapeMap) {
        self.model.see_skin(skin);
    }

    /// Takes the frame in; what its line says of hardness, or nothing of a frame that the model does not look at.
    pub fn member(
        &mut self,
        frame: Option<&CameraFrame<'_>>,
        tracked: &Tracked,
        skin: Option<&ShapeMap>,
        by_contact: Option<&Hardness>,
    ) -> Option<Value> {
        if let Some(skin) = skin {
            self.see_skin(skin);
        }
        tracked.frame.is_multiple_of(self.every).then(|| {
            let found = self.model.update(frame, tracked, by_contact);
            self.model.to_json(found.as_ref())
        })
    }
}

/// What a line states of hardness, as people read it.
pub fn in_words(member: &Value) -> String {
    let number = |name: &str| member[name].as_f64();
    match (member["class"].as_str(), number("log10_youngs_modulus_mpa"), member["reason"].as_str()) {
        (_, _, Some(reason)) => format!("unsure ({})", reason.replace('_', " ")),
        (Some(class), _, _) => format!("{class} ({:.3})", number("probability").unwrap_or(f64::NAN)),
        (_, Some(log10), _) => {
            let end = |at: usize| 10_f64.powf(member["interval_90"][at].as_f64().unwrap_or(f64::NAN));
            format!("{:.3} MPa (90 %: {:.3} to {:.3})", 10_f64.powf(log10), end(0), end(1))
        }
        _ => "not enough frames".into(),
    }
}
