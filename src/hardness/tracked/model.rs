//! By a network: from frames and what is tracked in them.

use serde_json::{Value, json};

use super::rest::TrackedRest;
use crate::columns::{COLUMNS, DOT_COLUMNS, RIGID_COLUMNS, SeenDot, dots_features};
use crate::error::ModelError;
use crate::physics::Hardness;
use crate::picture::FrameView;
use crate::reader::{HardnessEstimate, HardnessReader, Unsure};
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::{CameraFrame, Tracked};

/// A model that is given its readings by the tracker.
#[derive(Debug, Clone)]
pub struct HardnessModel {
    reader: HardnessReader,
    /// For each of the model's readings its number in [`COLUMNS`].
    columns: Vec<usize>,
    rest: Option<(TrackedRest, f64)>,
    readings: Vec<f64>,
    seen: Vec<Option<SeenDot>>,
    /// A frame's skin lay above its shape at rest: what is counted from the frame at rest is wrong.
    is_rest_touched: bool,
}

fn columns(reader: &HardnessReader) -> Result<Vec<usize>, ModelError> {
    let column = |name: &str| {
        let known = COLUMNS.iter().position(|other| *other == name);
        known.filter(|at| RIGID_COLUMNS.contains(at) || DOT_COLUMNS.contains(at)).ok_or_else(|| {
            let allowed = [&COLUMNS[RIGID_COLUMNS], &COLUMNS[DOT_COLUMNS]].concat().join(", ");
            ModelError::new("readings", format!("needs \"{name}\", which `track` does not have"), allowed)
        })
    };
    reader.metadata().readings.iter().map(|reading| column(&reading.name)).collect()
}

fn view<'a>(frame: &CameraFrame<'a>) -> FrameView<'a> {
    FrameView {
        width: frame.width(),
        height: frame.height(),
        channels: frame.channels(),
        bytes: frame.bytes(),
    }
}

impl HardnessModel {
    /// Over a model; it says nothing before it is given the untouched sensor.
    ///
    /// # Errors
    /// [`ModelError`]: it needs a reading that no tracker has, such as the hand's travel.
    pub fn new(reader: HardnessReader) -> Result<Self, ModelError> {
        let columns = columns(&reader)?;
        let (readings, seen) = (Vec::new(), Vec::new());
        Ok(Self { reader, columns, rest: None, readings, seen, is_rest_touched: false })
    }

    /// Takes the frame of the untouched sensor, and what is tracked in it. False: it is not whole.
    pub fn set_rest(&mut self, frame: &CameraFrame<'_>, rest: TrackedRest) -> bool {
        let is_whole = self.reader.set_rest(&view(frame));
        self.rest = is_whole.then(|| (rest, frame.height() as f64));
        self.is_rest_touched = false;
        is_whole
    }

    /// Whether it was given the untouched sensor: it says nothing before.
    pub fn has_rest(&self) -> bool {
        self.rest.is_some()
    }

    /// Takes in what a frame's shape says of the frame at rest: of every frame with one, before [`HardnessModel::update`].
    pub fn see_skin(&mut self, skin: &ShapeMap) {
        self.is_rest_touched |= skin.is_raised;
    }

    /// The frame's numbers as the data sets have them: less those at rest.
    fn read(&mut self, tracked: &Tracked) {
        self.readings.clear();
        let Some((rest, height_px)) = &self.rest else { return };
        let rigid = rest.rigid(tracked);
        self.seen.clear();
        self.seen.extend(rest.dots(tracked));
        let [mean, radial, divergence, found] = dots_features(&self.seen, *height_px);
        let dots = if found > 0.0 { [mean, radial, divergence] } else { [f64::NAN; 3] };
        self.readings.extend(self.columns.iter().map(|column| match column.checked_sub(DOT_COLUMNS.start) {
            None => rigid.as_flattened()[column - RIGID_COLUMNS.start],
            Some(at) => dots[at],
        }));
    }

    /// Takes the next frame in, with what contact mechanics says of it where that has measured something. `None` until the window is full, which
    /// begins anew at a frame that is missing or not `ok`.
    pub fn update(
        &mut self,
        frame: Option<&CameraFrame<'_>>,
        tracked: &Tracked,
        by_contact: Option<&Hardness>,
    ) -> Option<Result<HardnessEstimate, Unsure>> {
        let whole = frame.filter(|_| self.has_rest() && tracked.status() == "ok").map(view);
        if whole.is_none() {
            self.reader.restart();
            return None;
        }
        self.read(tracked);
        let found = self.reader.push(whole.as_ref(), &self.readings)?;
        Some(found.and_then(|found| self.held_to(found, by_contact)))
    }

    fn held_to(
        &self,
        found: HardnessEstimate,
        by_contact: Option<&Hardness>,
    ) -> Result<HardnessEstimate, Unsure> {
        if self.is_rest_touched {
            return Err(Unsure::Raised);
        }
        let by_contact = by_contact.filter(|other| other.status.is_measured());
        let is_contradicted = by_contact.is_some_and(|other| self.reader.contradicts(&found, other));
        if is_contradicted { Err(Unsure::ContradictsContactMechanics) } else { Ok(found) }
    }

    /// Forgets the frames, not the rest.
    pub fn restart(&mut self) {
        self.reader.restart();
    }

    /// The model within.
    pub fn reader(&self) -> &HardnessReader {
        &self.reader
    }

    /// What a frame has said, as `track` writes it.
    pub fn to_json(&self, found: Option<&Result<HardnessEstimate, Unsure>>) -> Value {
        match found {
            None => Value::Null,
            Some(Ok(found)) => {
                let modulus = self.reader.states_modulus();
                json!({
                    "status": "ok",
                    "class": self.reader.class(found.class).map(|class| class.name.as_str()),
                    "probability": found.probability,
                    "log10_youngs_modulus_mpa": modulus.then_some(found.log10_e_mpa),
                    "interval_90": modulus.then_some(found.interval),
                })
            }
            Some(Err(why)) => json!({
                "status": "unsure",
                "reason": self.reader.reason(*why),
                "class": null, "probability": null, "log10_youngs_modulus_mpa": null, "interval_90": null,
            }),
        }
    }
}
