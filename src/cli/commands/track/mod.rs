//! `domecast track FRAMES --constants FILE`

mod arguments;
mod decode;
mod shape;
mod source;
mod times;

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use glam::DVec3;
use serde_json::json;

use super::input::{input_fault, read_constants};
use super::output::{Failure, Output};
use domecast_files::{OutputRules, StagedFile, StagedFolder};
use domecast_optics::SensorOptics;
use domecast_runtime::constants::Constants;
use domecast_runtime::track::{
    CSV_HEADER, CameraFrame, CameraTurn, DOTS_CSV_HEADER, ForceDistribution, Tracked, Tracker, Undistorted,
    overlay_png, write_csv, write_dots_csv, write_json_fields, write_json_forces,
};
use shape::ShapeFiles;
use source::FrameSource;
use times::FrameTimes;

use arguments::Format;
pub use arguments::TrackArguments;

/// Where the lines go: a file that is there whole or not at all, or standard output, frame by frame.
enum Sink {
    File(StagedFile),
    Standard(io::Stdout),
}

impl Sink {
    fn new(out: Option<&Path>, rules: &OutputRules<'_>) -> Result<Self, Failure> {
        Ok(match out {
            Some(path) => Self::File(StagedFile::new(path, "track", rules)?),
            None => Self::Standard(io::stdout()),
        })
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        match self {
            Self::File(file) => Ok(file.write(bytes)?),
            Self::Standard(out) => Ok(out.write_all(bytes).and_then(|()| out.flush())?),
        }
    }

    fn end(self, output: &Output) -> Result<(), Failure> {
        if let Self::File(file) = self {
            output.kept(file.commit()?);
        }
        Ok(())
    }
}

/// Folders that get a picture of each frame.
struct Pictures {
    overlay: Option<StagedFolder>,
    magnify: f64,
    rest: SensorOptics,
    undistorted: Option<(StagedFolder, Undistorted)>,
    buffer: Vec<u8>,
}

impl Pictures {
    fn new(
        arguments: &TrackArguments,
        rules: &OutputRules<'_>,
        constants: &Constants,
        tracker: &Tracker,
    ) -> Result<Self, Failure> {
        let folder = |path: &PathBuf| StagedFolder::new(path, "track", rules);
        let undistorted = match &arguments.undistorted {
            Some(path) => {
                Some((folder(path)?, Undistorted::new(constants).map_err(|e| unfit(arguments, &e))?))
            }
            None => None,
        };
        let overlay = arguments.overlay.as_ref().map(folder).transpose()?;
        let rest = tracker.optics().clone();
        Ok(Self { overlay, magnify: arguments.magnify, rest, undistorted, buffer: Vec::new() })
    }

    fn write(
        &mut self,
        output: &Output,
        number: u64,
        frame: &CameraFrame<'_>,
        tracked: &Tracked,
        tractions: &[(DVec3, DVec3)],
    ) -> Result<(), Failure> {
        if let Some(folder) = &self.overlay {
            let name = format!("overlay_{number:04}.png");
            match overlay_png(frame, tracked, &self.rest, self.magnify, tractions) {
                Ok(png) => folder.write(&name, &png)?,
                Err(error) => output.warn(&format!("{name}: {error}")),
            }
        }
        if let Some((folder, map)) = &self.undistorted
            && let Some(bytes) = map.of(frame, &mut self.buffer)
        {
            let png = decode::png_of(frame.width(), frame.height(), frame.channels(), bytes);
            folder.write(&format!("undistorted_{number:04}.png"), &png.map_err(Failure::Internal)?)?;
        }
        Ok(())
    }

    fn end(self, output: &Output) -> Result<(), Failure> {
        for folder in self.overlay.into_iter().chain(self.undistorted.map(|(folder, _)| folder)) {
            output.kept(folder.commit()?);
        }
        Ok(())
    }
}

/// What happened to the frames.
#[derive(Default)]
struct Tally {
    counts: BTreeMap<&'static str, u64>,
    times: Vec<Duration>,
}

impl Tally {
    /// The time, ms, that a share of the frames took at most.
    fn quantile_ms(&self, share: f64) -> f64 {
        let index = ((self.times.len() as f64 * share) as usize).min(self.times.len().saturating_sub(1));
        self.times.get(index).map_or(0.0, |t| 1e3 * t.as_secs_f64())
    }

