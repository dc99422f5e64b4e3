//! What the steps of a session say together: a function of the steps alone.

use std::path::Path;

use glam::{DVec2, DVec3};
use nalgebra::Matrix6;
use serde_json::json;

use super::loads::{self, Load, LoadNoise};
use super::noise::{CentroidNoise, centroids_of, tolerance_px};
use super::session::Step;
use crate::commands::input::input_fault;
use crate::commands::output::Failure;
use domecast_design::calibration::{CalibrationHints, CameraCalibration};
use domecast_optics::camera::LensModel;
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::{PoseOptions, PoseSolver, Sighting};
use domecast_runtime::calibrate::force::{KnownLoad, Pair, SpringKnowledge, examine_fit};
use domecast_runtime::calibrate::optics::{Kind, Observation, OpticsFit, fit};
use domecast_runtime::constants::Constants;
use domecast_springs::Displacement;

/// Noise that a marker's centroid may have for the solver, px.
const CENTROID_NOISE_PX: f64 = 0.5;
/// Frames of a load that go into the fit of the optics: more of one pose say the same.
const OPTICS_FRAMES: usize = 2;
/// A load is refused beyond this: six squares of standard normal numbers are beyond 30.7 once in 30,000.
const MAX_SURPRISE: f64 = 30.7;
/// A sensor that is at rest again is within this of where it was, mm and rad.
const AT_REST: [f64; 2] = [0.02, 0.002];
/// A focal length that is farther off the design's is another camera's, a part of it.
const MAX_FOCAL_CHANGE: f64 = 0.15;

/// A load and how it went with what was known before it.
#[derive(Debug, Clone)]
pub struct TakenLoad {
    pub load: Load,
    pub known: KnownLoad,
    /// Six squares of standard normal numbers, were all as it is said.
    pub surprise: f64,
}

/// What is known after the steps.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The constants with lens and optics as far as they are measured, the springs nominal.
    pub constants: Constants,
    pub optics: Option<OpticsFit>,
    /// Of the springs, where there are any.
    pub knowledge: Option<SpringKnowledge>,
    pub loads: Vec<TakenLoad>,
    /// What is open of each axis, before the first load and after each.
    pub history: Vec<[f64; 6]>,
    /// Covariance of the motion that one load's frames show.
    pub motion: Option<Matrix6<f64>>,
    /// Standard deviation of a step's mean centroid of a marker, px: learned from the frames.
    pub centroid_px: Option<f64>,
    /// Sentences that the user should read.
    pub notes: Vec<String>,
}

/// The camera's calibration in place of the design's lens; what it changes, in words.
fn take_lens(constants: &mut Constants, text: &str) -> Result<String, String> {
    let camera = &constants.camera;
    let hints = CalibrationHints {
        camera: None,
        model: LensModel::parse(&camera.model),
        width: Some(camera.width.into()),
        height: Some(camera.height.into()),
    };
    let read = CameraCalibration::parse(text, &hints);
    // a file that says its model may say another one than the design
    let read = read.or_else(|first| {
        CameraCalibration::parse(text, &CalibrationHints { model: None, ..hints }).map_err(|_| first)
    });
    let read = read.map_err(|error| error.to_string())?;
    for (axis, name) in ["fx", "fy"].into_iter().enumerate() {
        let (own, design) = (read.matrix[axis][axis], camera.matrix[axis][axis]);
        if (own / design - 1.0).abs() > MAX_FOCAL_CHANGE {
            return Err(format!(
                "{name} is {own:.1} px, the design's camera has {design:.1}; within {:.0} % are allowed: the calibration of \
                 another camera, lens or resolution? If it is this sensor's, build it from the calibration (`camera.calibration`)",
                100.0 * MAX_FOCAL_CHANGE
            ));
        }
    }
    let before = constants.sensor()?;
    let camera = &mut constants.camera;
    camera.model = read.model.as_str().into();
    camera.matrix = read.matrix;
    camera.distortion = read.distortion;
    camera.intrinsics_covariance = Vec::new();
    let mut optics = constants.optics_spec()?;
    optics.lens.field_of_view_rad = before.lens().spec().field_of_view_rad;
    let after = domecast_optics::SensorOptics::new(&optics).map_err(|error| error.to_string())?;
    constants.camera.max_field_angle_rad = after.lens().max_field_angle_rad();
    let mut moved_px: f64 = 0.0;
    let mut place = |at: [f64; 3], image: &mut [f64; 2]| {
        let seen = after.project(DVec3::from_array(at)).map_err(|error| error.to_string())?;
        moved_px = moved_px.max(seen.distance(DVec2::from_array(*image)));
        *image = seen.to_array();
        Ok::<(), String>(())
    };
    for marker in &mut constants.white_markers {
        place(marker.position_mm, &mut marker.image_px)?;
    }
    for dot in &mut constants.black_dots {
        place(dot.surface_mm, &mut dot.image_px)?;
    }
    if let Some(key) = &mut constants.key {
        place(key.surface_mm, &mut key.image_px)?;
    }
    Ok(format!(
        "the camera's own calibration moves marks by up to {moved_px:.1} px against the design's lens"
    ))
}

