//! Fills the result of each frame from what the stages found.

use glam::DVec2;

use super::checks::DotChecks;
use super::drift::DriftCheck;
use super::pace::Pace;
use super::problem::{Problem, Problems};
use super::reference::ReferenceMean;
use super::result::{DotResult, MarkerResult, Tracked};
use super::tear::TearCheck;
use crate::constants::Constants;
use crate::track::frame::Exposure;
use crate::track::identities::{DotsFound, MAX_FALSE_DOTS, Orientation};
use crate::track::marks::{FittedDisc, MarkState};
use crate::track::model::SensorModel;
use crate::track::options::{Reference, TrackOptions};
use crate::track::pose::PoseEstimate;
use crate::track::wrench::{DotDisplacement, WrenchErrors, WrenchEstimate};

/// A sharp edge takes at least this part of a frame's contrast in four pixels.
const MIN_SHARPNESS: f64 = 0.45;
/// A larger part of the dots that should be seen, lost, is a problem.
const MAX_LOST_PART: f64 = 0.05;
/// Fewest dots that must be expected before the missing ones are held against the constants.
const MIN_EXPECTED_DOTS: usize = 8;

/// What all stages found in one frame.
#[derive(Debug, Clone, Copy)]
pub(in crate::track) struct FrameFindings<'a> {
    /// The disc of each white marker.
    pub discs: &'a [Option<FittedDisc>],
    pub pose: PoseEstimate<'a>,
    /// Where there is a pose.
    pub wrench: Option<WrenchEstimate>,
    /// How far that may be off, where it is known.
    pub errors: Option<&'a WrenchErrors>,
    pub dots: DotsFound<'a>,
    /// Of each dot; where the platform's pose is known.
    pub displacements: Option<&'a [Option<DotDisplacement>]>,
    /// Sharpness of the frame, measured where neither a pose nor a dot is found.
    pub sharpness: Option<f64>,
}

/// Makes the results; keeps what goes from frame to frame.
#[derive(Debug, Clone)]
pub(in crate::track) struct Reporter {
    result: Tracked,
    last_number: Option<u64>,
    pace: Pace,
    checks: DotChecks,
    drift: DriftCheck,
    tear: TearCheck,
    reference: ReferenceMean,
    max_misplaced: f64,
    /// Whether the key and the dots around it were once in place.
    was_placed: bool,
}

impl Reporter {
    /// For a sensor.
    pub fn new(constants: &Constants, model: &SensorModel, options: &TrackOptions) -> Self {
        let wanted = match options.reference {
            Reference::Constants => 0,
            Reference::Frames(wanted) => wanted,
        };
        let marker = |id| MarkerResult { id, ..MarkerResult::default() };
        let dot = |id| DotResult { id, ..DotResult::default() };
        Self {
            result: Tracked {
                black_dots: model.dots.iter().map(|d| dot(d.id)).collect(),
                white_markers: model.markers.all.iter().map(|m| marker(m.id)).collect(),
                false_dots: Vec::with_capacity(MAX_FALSE_DOTS),
                ..Tracked::default()
            },
            last_number: None,
            pace: Pace::default(),
            checks: DotChecks::new(model.dots.len()),
            drift: DriftCheck::new(constants, model),
            tear: TearCheck::new(model.dots.len()),
            reference: ReferenceMean::new(wanted, model.dots.len()),
            max_misplaced: options.max_misplaced,
            was_placed: false,
        }
    }

    /// The last frame's result.
    pub fn result(&self) -> &Tracked {
        &self.result
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        self.last_number = None;
        self.pace = Pace::default();
        self.was_placed = false;
        self.checks.restart();
        self.tear.restart();
        self.reference.restart();
        self.drift.restart();
        for marker in &mut self.result.white_markers {
            marker.state = MarkState::Missing;
        }
    }

    /// Begins a frame; `time_s`: when it was taken, if that is known. Whether frames are missing before it.
    pub fn begin(&mut self, number: u64, time_s: Option<f64>) -> bool {
        let is_late = self.pace.is_late(time_s);
        let result = &mut self.result;
        (result.frame, result.time_s) = (number, time_s);
        result.problems = Problems::default();
        result.withhold_motion();
        result.camera_turn = None;
        for marker in &mut result.white_markers {
            let seen = marker.state != MarkState::Missing;
            let state = if seen { MarkState::Lost } else { MarkState::Missing };
            *marker = MarkerResult { id: marker.id, state, ..MarkerResult::default() };
        }
        let has_gap = is_late || self.last_number.is_some_and(|last| number != last.wrapping_add(1));
        if has_gap {
            self.problem(Problem::Gap);
        }
        self.last_number = Some(number);
        has_gap
    }

