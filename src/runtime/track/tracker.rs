//! The stages in their order, frame by frame.

use glam::{DVec2, DVec3};
use nalgebra::Matrix6;

use super::error::TrackError;
use super::frame::{CameraFrame, ExposureMeter, Plane, sharpness};
use super::identities::{DotFrame, DotIdentities, MarkerFrame, MarkerIdentities};
use super::model::SensorModel;
use super::options::{Reference, TrackOptions};
use super::pose::PoseFinder;
use super::report::{FrameFindings, Problem, Reporter, Tracked};
use super::wrench::{DotDisplacements, Springs, WrenchEstimator};
use crate::constants::Constants;
use domecast_optics::SensorOptics;

/// How far from where the last pose puts it a white marker is looked for, in parts of the dots' spacing, when it is
/// not at once in place; and where there are no dots, px.
const MARKER_REACH: f64 = 0.9;
const MARKER_REACH_PX: f64 = 14.0;
/// Gates from here on let everything pass.
const MAX_GATE: f64 = 1e6;

/// Follows one sensor's marks through its frames.
#[derive(Debug, Clone)]
pub struct Tracker {
    options: TrackOptions,
    model: SensorModel,
    wrench: WrenchEstimator,
    exposure: ExposureMeter,
    markers: MarkerIdentities,
    pose: PoseFinder,
    dots: DotIdentities,
    displacements: DotDisplacements,
    report: Reporter,
    time_s: Option<f64>,
}

impl Tracker {
    /// A tracker for the sensor that the constants describe.
    ///
    /// # Errors
    /// [`TrackError`] names the first field of the constants that cannot be used.
    pub fn new(constants: &Constants, options: TrackOptions) -> Result<Self, TrackError> {
        let gates = [options.max_residual_px, options.max_misplaced];
        if gates.iter().any(|v| !(*v > 0.0 && *v < MAX_GATE)) {
            return Err(TrackError::at("options", "need gates above zero"));
        }
        let turned = options.camera_turned_rad.map(|turned_rad| turned(constants, turned_rad)).transpose()?;
        let constants = turned.as_ref().unwrap_or(constants);
        let at_mm = constants.springs.as_ref().map_or(DVec3::ZERO, |s| DVec3::from_array(s.at_mm));
        let model = SensorModel::new(constants, options.max_residual_px, at_mm)?;
        let wrench = WrenchEstimator::new(constants, &model.optics, options.temperature_c)?;
        let size = [constants.camera.width as usize, constants.camera.height as usize];
        Ok(Self {
            exposure: ExposureMeter::default(),
            markers: MarkerIdentities::new(model.markers.all.len()),
            pose: PoseFinder::new(&model, options.max_residual_px),
            dots: DotIdentities::new(&model, size, &options),
            displacements: DotDisplacements::new(&model.optics, &model.dots),
            report: Reporter::new(constants, &model, &options),
            wrench,
            time_s: None,
            model,
            options,
        })
    }

    /// The last frame's result.
    pub fn result(&self) -> &Tracked {
        self.report.result()
    }

    /// The sensor's optics at rest.
    pub fn optics(&self) -> &SensorOptics {
        &self.model.optics
    }

    /// The springs' law, where the constants have one.
    pub fn springs(&self) -> Option<&Springs> {
        self.wrench.springs()
    }

    /// Whether a pixel is inside of the runtime's circle.
    pub fn mask_holds(&self, at_px: DVec2) -> bool {
        self.model.mask.holds(at_px)
    }

    /// Forgets everything but the constants, the reference too.
    pub fn restart(&mut self) {
        self.exposure.forget();
        self.wrench.restart();
        self.markers.restart();
        self.pose.restart();
        self.dots.restart();
        self.report.restart();
    }

    /// A frame that could not be had (a broken file, a cut stream): its number is used up, nothing else changes.
    pub fn skip(&mut self, number: u64) -> &Tracked {
        self.begin(number);
        self.miss(Some(Problem::Unreadable))
    }

    /// When the next frame was taken, s, on a clock that does not jump. Steps of much more than the usual one are gaps, as
    /// numbers that are left out are.
    pub fn stamp(&mut self, time_s: f64) {
        self.time_s = Some(time_s).filter(|time_s| time_s.is_finite());
    }