/// Marks of some of a step's frames, under new numbers.
fn renumbered(marks: &[Observation], first: usize, frames: usize) -> impl Iterator<Item = Observation> {
    let few = marks.iter().filter(move |mark| mark.frame < frames);
    few.map(move |mark| Observation { frame: first + mark.frame, ..*mark })
}

fn frames_of(marks: &[Observation]) -> usize {
    marks.iter().map(|mark| mark.frame + 1).max().unwrap_or(0)
}

/// Fits the optics to all frames: those of the first rest, then some of each load.
fn fit_optics(constants: &Constants, steps: &[Step]) -> Result<Option<OpticsFit>, String> {
    let mut at_rest = steps.iter().filter(|step| kind_of(step) == "rest");
    let Some(rest) = at_rest.next() else { return Ok(None) };
    let priors = constants.tolerances.ok_or("the constants have no \"tolerances\": build them anew")?;
    let mut all = rest.marks.clone();
    let mut first = frames_of(&all);
    let rest_frames = first;
    for step in at_rest.chain(steps.iter().filter(|step| kind_of(step) == "weight")) {
        // a load that touches the dome moves its dots: then the markers alone say where the platform is
        let is_touched = kind_of(step) != "rest";
        let seen = renumbered(&step.marks, first, OPTICS_FRAMES);
        all.extend(seen.filter(|mark| mark.kind == Kind::White || !is_touched));
        first += OPTICS_FRAMES;
    }
    fit(constants, &all, &priors, rest_frames).map(Some).map_err(|error| error.to_string())
}

/// What a step is of: the part of its name after the number.
pub fn kind_of(step: &Step) -> &str {
    step.name.split_once('-').map_or("", |(_, kind)| kind)
}

/// Where the platform is in a step's frames.
struct StepPose<'a> {
    step: &'a Step,
    pose: Rigid,
    /// Of the displacement, for centroids that are off by [`CENTROID_NOISE_PX`].
    solver_covariance: Matrix6<f64>,
    rms_px: f64,
    markers: usize,
}

impl StepPose<'_> {
    /// Of the displacement, for centroids with this standard deviation, px.
    fn covariance(&self, sd_px: f64) -> Matrix6<f64> {
        self.solver_covariance * (sd_px / CENTROID_NOISE_PX).powi(2)
    }
}