    /// Something is wrong with the frame.
    pub fn problem(&mut self, problem: Problem) {
        self.result.problems.add(problem);
    }

    fn problem_if(&mut self, is_so: bool, problem: Problem) {
        if is_so {
            self.problem(problem);
        }
    }

    /// What the frame's levels say.
    pub fn exposure(&mut self, exposure: &Exposure) {
        self.problem_if(exposure.is_repeated, Problem::Frozen);
        self.problem_if(exposure.has_jumped, Problem::ExposureJump);
        self.problem_if(exposure.is_dark(), Problem::Dark);
        self.problem_if(exposure.is_saturated(), Problem::Saturated);
        if exposure.is_flat() {
            self.problem_if(self.result.problems.is_empty(), Problem::NoMarks);
        }
    }

    /// The dots of a frame, also of one in which nothing was looked for; `displacements`: where the pose is known.
    pub fn dots(&mut self, dots: &DotsFound<'_>, displacements: Option<&[Option<DotDisplacement>]>) {
        self.result.searched = dots.searched;
        self.result.false_dots.clear();
        self.result.false_dots.extend_from_slice(dots.false_dots);
        for (index, (track, to)) in dots.tracks.iter().zip(&mut self.result.black_dots).enumerate() {
            let is_expected = displacements.is_some() && track.is_wanted();
            let place = DotResult {
                id: to.id,
                undeformed_px: track.expected_px.filter(|_| is_expected).map(|p| p - track.offset_px),
                ink_px: track.now_px(),
                ..DotResult::default()
            };
            let unsure = track.is_unsure.then_some(MarkState::IdentityUnsure);
            if let Some(state) = unsure.or(track.fault).filter(|_| track.spot.is_some()) {
                *to = DotResult { state, ..place };
                continue;
            }
            *to = DotResult {
                state: track.state,
                image_px: track.center_px(),
                centroid_px: track.now_px(),
                sd_px: track.spot.map(|spot| spot.sd_px),
                motion_px: track.motion_px,
                ..place
            };
            if let Some(found) = displacements.and_then(|displacements| displacements[index]) {
                to.displacement_mm = Some(found.displacement_mm);
                to.displacement_sd_random_mm = Some(found.sd_random_mm);
                to.ray = Some(found.ray);
            }
        }
    }

    fn markers(&mut self, discs: &[Option<FittedDisc>], pose: &PoseEstimate<'_>) {
        let found = discs.iter().zip(pose.markers);
        for ((disc, at_pose), to) in found.zip(&mut self.result.white_markers) {
            let Some(disc) = disc else { continue };
            to.state = disc.fault.unwrap_or(MarkState::Ok);
            if disc.fault.is_some() {
                continue;
            }
            to.centroid_px = Some(disc.centroid_px);
            to.sd_px = Some(disc.sd_px);
            to.residual_px = at_pose.map(|at| at.residual_px);
            to.image_px = at_pose.map(|at| at.image_px);
        }
        if pose.is_fixed {
            return;
        }
        let are_all_found = discs.iter().all(Option::is_some);
        self.problem_if(pose.is_ambiguous, Problem::AmbiguousPose);
        if let Some(refined) = pose.refined {
            self.result.pose = Some(refined.pose);
            self.result.pose_rms_px = Some(refined.rms_px);
            let sound = discs.iter().flatten().filter(|disc| disc.fault.is_none()).count();
            let has_dots = pose.seen.iter().any(|one| one.is_dot);
            self.problem_if(has_dots, Problem::TwoMarkers);
            self.problem_if(!has_dots && (pose.seen.len() == 3 || sound < 3), Problem::ThreeMarkers);
        } else {
            self.problem(if are_all_found { Problem::MarkersDoNotFit } else { Problem::MarkersMissing });
        }
    }