    fn summarize(&mut self, output: &Output, out: Option<&Path>) -> Result<(), Failure> {
        let Some(path) = out else { return Ok(()) };
        self.times.sort_unstable();
        let (median, p99) = (self.quantile_ms(0.5), self.quantile_ms(0.99));
        let frames: u64 = self.counts.values().sum();
        let statuses: Vec<String> = self.counts.iter().map(|(status, n)| format!("{n} {status}")).collect();
        output.say(&format!("{}: {frames} frames, {}", path.display(), statuses.join(", ")))?;
        output.say(&format!("{median:.2} ms a frame (median), {p99:.2} ms (99 of 100)"))?;
        output.result(&json!({
            "ok": true,
            "out": path.display().to_string(),
            "frames": frames,
            "status": self.counts,
            "median_ms": median,
            "p99_ms": p99,
        }))
    }
}

fn unfit(arguments: &TrackArguments, error: &domecast_runtime::track::TrackError) -> Failure {
    input_fault(&arguments.constants, error.to_string(), "constants of a sensor")
}

/// What cures pictures that lie otherwise than the constants say.
fn turned_hint(turn: CameraTurn) -> String {
    let deg = (turn.turned_rad.to_degrees() * 10.0).round() / 10.0;
    let (how, option) = if turn.is_mirrored {
        ("mirrored left to right, then turned", "--camera-mirrored --camera-turned")
    } else {
        ("turned", "--camera-turned")
    };
    format!(
        "the picture is {how} clockwise by {deg} degrees against the constants; nothing is stated of such frames: mount the \
         camera as in the design, or track with {option} {deg}"
    )
}

/// Says what is to be done where the picture is turned, or where nothing tells whether it is.
fn tell_turn(output: &Output, turn: Option<CameraTurn>, tally: &Tally) {
    if let Some(turn) = turn {
        output.warn(&turned_hint(turn));
    } else if tally.counts.contains_key("key_unsure") {
        let whether = "the gap that tells how the picture lies is not seen (dirt, or a broken dot); nothing is stated of such \
            frames: if the camera is as the constants say, track with --camera-turned 0";
        output.warn(whether);
    }
}

/// What stands before the lines.
fn header(format: Format) -> String {
    match format {
        Format::Jsonl => String::new(),
        Format::Csv => format!("{CSV_HEADER}\n"),
        Format::DotsCsv => format!("{DOTS_CSV_HEADER}\n"),
    }
}

/// Writes a frame's line or lines.
fn write_line(
    line: &mut Vec<u8>,
    arguments: &TrackArguments,
    tracked: &Tracked,
    at_mm: DVec3,
    forces: Option<&ForceDistribution>,
) -> io::Result<()> {
    match arguments.format {
        Format::Jsonl => match forces {
            Some(forces) => write_json_forces(line, tracked, &arguments.fields, forces.result()),
            None => write_json_fields(line, tracked, &arguments.fields),
        },
        Format::Csv => write_csv(line, tracked, at_mm),
        Format::DotsCsv => write_dots_csv(line, tracked),
    }
}

fn warn_without_key(output: &Output, arguments: &TrackArguments, constants: &Constants) {
    if constants.key.is_none() {
        let whether = "a picture that is turned or mirrored may pass for a good one (constants of a new build have a key)";
        output.warn(&format!("{}: name no `key`: {whether}", arguments.constants.display()));
    }
}

/// The files that are read: none may be written.
fn inputs_of(arguments: &TrackArguments) -> Vec<&Path> {
    let named =
        arguments.frames.iter().chain([&arguments.constants]).chain(&arguments.times).chain(&arguments.rest);
    named.map(PathBuf::as_path).collect()
}

/// Over how far pressures are taken to be alike where the skin's heights are measured, mm.
const SHAPE_CORRELATION_MM: f64 = 1.0;

fn forces_of(
    arguments: &TrackArguments,
    constants: &Constants,
) -> Result<Option<ForceDistribution>, Failure> {
    // Heights tell pressures apart that dots do not.
    let correlation_mm = arguments.shape.is_some().then_some(SHAPE_CORRELATION_MM);
    let forces = arguments.traction.then(|| ForceDistribution::new(constants, correlation_mm));
    forces.transpose().map_err(|e| unfit(arguments, &e))
}

