//! `track --hardness`: what a model reads from the frames and from what is tracked in them.

use std::path::Path;

use glam::DVec2;
use serde_json::json;

use super::arguments::TrackArguments;
use super::decode;
use crate::commands::input::input_fault;
use crate::commands::output::Failure;
use domecast_hardness::{FrameView, HardnessReader, Metadata};
use domecast_runtime::track::{CameraFrame, Tracked, Tracker};
use domecast_springs::Displacement;

/// Readings that a model may ask for, in the data set's words; the dots' ones follow from each dot's motion.
const KNOWN: [&str; 15] = [
    "fx_n",
    "fy_n",
    "fz_n",
    "mx_nmm",
    "my_nmm",
    "mz_nmm",
    "tx_mm",
    "ty_mm",
    "tz_mm",
    "rx_rad",
    "ry_rad",
    "rz_rad",
    "dots_mean_px",
    "dots_radial_px",
    "dots_divergence",
];
/// Spread of the weight about the contact's centre in which the divergence is fitted, part of the picture's height: the data
/// set's own.
const NEAR_PART: f64 = 0.12;

/// What is tracked of the frame at rest, and is taken off.
struct Rest {
    numbers: [f64; 12],
    dots_px: Vec<Option<DVec2>>,
}

/// A model, and which of the frames it sees.
pub(super) struct HardnessLines {
    reader: HardnessReader,
    /// For each of the model's readings its number in [`KNOWN`].
    columns: Vec<usize>,
    rest: Rest,
    at_mm: glam::DVec3,
    height_px: f64,
    every: u64,
    readings: Vec<f64>,
}