/// Where the platform is, by the mean of each marker's centroids.
fn pose_of<'a>(solver: &PoseSolver, constants: &Constants, step: &'a Step) -> Result<StepPose<'a>, String> {
    let sightings: Vec<Sighting> = solver
        .markers()
        .iter()
        .filter_map(|marker| {
            let (_, centroid_px) = centroids_of(&step.marks, marker.id as usize)?;
            Some(Sighting { id: marker.id, centroid_px })
        })
        .collect();
    let found = solver.solve(&sightings).map_err(|error| error.to_string())?;
    let at_mm = constants.springs.as_ref().map_or(DVec3::ZERO, |s| DVec3::from_array(s.at_mm));
    Ok(StepPose {
        step,
        pose: found.pose,
        solver_covariance: found.displacement_covariance(at_mm),
        rms_px: found.rms_px,
        markers: sightings.len(),
    })
}

/// The pose of each step that has marks, and the centroids' noise that all of them show, px.
fn poses_of<'a>(
    solver: &PoseSolver,
    constants: &Constants,
    steps: &'a [Step],
) -> Result<(Vec<StepPose<'a>>, f64), String> {
    let mut noise = CentroidNoise::default();
    let mut found = Vec::new();
    let mut rest_frames = None;
    for step in steps.iter().filter(|step| !step.marks.is_empty()) {
        let one = pose_of(solver, constants, step)?;
        let is_first = rest_frames.is_none();
        let rest_frames = *rest_frames.get_or_insert_with(|| frames_of(&step.marks));
        noise.add_scatter(&step.marks, solver.markers(), rest_frames);
        if !is_first {
            noise.add_residuals(one.rms_px, one.markers);
        }
        found.push(one);
    }
    Ok((found, noise.sd_px(tolerance_px(constants))))
}

/// A weight that is not at rest after it was taken off, or was never off.
fn back_at_rest(pose: &Rigid, at_mm: DVec3) -> Result<(), String> {
    let d = Displacement::of_pose(pose, at_mm).to_array();
    let shift_mm = DVec3::new(d[0], d[1], d[2]).length();
    let turn_rad = DVec3::new(d[3], d[4], d[5]).length();
    let [max_mm, max_rad] = AT_REST;
    if shift_mm <= max_mm && turn_rad <= max_rad {
        return Ok(());
    }
    Err(format!(
        "the sensor is not at rest: it stands {shift_mm:.3} mm and {turn_rad:.4} rad from its first rest ({max_mm} and {max_rad} \
         are allowed); take every weight off, see that nothing rubs, and take the step again; if the camera was touched, `undo` to \
         the first rest"
    ))
}

/// Solves the steps of a session; the fault is of the step `at` that is looked at now.
pub fn solve(nominal: &Constants, steps: &[Step], noise: &LoadNoise, at: &Path) -> Result<Outcome, Failure> {
    let refused = |problem: String| input_fault(at, problem, "a step of this sensor; nothing was kept");
    let mut constants = nominal.clone();
    let mut notes = Vec::new();
    for text in steps.iter().filter_map(|step| step.camera.as_ref()) {
        notes.push(take_lens(&mut constants, text).map_err(refused)?);
    }
    let optics = fit_optics(&constants, steps).map_err(refused)?;
    if let Some(found) = &optics {
        constants = found.constants.clone();
    }
    let mut knowledge = match constants.springs {
        Some(_) => Some(SpringKnowledge::new(&constants).map_err(|e| refused(e.to_string()))?),
        None => None,
    };
    let mut outcome = Outcome {
        history: knowledge.iter().map(SpringKnowledge::parts).collect(),
        optics,
        knowledge: None,
        loads: Vec::new(),
        motion: None,
        centroid_px: None,
        notes,
        constants,
    };
    if outcome.optics.is_some() {
        let spec = outcome.constants.sensor().map_err(refused)?;
        let reach = spec.air_gap_mm().abs().max(1.0);
        let options = PoseOptions::new(CENTROID_NOISE_PX, reach);
        let solver = PoseSolver::new(&spec, &outcome.constants.markers(), options)
            .map_err(|e| refused(e.to_string()))?;
        let (poses, centroid_px) = poses_of(&solver, &outcome.constants, steps).map_err(refused)?;
        outcome.centroid_px = Some(centroid_px);
        for pose in &poses {
            take_motion(&mut outcome, &mut knowledge, (pose, centroid_px), noise).map_err(refused)?;
        }
    }
    outcome.knowledge = knowledge;
    Ok(outcome)
}

