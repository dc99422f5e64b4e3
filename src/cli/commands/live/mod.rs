//! `domecast live DEVICE --constants FILE`

mod arguments;
mod described;
mod health;
mod session;
mod terminal;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use glam::DVec3;

use super::hardness_lines::HardnessLines;
use super::input::{input_fault, read_constants};
use super::output::{Failure, Output};
use super::recording::{Recording, RecordingPace};
use super::rest_frame::RestFrame;
use domecast_files::StopWish;
use domecast_live::page::{LivePage, ShownSensor};
use domecast_live::source::{CameraRequest, ControlRequest, LiveSource, open_device as open_named};
use domecast_live::{HeightReader, LiveEvent, LiveReader};
use domecast_runtime::constants::Constants;
use domecast_runtime::shape::ShapeFromColor;
use domecast_runtime::track::{Springs, Tracker};
use domecast_runtime::traction::{ForceDistribution, SHAPE_CORRELATION_MM};
use session::{Outlets, Session};

pub use arguments::{LiveArguments, milliseconds, rate};
pub use health::cure as cure_of;

/// Frames that wait at most: what is older than that is no longer live.
const MAX_WAITING: usize = 4;
/// How often the work looks whether it is to end.
const LOOK: Duration = Duration::from_millis(100);
/// A device that gives nothing for so long is named.
const STALLED: Duration = Duration::from_secs(1);

const DEVICES: &str = "a camera such as /dev/video0, - for PPM pictures, or player:FOLDER";

/// A device as it is named on the command line.
#[derive(Debug, Clone)]
pub struct Device<'a> {
    /// Such as `/dev/video0`, `-`, `player:FOLDER`.
    pub name: &'a str,
    /// Frames a second that a camera is asked for.
    pub rate_hz: f64,
    /// What is wanted of a camera's controls.
    pub controls: ControlRequest,
}

/// Opens a device for the frames of a sensor.
pub fn open_device(device: &Device, constants: &Constants) -> Result<Box<dyn LiveSource>, Failure> {
    let size = [constants.camera.width, constants.camera.height];
    let request = CameraRequest { size, rate_hz: device.rate_hz, controls: device.controls };
    open_named(device.name, request).map_err(|problem| input_fault(Path::new(device.name), problem, DEVICES))
}

/// Frames of another size say nothing, and never will.
fn check_size(
    source: &dyn LiveSource,
    arguments: &LiveArguments,
    constants: &Constants,
) -> Result<(), Failure> {
    let wanted = [constants.camera.width as usize, constants.camera.height as usize];
    match source.info().size {
        Some([width, height]) if [width, height] != wanted => {
            let [w, h] = wanted;
            let problem = format!(
                "gives frames of {width} x {height}, {} is of {w} x {h}",
                arguments.constants.display()
            );
            let allowed = "frames of that size, or the constants.json of this camera's sensor";
            Err(input_fault(Path::new(&arguments.device), problem, allowed))
        }
        _ => Ok(()),
    }
}

/// What reads the skin, where something shows or records it.
fn skin_of(
    output: &Output,
    arguments: &LiveArguments,
    constants: &Constants,
    tracker: &Tracker,
    rest: Option<&RestFrame>,
) -> Result<Option<ShapeFromColor>, Failure> {
    let Some((path, rest)) = arguments.rest.as_deref().zip(rest) else { return Ok(None) };
    if arguments.show.is_none() && arguments.record.is_none() {
        let (problem, allowed) =
            ("is of no use: nothing shows or records the skin", "--show, --record or --hardness");
        return if arguments.hardness.is_some() {
            Ok(None)
        } else {
            Err(input_fault(path, problem, allowed))
        };
    }
    let fault = |path: &Path, problem: String| input_fault(path, problem, "what shape from colour needs");
    let mut shape =
        output.shape(constants, tracker).map_err(|error| fault(&arguments.constants, error.to_string()))?;
    shape.set_rest(&rest.frame()?, &rest.tracked).map_err(|error| fault(path, error.to_string()))?;
    Ok(Some(shape))
}