    /// Gravity less the sensor's own acceleration, rest frame, m/s^2 (a sensor that stands upright: 0, 0, -9.81): of the frames from
    /// now on. The weight of what the springs carry is then taken off the wrench; without it, as at first, it is in the wrench, and
    /// a sensor that is turned over reports twice that as a load.
    ///
    /// # Errors
    /// [`TrackError`] for constants that do not say what the springs carry, an acceleration that is none, and for a tracker that
    /// counts from the constants' rest: how the sensor stood then is not known.
    pub fn set_gravity(&mut self, acceleration_mps2: Option<DVec3>) -> Result<(), TrackError> {
        if acceleration_mps2.is_some() && !matches!(self.options.reference, Reference::Frames(1..)) {
            let problem = "needs reference frames to count from: how the sensor stood at the constants' rest is not known";
            return Err(TrackError::at("gravity", problem));
        }
        self.wrench.set_gravity(acceleration_mps2)
    }

    fn begin(&mut self, number: u64) {
        if self.report.begin(number, self.time_s.take()) {
            self.dots.forget_last();
            self.exposure.forget();
        }
    }

    /// Ends a frame in which nothing is looked for.
    fn miss(&mut self, problem: Option<Problem>) -> &Tracked {
        if let Some(problem) = problem {
            self.report.problem(problem);
        }
        self.report.dots(&self.dots.miss(), None);
        self.exposure.forget();
        self.report.result()
    }

    /// Takes the next frame in. Numbers that leave one out are a gap; nothing else depends on them.
    pub fn track(&mut self, number: u64, frame: &CameraFrame<'_>) -> &Tracked {
        self.begin(number);
        let spec = self.model.optics.lens().spec();
        if frame.width() != spec.width as usize || frame.height() != spec.height as usize {
            return self.miss(Some(Problem::WrongSize));
        }
        let plane = Plane::new(frame, self.options.channel);
        let exposure = self.exposure.measure(&plane, &self.model.mask);
        self.report.exposure(&exposure);
        if exposure.is_flat() {
            return self.miss(None);
        }
        let model = &self.model;
        let marker_frame = MarkerFrame {
            plane: &plane,
            models: &model.markers,
            reach_px: model.dots.first().map_or(MARKER_REACH_PX, |d| MARKER_REACH * d.spacing_px),
        };
        self.pose.find(&marker_frame, model, &mut self.markers);
        self.dots.find(&DotFrame {
            plane: &plane,
            mask: &model.mask,
            model,
            optics: self.pose.optics(),
            pose: self.pose.dots_pose(),
        });
        if self.pose.wants_dots() && self.dots.is_as_built() {
            self.pose.find_with_dots(&marker_frame, model, &mut self.markers, self.dots.tracks());
            self.dots.expect_at(self.pose.optics(), &model.dots);
        }
        let (optics, dots) = (self.pose.optics(), self.dots.found());
        let pose = self.pose.estimate();
        let wrench = self.wrench.at_pose(&pose, optics);
        let motion =
            pose.refined.map_or_else(Matrix6::zeros, |found| found.covariance * pose.variance_factor);
        let displacements =
            pose.is_known().then(|| self.displacements.at_pose(optics, &motion, &model.dots, dots.tracks));
        let is_empty = pose.refined.is_none() && dots.tracks.iter().all(|track| track.spot.is_none());
        let sharpness = is_empty.then(|| sharpness(&plane, &model.mask, &exposure));
        let discs = self.markers.discs();
        let errors = self.wrench.errors();
        let findings = FrameFindings { discs, pose, wrench, errors, dots, displacements, sharpness };
        self.report.finish(&findings, model);
        self.report.result()
    }
}

/// The constants of the same sensor with its camera so turned that the picture is turned from image x towards image y.
fn turned(constants: &Constants, turned_rad: f64) -> Result<Constants, TrackError> {
    if !(turned_rad.is_finite() && turned_rad.abs() < 1e3) {
        return Err(TrackError::at("options", "need a turn of the camera that is a number"));
    }
    let mut turned = constants.clone();
    let matrix = &mut turned.camera.camera_from_sensor;
    let (sin, cos) = turned_rad.sin_cos();
    let [x, y, ..] = *matrix;
    for column in 0..4 {
        matrix[0][column] = cos * x[column] - sin * y[column];
        matrix[1][column] = sin * x[column] + cos * y[column];
    }
    Ok(turned)
}