/// Takes in what a step's frames show of the platform.
fn take_motion(
    outcome: &mut Outcome,
    knowledge: &mut Option<SpringKnowledge>,
    (seen, centroid_px): (&StepPose, f64),
    noise: &LoadNoise,
) -> Result<(), String> {
    let constants = &outcome.constants;
    let at_mm = constants.springs.as_ref().map_or(DVec3::ZERO, |s| DVec3::from_array(s.at_mm));
    let StepPose { step, pose, .. } = *seen;
    let covariance = seen.covariance(centroid_px);
    if kind_of(step) == "rest" {
        if outcome.motion.is_none() {
            outcome.motion = Some(covariance);
            // scatter does not show it, nor do loads' residuals more than a part: the whole tolerance stands
            let whole = seen.covariance(tolerance_px(constants));
            knowledge.iter_mut().for_each(|springs| springs.open_rest(&whole));
        }
        return back_at_rest(&pose, at_mm);
    }
    let words: Vec<&str> = step.said.split_whitespace().skip(1).collect();
    let load = loads::parse(&words, constants)?;
    let Some(springs) = knowledge else {
        return Err("the constants have no springs (a rigid mount): there is no stiffness to measure".into());
    };
    let known = load.known(at_mm, &pose, covariance, noise);
    let unlike = "the springs cannot hold the platform where the frames show it";
    let surprise = springs.surprise(&known).ok_or(unlike)?;
    if surprise > MAX_SURPRISE {
        let other = |springs: &SpringKnowledge, load: &Load| {
            springs.surprise(&load.known(at_mm, &pose, covariance, noise))
        };
        let shown = springs.wrench(&known.displacement).unwrap_or([f64::NAN; 6]);
        let like = loads::looks_like(&load, constants, springs, other);
        let like = match like {
            Some(name) => format!("it looks like {name}"),
            None => "no single slip explains it: the weight, its direction or place, a thread that rubs, a touched camera, or springs \
                     that are not the design's (then `domecast calibrate-force` with a table of many loads)"
                .into(),
        };
        let list = |w: [f64; 6]| w.map(|v| format!("{v:.2}")).join(", ");
        return Err(format!(
            "the frames do not show this load: said (Fx .. Mz) {}, shown {}, N and N mm; {like}; say or hang it right and take the \
             step again",
            list(known.wrench),
            list(shown)
        ));
    }
    if !springs.add(&known) {
        return Err(unlike.into());
    }
    outcome.history.push(springs.parts());
    outcome.loads.push(TakenLoad { load, known, surprise });
    Ok(())
}

impl Outcome {
    /// The measured constants; `None` before a rest.
    pub fn measured(&self) -> Result<Option<Constants>, String> {
        let Some(optics) = &self.optics else { return Ok(None) };
        let mut constants = self.constants.clone();
        constants.calibrations.push(json!({
            "kind": "optics", "frames": optics.poses.len(), "rms_px": optics.rms_px, "parameters": optics.parameters,
        }));
        if let Some(knowledge) = self.knowledge.as_ref().filter(|_| !self.loads.is_empty()) {
            let pairs: Vec<Pair> = self.loads.iter().map(|load| pair_of(&load.known)).collect();
            let found = knowledge.to_fit();
            if let Some(springs) = &constants.springs {
                examine_fit(&found, &pairs, springs).map_err(|error| error.to_string())?;
            }
            found.write_into(&mut constants, &pairs, true);
            constants.calibrations.push(json!({ "kind": "known_loads", "loads": pairs.len(), "fit": found }));
        }
        Ok(Some(constants))
    }
}

fn pair_of(load: &KnownLoad) -> Pair {
    Pair {
        displacement: load.displacement,
        displacement_covariance: load.displacement_covariance,
        wrench: load.wrench.map(Some),
    }
}