fn columns(model: &Path, metadata: &Metadata) -> Result<Vec<usize>, Failure> {
    let known = |name: &str| KNOWN.iter().position(|other| *other == name);
    let names = metadata.readings.iter().map(|reading| reading.name.as_str());
    names
        .map(|name| {
            let problem = || format!("needs the reading \"{name}\", which `track` does not have");
            known(name).ok_or_else(|| input_fault(model, problem(), &KNOWN.join(", ")))
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

/// Wrench and motion of the platform's point about which the wrench is stated; not a number where they are not known.
fn numbers(tracked: &Tracked, at_mm: glam::DVec3) -> [f64; 12] {
    let (Some(wrench), Some(pose)) = (tracked.wrench, tracked.pose) else { return [f64::NAN; 12] };
    let parts = [wrench.to_array(), Displacement::of_pose(&pose, at_mm).to_array()];
    std::array::from_fn(|k| parts[k / 6][k % 6])
}

fn moved_px(tracked: &Tracked) -> impl Iterator<Item = Option<(DVec2, DVec2)>> {
    tracked.black_dots.iter().map(|dot| {
        let at_px = dot.undeformed_px?;
        Some((at_px, dot.image_px? - at_px))
    })
}

impl HardnessLines {
    /// `None` where no model is named.
    pub(super) fn open(
        arguments: &TrackArguments,
        tracker: &Tracker,
        at_mm: glam::DVec3,
    ) -> Result<Option<Self>, Failure> {
        let Some(model) = &arguments.hardness else { return Ok(None) };
        let mut reader = HardnessReader::load(model)
            .map_err(|e| input_fault(model, format!("{}: {}", e.at, e.problem), &e.allowed))?;
        let columns = columns(model, reader.metadata())?;
        let Some(path) = &arguments.rest else {
            return Err(input_fault(
                model,
                "is given without --rest",
                "--rest FRAME of the untouched sensor",
            ));
        };
        let fault = |problem: String| input_fault(path, problem, "a frame of the untouched sensor");
        let bytes = std::fs::read(path).map_err(|e| fault(format!("cannot be read: {e}")))?;
        let picture = decode::picture(&bytes).map_err(&fault)?;
        let frame = CameraFrame::new(picture.width, picture.height, picture.channels, &picture.bytes)
            .map_err(|e| fault(e.to_string()))?;
        if !reader.set_rest(&view(&frame)) {
            return Err(fault("is not whole".into()));
        }
        let mut at_rest = tracker.clone();
        let tracked = at_rest.track(0, &frame);
        let rest = Rest {
            numbers: numbers(tracked, at_mm),
            dots_px: moved_px(tracked).map(|dot| dot.map(|(_, moved)| moved)).collect(),
        };
        if rest.numbers.iter().any(|value| !value.is_finite()) && columns.iter().any(|at| *at < 12) {
            return Err(fault(format!("has no wrench (status \"{}\")", tracked.status())));
        }
        let (every, height_px) = (arguments.hardness_every, frame.height() as f64);
        Ok(Some(Self { reader, columns, rest, at_mm, height_px, every, readings: Vec::new() }))
    }

    /// Mean motion of the dots (px), its mean part away from the contact's centre (px), its divergence there: as in the data
    /// sets. The centre is the mean of the dots' places weighted by the squares of their motions. Motions are those from rest,
    /// less the platform's own.
    fn dots(&self, tracked: &Tracked) -> [f64; 3] {
        let moved = || {
            let pairs = moved_px(tracked).zip(&self.rest.dots_px);
            pairs.filter_map(|(dot, rest)| dot.zip(*rest).map(|((at, moved), rest)| (at, moved - rest)))
        };
        let (count, weight) =
            moved().fold((0.0, 0.0), |(count, sum), (_, moved)| (count + 1.0, sum + moved.length_squared()));
        if count == 0.0 {
            return [f64::NAN; 3];
        }
        if weight <= 0.0 {
            return [0.0; 3];
        }
        let center = moved().map(|(at, moved)| at * moved.length_squared()).sum::<DVec2>() / weight;
        let mean = moved().map(|(_, moved)| moved.length()).sum::<f64>() / count;
        let out =
            moved().map(|(at, moved)| (at - center).normalize_or_zero().dot(moved)).sum::<f64>() / count;
        let near_px = NEAR_PART * self.height_px;
        let (mut along, mut squares) = (0.0, 0.0);
        for (at, moved) in moved() {
            let from = at - center;
            let near = (-0.5 * from.length_squared() / (near_px * near_px)).exp();
            along += near * from.dot(moved);
            squares += near * from.length_squared();
        }
        [mean, out, if squares > 0.0 { 2.0 * along / squares } else { 0.0 }]
    }

    /// Takes the frame in, and puts `hardness` into its JSON line, which ends with `}` and a line feed, once the window is full.
    pub(super) fn write(
        &mut self,
        frame: Option<&CameraFrame<'_>>,
        tracked: &Tracked,
        line: Option<&mut Vec<u8>>,
    ) {
        if !tracked.frame.is_multiple_of(self.every) {
            return;
        }
        let of_frame = numbers(tracked, self.at_mm);
        let dots = self.dots(tracked);
        let value = |at: usize| if at < 12 { of_frame[at] - self.rest.numbers[at] } else { dots[at - 12] };
        self.readings.clear();
        self.readings.extend(self.columns.iter().map(|at| value(*at)));
        let whole = frame.filter(|_| tracked.status() == "ok").map(view);
        if whole.is_none() {
            self.reader.restart();
            return;
        }
        let Some(found) = self.reader.push(whole.as_ref(), &self.readings) else { return };
        let Some(line) = line else { return };
        let stated = match found {
            Ok(found) => {
                let modulus = self.reader.states_modulus();
                json!({
                    "class": self.reader.class(found.class).map(|class| class.name.as_str()),
                    "probability": found.probability,
                    "log10_e_mpa": modulus.then_some(found.log10_e_mpa),
                    "interval": modulus.then_some(found.interval),
                    "status": "ok",
                })
            }
            Err(unsure) => json!({
                "class": null, "probability": null, "log10_e_mpa": null, "interval": null,
                "status": "unsure", "reason": self.reader.reason(unsure),
            }),
        };
        if line.ends_with(b"}\n") {
            line.truncate(line.len() - 2);
            line.extend(format!(",\"hardness\":{stated}}}\n").bytes());
        }
    }
}
