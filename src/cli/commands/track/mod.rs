//! `domecast track FRAMES --constants FILE`

mod arguments;
mod colours;
mod contact_hardness;
mod number_lines;
mod pictures;
mod results;
mod shape;
mod source;
mod tally;

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::input::{input_fault, read_constants};
use super::output::{Failure, Output};
use super::rest_frame::RestFrame;
use colours::ColourCheck;
use domecast_live::decode::Picture;
use domecast_runtime::constants::Constants;
use domecast_runtime::track::{CameraFrame, CameraTurn, Tracker};
use domecast_runtime::traction::{ForceDistribution, SHAPE_CORRELATION_MM};
use number_lines::NumberLines;
use results::Results;
use source::FrameSource;
use tally::Tally;

pub use arguments::{TrackArguments, field};
pub use results::add_member;
pub use shape::shape_members;

/// What cures pictures that lie otherwise than the constants say.
pub fn turned_hint(turn: CameraTurn) -> String {
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

fn warn_without_key(output: &Output, arguments: &TrackArguments, constants: &Constants) {
    if constants.key.is_none() {
        let whether = "a picture that is turned or mirrored may pass for a good one (constants of a new build have a key)";
        output.warn(&format!("{}: name no `key`: {whether}", arguments.constants.display()));
    }
}

/// The files that are read: none may be written.
fn inputs_of(arguments: &TrackArguments) -> Vec<&Path> {
    let named = arguments.frames.iter().chain([&arguments.constants]).chain(&arguments.times);
    let named = named
        .chain(&arguments.rest)
        .chain(&arguments.hardness)
        .chain(&arguments.travel)
        .chain(&arguments.gravity);
    named.map(PathBuf::as_path).collect()
}

fn forces_of(
    arguments: &TrackArguments,
    constants: &Constants,
    rest: Option<&RestFrame>,
) -> Result<Option<ForceDistribution>, Failure> {
    if !arguments.traction {
        return Ok(None);
    }
    let correlation_mm = arguments.shape.is_some().then_some(SHAPE_CORRELATION_MM);
    let mut forces =
        ForceDistribution::new(constants, correlation_mm).map_err(|error| arguments.unfit(&error))?;
    if let Some(rest) = rest.filter(|rest| !forces.set_rest(&rest.tracked)) {
        return Err(rest.fault(format!("has no pose: {}", rest.tracked.status())));
    }
    Ok(Some(forces))
}

/// Without a rest little can be said of forces on the skin.
fn warn_without_rest(output: &Output, arguments: &TrackArguments, constants: &Constants) {
    let has_rest = arguments.rest.is_some() || arguments.tracker.has_reference();
    if !arguments.traction || has_rest || constants.optics_uncertainty.is_some() {
        return;
    }
    if let Some(tolerances) = &constants.tolerances {
        output.warn(&format!(
            "--traction: where the dots of this sensor lie untouched is known to {} mm only, as they are printed, and forces that move \
             them by no more are not seen: give --reference N (the first N frames are untouched) or --rest FRAME",
            tolerances.black_dot_mm
        ));
    }
}

fn frame_of(picture: &Result<Picture, String>) -> Result<CameraFrame<'_>, String> {
    picture.as_ref().map_err(String::clone)?.frame()
}

/// Tracks every frame that there is; a frame that cannot be read is reported and skipped.
pub fn run(output: &Output, arguments: &TrackArguments) -> Result<(), Failure> {
    arguments.note_what_is_gone(output);
    let constants = read_constants(&arguments.constants)?;
    let mut tracker =
        Tracker::new(&constants, arguments.tracker.options()).map_err(|e| arguments.unfit(&e))?;
    let inputs = inputs_of(arguments);
    let rules = output.rules(&inputs);
    let rest = RestFrame::open(arguments.rest.as_deref(), arguments.tracker.camera_mirrored, &tracker)?;
    let mut results = Results::open(output, arguments, &rules, &constants, &tracker, rest.as_ref())?;
    let mut forces = forces_of(arguments, &constants, rest.as_ref())?;
    let mut source = FrameSource::open(&arguments.frames, arguments.raw)?;
    let mut times = NumberLines::<1>::open(arguments.times.as_deref(), "seconds")?;
    let mut gravity = NumberLines::<3>::open(arguments.gravity.as_deref(), "m/s^2")?;
    results.begin(arguments)?;
    let mut tally = Tally::new(arguments.tracker.has_reference(), rest.as_ref().map(|rest| &rest.tracked));
    warn_without_key(output, arguments, &constants);
    warn_without_rest(output, arguments, &constants);
    let mut turn = None;
    let mut colours = ColourCheck::new(arguments.raw.is_some());
    while let Some(mut next) = source.next_frame() {
        if arguments.tracker.camera_mirrored
            && let Ok(picture) = &mut next.picture
        {
            picture.mirror();
            next.encoded = None;
        }
        output.step(&format!("frame {}", next.number));
        let picture = frame_of(&next.picture);
        if let Some([time_s]) = times.read_next()? {
            tracker.stamp(time_s);
        }
        if let Some(acceleration_mps2) = gravity.read_next()? {
            let set = tracker.set_gravity(Some(acceleration_mps2.into()));
            set.map_err(|error| arguments.unfit_gravity(&error, next.number))?;
        }
        let began = Instant::now();
        match &picture {
            Ok(frame) => {
                tracker.track(next.number, frame);
            }
            Err(problem) => {
                output.fault(&format!("frame {}: {problem}", next.number));
                tracker.skip(next.number);
            }
        }
        let tracked = tracker.result();
        if let Ok(frame) = &picture {
            results.measure(frame, tracked)?;
        }
        if let Some(forces) = &mut forces {
            forces.update(tracked, results.skin().filter(|_| picture.is_ok()));
        }
        if picture.is_ok() {
            tally.times.push(began.elapsed());
        }
        if let Ok(picture) = &next.picture {
            colours.step(output, &constants, &tracker, picture);
        }
        turn = tracked.camera_turn.or(turn);
        tally.count(tracked);
        let encoded = next.encoded.as_deref();
        results.write(output, arguments, picture.as_ref().ok(), encoded, tracked, forces.as_mut())?;
        source.reuse(next.picture);
    }
    output.steps_done();
    colours.end(output);
    if !tally.counts.is_empty() {
        results.end(output)?;
    }
    source.end()?;
    if tally.counts.is_empty() {
        let allowed = "PNG or JPEG frames, a video, or raw";
        return Err(input_fault(&arguments.frames[0], "holds no frame", allowed));
    }
    tell_turn(output, turn, &tally);
    tally.warn_of_pull(output);
    tally.summarize(output, arguments.out.as_deref())?;
    let nothing_read = tally.counts.keys().all(|status| *status == "unreadable");
    if nothing_read { Err(Failure::Negative) } else { Ok(()) }
}
