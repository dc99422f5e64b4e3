//! `track --hardness`: what a model reads from the frames and from what is tracked in them.

use std::path::Path;

use glam::DVec3;
use serde_json::{Value, json};

use super::arguments::TrackArguments;
use super::rest_frame::RestFrame;
use crate::commands::input::input_fault;
use crate::commands::output::Failure;
use domecast_dataset::{COLUMNS, DOT_COLUMNS, RIGID_COLUMNS, SeenDot, TrackedRest, dots_features};
use domecast_hardness::physics::Hardness;
use domecast_hardness::{FrameView, HardnessEstimate, HardnessReader, Unsure};
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::{CameraFrame, Tracked};

/// A model, and which of the frames it sees.
pub(super) struct HardnessLines {
    reader: HardnessReader,
    /// For each of the model's readings its number in [`COLUMNS`].
    columns: Vec<usize>,
    rest: TrackedRest,
    height_px: f64,
    every: u64,
    readings: Vec<f64>,
    seen: Vec<Option<SeenDot>>,
    /// A frame's skin lay above its shape at rest: what is counted from the frame at rest is wrong.
    is_rest_touched: bool,
}

fn columns(model: &Path, reader: &HardnessReader) -> Result<Vec<usize>, Failure> {
    let names = reader.metadata().readings.iter().map(|reading| reading.name.as_str());
    names
        .map(|name| {
            let problem = || format!("needs the reading \"{name}\", which `track` does not have");
            let known = COLUMNS.iter().position(|other| *other == name);
            let known = known.filter(|at| RIGID_COLUMNS.contains(at) || DOT_COLUMNS.contains(at));
            let allowed = || [&COLUMNS[RIGID_COLUMNS], &COLUMNS[DOT_COLUMNS]].concat().join(", ");
            known.ok_or_else(|| input_fault(model, problem(), &allowed()))
        })
        .collect()
}

fn view<'a>(frame: &CameraFrame<'a>) -> FrameView<'a> {
    FrameView {
        width: frame.width(),
        height: frame.height(),
        channels: frame.channels(),
        bytes: frame.bytes(),
    }
}

impl HardnessLines {
    /// `None` where no model is named.
    pub(super) fn open(
        arguments: &TrackArguments,
        at_rest: Option<&RestFrame>,
        at_mm: DVec3,
    ) -> Result<Option<Self>, Failure> {
        let Some(model) = &arguments.hardness else { return Ok(None) };
        arguments.need_jsonl(model)?;
        if arguments.tracker.is_turned() {
            return Err(input_fault(
                model,
                "knows no picture that is turned",
                "frames as the constants have them",
            ));
        }
        let mut reader = HardnessReader::load(model)
            .map_err(|e| input_fault(model, format!("{}: {}", e.at, e.problem), &e.allowed))?;
        let columns = columns(model, &reader)?;
        let Some(at_rest) = at_rest else {
            let allowed = "--rest FRAME of the untouched sensor";
            return Err(input_fault(model, "is given without --rest", allowed));
        };
        let frame = at_rest.frame()?;
        if !reader.set_rest(&view(&frame)) {
            return Err(at_rest.fault("is not whole".into()));
        }
        let rest = at_rest.counted_from(at_mm)?;
        let (every, height_px) = (arguments.hardness_every, frame.height() as f64);
        let (readings, seen) = (Vec::new(), Vec::new());
        Ok(Some(Self { reader, columns, rest, height_px, every, readings, seen, is_rest_touched: false }))
    }

    /// The frame's numbers as the data sets have them: less those at rest.
    fn read(&mut self, tracked: &Tracked) {
        let rigid = self.rest.rigid(tracked);
        self.seen.clear();
        self.seen.extend(self.rest.dots(tracked));
        let [mean, radial, divergence, found] = dots_features(&self.seen, self.height_px);
        let dots = if found > 0.0 { [mean, radial, divergence] } else { [f64::NAN; 3] };
        self.readings.clear();
        self.readings.extend(self.columns.iter().map(|column| match column.checked_sub(DOT_COLUMNS.start) {
            None => rigid.as_flattened()[column - RIGID_COLUMNS.start],
            Some(at) => dots[at],
        }));
    }

    /// Takes the frame in; what its line says of hardness, or nothing of a frame that the model does not look at.
    pub(super) fn member(
        &mut self,
        frame: Option<&CameraFrame<'_>>,
        tracked: &Tracked,
        skin: Option<&ShapeMap>,
        by_contact: Option<&Hardness>,
    ) -> Option<Value> {
        self.is_rest_touched |= skin.is_some_and(|map| map.is_raised);
        if !tracked.frame.is_multiple_of(self.every) {
            return None;
        }
        let whole = frame.filter(|_| tracked.status() == "ok").map(view);
        if whole.is_none() {
            self.reader.restart();
            return Some(Value::Null);
        }
        self.read(tracked);
        let found = self.reader.push(whole.as_ref(), &self.readings);
        Some(found.map_or(Value::Null, |found| self.stated(found, by_contact)))
    }

    fn stated(&self, found: Result<HardnessEstimate, Unsure>, by_contact: Option<&Hardness>) -> Value {
        let unsure = |reason: &str| {
            json!({
                "status": "unsure",
                "reason": reason,
                "class": null, "probability": null, "log10_youngs_modulus_mpa": null, "interval_90": null,
            })
        };
        match found {
            Ok(_) if self.is_rest_touched => unsure("raised"),
            Ok(found) if by_contact.is_some_and(|other| self.reader.contradicts(&found, other)) => {
                unsure("contradicts_contact_mechanics")
            }
            Ok(found) => {
                let modulus = self.reader.states_modulus();
                json!({
                    "status": "ok",
                    "class": self.reader.class(found.class).map(|class| class.name.as_str()),
                    "probability": found.probability,
                    "log10_youngs_modulus_mpa": modulus.then_some(found.log10_e_mpa),
                    "interval_90": modulus.then_some(found.interval),
                })
            }
            Err(why) => unsure(&self.reader.reason(why)),
        }
    }
}