/// Finds the forces of a frame, with its heights where they are measured.
fn press(forces: &mut ForceDistribution, tracked: &Tracked, shape: Option<&ShapeFiles>) {
    match shape {
        Some(shape) => forces.update_with_shape(tracked, shape.map()),
        None => forces.update(tracked, &[]),
    };
}

fn frame_of(picture: &Result<decode::Picture, String>) -> Result<CameraFrame<'_>, String> {
    let picture = picture.as_ref().map_err(String::clone)?;
    let frame = CameraFrame::new(picture.width, picture.height, picture.channels, &picture.bytes);
    frame.map_err(|error| error.to_string())
}

/// Tracks every frame that there is; a frame that cannot be read is reported and skipped.
pub fn run(output: &Output, arguments: &TrackArguments) -> Result<(), Failure> {
    arguments.note_what_is_gone(output);
    let constants = read_constants(&arguments.constants)?;
    let mut tracker = Tracker::new(&constants, arguments.options()).map_err(|e| unfit(arguments, &e))?;
    let mut forces = forces_of(arguments, &constants)?;
    let inputs = inputs_of(arguments);
    let rules = output.rules(&inputs);
    let mut pictures = Pictures::new(arguments, &rules, &constants, &tracker)?;
    let mut shape = ShapeFiles::open(arguments, &rules, &constants, &tracker)?;
    let mut sink = Sink::new(arguments.out.as_deref(), &rules)?;
    let mut source = FrameSource::open(&arguments.frames, arguments.raw)?;
    let mut times = FrameTimes::open(arguments.times.as_deref())?;
    let mut line = Vec::new();
    sink.put(header(arguments.format).as_bytes())?;
    let at_mm = tracker.springs().map_or(DVec3::ZERO, domecast_runtime::track::Springs::at_mm);
    let mut tally = Tally::default();
    warn_without_key(output, arguments, &constants);
    let mut turn = None;
    while let Some(mut next) = source.next_frame() {
        if arguments.camera_mirrored
            && let Ok(picture) = &mut next.picture
        {
            picture.mirror();
        }
        output.step(&format!("frame {}", next.number));
        let picture = frame_of(&next.picture);
        if let Some(time_s) = times.next_s()? {
            tracker.stamp(time_s);
        }
        let began = Instant::now();
        let tracked: &Tracked = match &picture {
            Ok(frame) => tracker.track(next.number, frame),
            Err(problem) => {
                output.fault(&format!("frame {}: {problem}", next.number));
                tracker.skip(next.number)
            }
        };
        if let (Ok(frame), Some(shape)) = (&picture, &mut shape) {
            shape.measure(frame, tracked)?;
        }
        if let Some(forces) = &mut forces {
            press(forces, tracked, shape.as_ref().filter(|_| picture.is_ok()));
        }
        if picture.is_ok() {
            tally.times.push(began.elapsed());
        }
        turn = tracked.camera_turn.or(turn);
        *tally.counts.entry(tracked.status()).or_default() += 1;
        line.clear();
        write_line(&mut line, arguments, tracked, at_mm, forces.as_ref())?;
        if let (Ok(_), Some(shape)) = (&picture, &mut shape) {
            let line = (arguments.format == Format::Jsonl).then_some(&mut line);
            shape.write(next.number, line, forces.as_mut())?;
        }
        sink.put(&line)?;
        if let Ok(frame) = &picture {
            let dots = forces.as_ref().map_or(&[][..], |forces| &forces.result().dots);
            let tractions: Vec<_> = dots.iter().map(|dot| (dot.surface_mm, dot.traction_n_mm2)).collect();
            pictures.write(output, next.number, frame, tracked, &tractions)?;
        }
        source.reuse(next.picture);
    }
    output.steps_done();
    if !tally.counts.is_empty() {
        sink.end(output)?;
        pictures.end(output)?;
        if let Some(shape) = shape {
            shape.end(output)?;
        }
    }
    source.end()?;
    if tally.counts.is_empty() {
        let allowed = "PNG or JPEG frames, a video, or raw";
        return Err(input_fault(&arguments.frames[0], "holds no frame", allowed));
    }
    tell_turn(output, turn, &tally);
    tally.summarize(output, arguments.out.as_deref())?;
    let nothing_read = tally.counts.keys().all(|status| *status == "unreadable");
    if nothing_read { Err(Failure::Negative) } else { Ok(()) }
}