/// Reads until the source ends, the frames that were asked for are there, or Ctrl-C.
pub fn run(output: &Output, arguments: &LiveArguments) -> Result<(), Failure> {
    let constants = read_constants(&arguments.constants)?;
    let unfit = |problem: String| input_fault(&arguments.constants, problem, "constants of a sensor");
    let tracker = Tracker::new(&constants, arguments.tracker.options()).map_err(|e| unfit(e.to_string()))?;
    let rest = RestFrame::open(arguments.rest.as_deref(), arguments.tracker.camera_mirrored, &tracker)?;
    let skin = skin_of(output, arguments, &constants, &tracker, rest.as_ref())?;
    let at_mm = tracker.springs().map_or(DVec3::ZERO, Springs::at_mm);
    let model = |path: &PathBuf| {
        HardnessLines::open((path, arguments.hardness_every), &arguments.tracker, rest.as_ref(), at_mm)
    };
    let hardness = arguments.hardness.as_ref().map(model).transpose()?;
    let device = Device { name: &arguments.device, rate_hz: arguments.rate, controls: arguments.controls() };
    let source = open_device(&device, &constants)?;
    check_size(&*source, arguments, &constants)?;
    let page = match arguments.show {
        Some(port) => {
            let correlation_mm = skin.is_some().then_some(SHAPE_CORRELATION_MM);
            // constants of earlier builds have no dome to press: their page shows no forces on the skin
            let mut forces = ForceDistribution::new(&constants, correlation_mm).ok();
            if let (Some(forces), Some(_), Some(rest)) = (&mut forces, &skin, &rest) {
                // the skin was read from it: it has a pose
                let _ = forces.set_rest(&rest.tracked);
            }
            let shown = ShownSensor { optics: tracker.optics().clone(), forces };
            Some(LivePage::start(port, shown).map_err(|error| {
                let problem = format!("cannot be used ({error})");
                let named = format!("--show {port}");
                input_fault(Path::new(&named), problem, "a port that is free, or none for any")
            })?)
        }
        None => None,
    };
    let inputs: Vec<&Path> = [&arguments.constants]
        .into_iter()
        .chain(&arguments.rest)
        .chain(&arguments.hardness)
        .map(PathBuf::as_path)
        .collect();
    let rules = output.rules(&inputs);
    let pace = RecordingPace::BehindFrames;
    let begin = |path: &PathBuf| Recording::begin(output, path, "live", &rules, &constants, &tracker, pace);
    let recording = arguments.record.as_ref().map(begin).transpose()?;
    let heights = skin.map(HeightReader::start).transpose().map_err(Failure::Print)?;
    // the first Ctrl-C ends the reading in good order, with the recording's index and the summary
    let wish = StopWish::heed();
    let outlets = Outlets { page, recording, heights, hardness };
    let mut session = Session::begin(output, arguments, tracker, source.info(), outlets)?;
    let reader = LiveReader::start(source, MAX_WAITING).map_err(Failure::Print)?;
    let mut heard = Instant::now();
    let mut is_stalled = false;
    while !wish.came() && arguments.frames.is_none_or(|count| session.frames() < count) {
        match reader.next(LOOK) {
            Some(LiveEvent::Frame(frame, pushed_out)) => {
                (heard, is_stalled) = (Instant::now(), false);
                session.frame(&frame, pushed_out)?;
            }
            Some(LiveEvent::Unplugged(why)) => session.unplugged(&why)?,
            Some(LiveEvent::Replugged(after, info)) => {
                heard = Instant::now();
                session.replugged(after, &info)?;
            }
            Some(LiveEvent::Ended(why)) => {
                if let Some(why) = why {
                    session.failed(&why)?;
                }
                break;
            }
            None if !is_stalled && heard.elapsed() > STALLED => {
                is_stalled = true;
                session.stalled()?;
            }
            None => {}
        }
    }
    session.end()
}