    fn wrench(&mut self, estimate: &WrenchEstimate, errors: Option<&WrenchErrors>) {
        self.result.pose_sd = estimate.displacement_sd;
        self.result.pose_sd_random = estimate.displacement_sd_random;
        self.result.wrench = estimate.wrench;
        self.result.wrench_sd = errors.and_then(WrenchErrors::sd);
        self.result.wrench_sd_random = errors.and_then(WrenchErrors::sd_random);
        self.problem_if(estimate.is_beyond_springs, Problem::BeyondSprings);
    }

    /// What the key says; numbers of a picture that lies otherwise would be other marks'.
    fn orientation(&mut self, orientation: Orientation) {
        match orientation {
            Orientation::NoKey | Orientation::AsBuilt => return,
            Orientation::Unsure => self.problem(Problem::KeyUnsure),
            Orientation::Turned(turn) => {
                self.problem(if turn.is_mirrored { Problem::Mirrored } else { Problem::Turned });
                self.result.camera_turn = Some(turn);
            }
        }
        let result = &mut self.result;
        result.withhold_motion();
        result.false_dots.clear();
        let unsure = |state: MarkState| {
            if state == MarkState::Ok { MarkState::IdentityUnsure } else { state }
        };
        for dot in &mut result.black_dots {
            *dot = DotResult { id: dot.id, state: unsure(dot.state), ..DotResult::default() };
        }
        for marker in &mut result.white_markers {
            *marker = MarkerResult { id: marker.id, state: unsure(marker.state), ..MarkerResult::default() };
        }
    }

    /// Ends a frame in which marks were looked for.
    pub fn finish(&mut self, findings: &FrameFindings<'_>, model: &SensorModel) {
        self.markers(findings.discs, &findings.pose);
        if let Some(wrench) = &findings.wrench {
            self.wrench(wrench, findings.errors);
        }
        self.dots(&findings.dots, findings.displacements);
        let tracks = findings.dots.tracks;
        let known = findings.pose.is_known();
        let is_blurred = self.checks.are_blurred(tracks)
            || findings.sharpness.is_some_and(|sharpness| sharpness < MIN_SHARPNESS);
        self.problem_if(is_blurred, Problem::Blurred);
        let spec = model.optics.lens().spec();
        let middle_px = 0.5 * DVec2::new(f64::from(spec.width), f64::from(spec.height));
        let is_torn = self.tear.is_torn(tracks, middle_px);
        self.problem_if(is_torn, Problem::Torn);
        let has_stopped = self.checks.have_stopped(tracks);
        self.problem_if(has_stopped, Problem::Frozen);
        let is_woven = self.checks.are_woven(tracks);
        self.problem_if(is_woven, Problem::Interlaced);
        let misplaced =
            !self.was_placed && known && self.checks.are_misplaced(tracks, &model.dots, self.max_misplaced);
        // Constants that once were the camera's stay so, however far the skin is pulled.
        let is_placed = known && !misplaced && findings.dots.orientation == Orientation::AsBuilt;
        self.was_placed |= is_placed;
        let wanted = tracks.iter().filter(|t| t.is_wanted()).count();
        let missing = self.result.count(MarkState::Missing);
        let unknown = known && wanted >= MIN_EXPECTED_DOTS && 2 * missing > wanted;
        let foreign = findings.pose.refined.is_some_and(|found| found.rms_px > model.markers.foreign_rms_px);
        self.problem_if(misplaced || unknown || foreign, Problem::ForeignConstants);
        let lost = [
            MarkState::Lost,
            MarkState::Merged,
            MarkState::IdentityUnsure,
            MarkState::Dirty,
            MarkState::Smeared,
            MarkState::Glare,
            MarkState::PartlyHidden,
        ];
        let lost: usize = lost.into_iter().map(|state| self.result.count(state)).sum();
        self.problem_if(lost as f64 > (MAX_LOST_PART * wanted as f64).max(1.0), Problem::DotsLost);
        let nothing =
            findings.discs.iter().all(Option::is_none) && tracks.iter().all(|track| track.spot.is_none());
        self.problem_if(findings.pose.refined.is_none() && nothing, Problem::NoMarks);
        self.orientation(findings.dots.orientation);
        let good = known && self.result.problems.iter().all(|p| p >= Problem::Frozen);
        if self.reference.apply(&mut self.result, findings.errors, good) {
            self.drift.add_rest(tracks);
        }
        let load = self.result.wrench.zip(self.result.wrench_sd);
        let is_drift = self.drift.is_drift(load, tracks, &model.dots, middle_px);
        self.problem_if(is_drift, Problem::Drift);
    }
}
