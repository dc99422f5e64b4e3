//! The steps of the wizard, as a table: a new one is an entry here.

use std::path::Path;

use super::ball;
use super::capture::{self, FrameWish};
use super::loads;
use super::session::{CalibrationSession, Step};
use crate::commands::input::input_fault;
use crate::commands::live::Device;
use crate::commands::output::Failure;
use domecast_design::read_text;
use domecast_runtime::constants::Constants;

/// What a step is taken with.
pub struct Taking<'a> {
    pub session: &'a CalibrationSession,
    /// The constants as they are known before the step.
    pub constants: &'a Constants,
    pub device: Device<'a>,
    pub frames: usize,
    /// The words after the step's name.
    pub words: &'a [&'a str],
    pub said: &'a str,
}

/// A step and its frames as PNG, or why it is refused.
type TakenStep = Result<(Step, Vec<Vec<u8>>), Failure>;

/// A step of the wizard.
pub struct StepKind {
    /// The word that takes it.
    pub name: &'static str,
    /// How it is said.
    pub form: &'static str,
    /// What it is for.
    pub what: &'static str,
    /// A step that must have been taken before.
    pub after: Option<&'static str>,
    /// A step after which it cannot be taken any more.
    pub before: Option<&'static str>,
    take: fn(&Taking, &str) -> TakenStep,
}

/// In the order in which they are taken.
pub const STEPS: [StepKind; 4] = [
    StepKind {
        name: "lens",
        form: "lens FILE",
        what: "the camera's own calibration (checkerboard or ChArUco), a file of OpenCV, ROS or Kalibr; may be left out",
        after: None,
        before: Some("rest"),
        take: take_lens,
    },
    StepKind {
        name: "rest",
        form: "rest",
        what: "frames without any load: where camera, sheet, markers and dots are; again later: whether all is where it was",
        after: None,
        before: None,
        take: take_frames,
    },
    StepKind {
        name: "weight",
        form: "weight 50 g +x at pole",
        what: "a known weight that lies on the dome or pulls by a thread over a pulley: the springs",
        after: Some("rest"),
        before: None,
        take: take_weight,
    },
    StepKind {
        name: ball::BALL,
        form: "ball radius 4 mm",
        what: "a ball pressed some 0.4 mm into the dome, here and there, five times and more: the lights",
        after: Some("rest"),
        before: None,
        take: take_ball,
    },
];

/// Takes the step that the answer names.
pub fn take(taking: &Taking, kind: &StepKind, earlier: &[&str]) -> TakenStep {
    if let Some(after) = kind.after.filter(|after| !earlier.contains(after)) {
        return Err(refused(taking, format!("comes after {after}"), "the steps in their order"));
    }
    if let Some(before) = kind.before.filter(|before| earlier.contains(before)) {
        let problem = format!("comes before {before}, which was taken already; `undo` leads back");
        return Err(refused(taking, problem, "the steps in their order"));
    }
    (kind.take)(taking, &taking.session.next_name(kind.name))
}

fn refused(taking: &Taking, problem: String, allowed: &str) -> Failure {
    input_fault(Path::new(taking.said), problem, allowed)
}

fn take_lens(taking: &Taking, name: &str) -> TakenStep {
    let [file] = taking.words else {
        return Err(refused(taking, "names no file, or more than one".into(), "lens FILE"));
    };
    let camera = Some(read_text(Path::new(file))?);
    let step =
        Step { name: name.into(), said: taking.said.into(), marks: Vec::new(), camera, place_deg: None };
    Ok((step, Vec::new()))
}

fn take_frames(taking: &Taking, name: &str) -> TakenStep {
    let wish = FrameWish { device: taking.device.clone(), step: name, count: taking.frames };
    let taken = capture::take(&wish, taking.constants)?;
    let step = Step {
        name: name.into(),
        said: taking.said.into(),
        marks: taken.marks,
        camera: None,
        place_deg: None,
    };
    Ok((step, taken.frames))
}

fn take_weight(taking: &Taking, name: &str) -> TakenStep {
    let form = "MASS UNIT DIRECTION at PLACE";
    loads::parse(taking.words, taking.constants).map_err(|problem| refused(taking, problem, form))?;
    take_frames(taking, name)
}

fn take_ball(taking: &Taking, name: &str) -> TakenStep {
    let radius_mm =
        ball::parse(taking.words).map_err(|problem| refused(taking, problem, "ball radius NUMBER mm"))?;
    let (step, frames) = take_frames(taking, name)?;
    let place_deg = ball::examine(taking.session, taking.constants, &frames, (taking.said, radius_mm))?;
    // a platform that is pushed by hand says nothing of the springs
    Ok((Step { marks: Vec::new(), place_deg: Some(place_deg), ..step }, frames))
}
