//! The pose of one frame: where the last one puts the markers, or from anywhere.

use glam::DVec2;

use super::refine::{MarkerSighting, RefinedPose, refine};
use super::residual_scale::ResidualScale;
use super::with_dots::DotHelp;
use crate::track::identities::{DotTrack, MarkerFrame, MarkerIdentities};
use crate::track::marks::FittedDisc;
use crate::track::model::SensorModel;
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

/// A pose farther from rest than this is none, mm.
const MAX_TRANSLATION_MM: f64 = 20.0;
/// A pose turned farther from rest than this is none, rad: it is the camera that is turned.
const MAX_TURN_RAD: f64 = 0.4;
/// Markers that make a pose, and that make one with the dots' help.
const MIN_SOUND: usize = 3;
pub(super) const HELPED: usize = 2;

/// A white marker against the pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::track) struct MarkerAtPose {
    /// Centroid less where the pose puts it, px.
    pub residual_px: DVec2,
    /// Image of its centre: the centroid less what a disc has its centroid off, px.
    pub image_px: DVec2,
}

/// What the white markers of a frame say of the platform.
#[derive(Debug, Clone, Copy)]
pub(in crate::track) struct PoseEstimate<'a> {
    /// The pose, where there is one.
    pub refined: Option<&'a RefinedPose>,
    /// By what the covariance is to be multiplied: markers scatter more than their own deviations say.
    pub variance_factor: f64,
    /// Whether the platform cannot move (a rigid mount): it is at rest, and nothing is measured of its pose.
    pub is_fixed: bool,
    /// Whether another pose fits as well.
    pub is_ambiguous: bool,
    /// Markers that the pose rests on.
    pub seen: &'a [MarkerSighting],
    /// Each marker of the constants against the pose, where both are found.
    pub markers: &'a [Option<MarkerAtPose>],
}

impl<'a> PoseEstimate<'a> {
    /// Of a pose that was found from these markers, each frame for itself.
    pub fn of_markers(refined: &'a RefinedPose, seen: &'a [MarkerSighting]) -> Self {
        Self {
            refined: Some(refined),
            variance_factor: 1.0,
            is_fixed: false,
            is_ambiguous: false,
            seen,
            markers: &[],
        }
    }

    /// Whether it is known where the platform is.
    pub fn is_known(&self) -> bool {
        self.is_fixed || self.refined.is_some()
    }
}

/// Finds the pose in frame after frame.
#[derive(Debug, Clone)]
pub(in crate::track) struct PoseFinder {
    /// At the last pose.
    pub(super) optics: SensorOptics,
    pub(super) max_residual_px: f64,
    pub(super) sightings: Vec<MarkerSighting>,
    residual_scale: ResidualScale,
    help: DotHelp,
    markers: Vec<Option<MarkerAtPose>>,
    /// Whether the platform cannot move: its pose is that at rest, always.
    is_fixed: bool,
    /// The last pose that was found, and what this frame gave.
    pub(super) pose: Option<Rigid>,
    refined: Option<RefinedPose>,
    pub(super) is_ambiguous: bool,
    /// Where two markers alone are found: the pose that the dots are to be looked for at.
    pub(super) guess: Option<Rigid>,
}

impl PoseFinder {
    /// For a sensor; `max_residual_px`: largest rms of the residuals that is a pose.
    pub fn new(model: &SensorModel, max_residual_px: f64) -> Self {
        let count = model.markers.all.len();
        let is_fixed = model.solver.is_none();
        Self {
            optics: model.optics.clone(),
            max_residual_px,
            sightings: Vec::with_capacity(count + model.dots.len()),
            help: DotHelp::new(model.dots.len(), count),
            residual_scale: ResidualScale::new(count),
            markers: vec![None; count],
            is_fixed,
            pose: is_fixed.then(Rigid::identity),
            refined: None,
            is_ambiguous: false,
            guess: None,
        }
    }

    /// The optics at the last pose.
    pub fn optics(&self) -> &SensorOptics {
        &self.optics
    }

    /// The pose that the dots are to be looked for at: the last one that was found, or a guess.
    pub fn dots_pose(&self) -> Option<Rigid> {
        self.guess.or(self.pose)
    }

    /// Whether the pose is one that only the dots can complete: two markers alone are found.
    pub fn wants_dots(&self) -> bool {
        self.guess.is_some()
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        self.pose = self.is_fixed.then(Rigid::identity);
        self.refined = None;
        self.guess = None;
        self.residual_scale.restart();
    }

    /// The pose of the next frame, and the markers that it rests on.
    pub fn find(&mut self, frame: &MarkerFrame<'_, '_>, model: &SensorModel, markers: &mut MarkerIdentities) {
        self.is_ambiguous = false;
        if self.is_fixed {
            return;
        }
        self.guess = None;
        let had_pose = self.refined.is_some();
        let followed = self.pose.and_then(|pose| self.follow(frame, markers, &pose));
        if followed.is_none() && had_pose && markers.found() == HELPED {
            self.guess = self.pose;
        }
        self.refined = followed;
        if self.refined.is_none() && self.guess.is_none() {
            self.refined = self.find_anywhere(frame, model, markers);
        }
        match (&self.refined, self.pose) {
            (Some(found), _) => self.pose = Some(found.pose),
            (None, pose) => {
                // It was movable a frame ago; if not, the optics stay where they are.
                let _ = self.guess.or(pose).map(|pose| self.optics.move_to(&pose));
            }
        }
        self.compare(frame, markers);
    }

    /// The pose of two markers with the help of the dots, which were looked for at [`PoseFinder::dots_pose`].
    pub fn find_with_dots(
        &mut self,
        frame: &MarkerFrame<'_, '_>,
        model: &SensorModel,
        markers: &mut MarkerIdentities,
        tracks: &[DotTrack],
    ) {
        let Some(start) = self.guess else { return };
        self.sight(frame, markers);
        let dots = (model.dots.as_slice(), tracks);
        let found = self.help.refine(&mut self.optics, &mut self.sightings, dots, &start);
        self.refined = found.filter(|found| self.is_within(found));
        match &self.refined {
            Some(found) => self.pose = Some(found.pose),
            None => drop(self.optics.move_to(&start)),
        }
        self.compare(frame, markers);
    }

    /// What the last frame gave.
    pub fn estimate(&self) -> PoseEstimate<'_> {
        PoseEstimate {
            refined: self.refined.as_ref(),
            variance_factor: self.residual_scale.variance_factor(),
            is_fixed: self.is_fixed,
            is_ambiguous: self.is_ambiguous,
            seen: &self.sightings,
            markers: &self.markers,
        }
    }

    /// The markers against the pose, and what is learnt from them.
    fn compare(&mut self, frame: &MarkerFrame<'_, '_>, markers: &mut MarkerIdentities) {
        self.markers.fill(None);
        if self.refined.is_none() {
            return;
        }
        let discs = markers.discs();
        for ((to, marker), disc) in self.markers.iter_mut().zip(&frame.models.all).zip(discs) {
            let Some(disc) = disc else { continue };
            if let Ok(image) = marker.image(&self.optics) {
                *to = Some(MarkerAtPose {
                    residual_px: disc.centroid_px - image.centroid_px,
                    image_px: disc.centroid_px - (image.centroid_px - image.center_px),
                });
            }
        }
        let seen = self.markers.iter().zip(discs);
        self.residual_scale.add(seen.map(|(at, disc)| {
            let disc = disc.as_ref().filter(|disc| disc.fault.is_none())?;
            Some((at.as_ref()?.residual_px, disc.noise_sd_px))
        }));
        markers.learn_shading();
    }

    /// Whether a pose fits, within reach of rest.
    fn is_within(&self, found: &RefinedPose) -> bool {
        let cosine = 0.5 * (found.pose.rotation.to_cols_array().iter().step_by(4).sum::<f64>() - 1.0);
        let near = found.pose.translation_mm.length() < MAX_TRANSLATION_MM && cosine > MAX_TURN_RAD.cos();
        found.rms_px <= self.max_residual_px && near
    }

    /// From the discs that are found, from a pose nearby; the optics are left there.
    pub(super) fn refine(
        &mut self,
        frame: &MarkerFrame<'_, '_>,
        markers: &MarkerIdentities,
        start: &Rigid,
    ) -> Option<RefinedPose> {
        self.sight(frame, markers);
        let refined = refine(&mut self.optics, &self.sightings, start)?;
        self.is_within(&refined).then_some(refined)
    }

    /// Takes the discs that a pose is to rest on.
    fn sight(&mut self, frame: &MarkerFrame<'_, '_>, markers: &MarkerIdentities) {
        self.sightings.clear();
        let found = frame.models.all.iter().zip(markers.discs());
        // What does not look like a marker is left out where enough others are there.
        let sound = markers.discs().iter().flatten().filter(|disc| disc.fault.is_none()).count();
        let is_used = |disc: &&FittedDisc| sound < MIN_SOUND || disc.fault.is_none();
        self.sightings.extend(found.filter_map(|(marker, disc)| {
            let disc = disc.as_ref().filter(is_used)?;
            Some(MarkerSighting::new(*marker, disc.centroid_px, [disc.sd_px, disc.noise_sd_px]))
        }));
    }

    /// From the last pose.
    fn follow(
        &mut self,
        frame: &MarkerFrame<'_, '_>,
        markers: &mut MarkerIdentities,
        last: &Rigid,
    ) -> Option<RefinedPose> {
        if self.optics.move_to(last).is_err() {
            markers.clear();
            return None;
        }
        markers.follow(frame, &self.optics);
        let mut found = self.refine(frame, markers, last)?;
        // Beside where it was a sound disc has another outline.
        if markers.discs().iter().flatten().any(|disc| disc.fault.is_some()) {
            markers.refit(frame, &self.optics);
            found = self.refine(frame, markers, &found.pose)?;
        }
        if markers.are_all_found() || self.optics.move_to(&found.pose).is_err() {
            return Some(found);
        }
        let refound = markers.find_again(frame, &self.optics);
        if refound.is_empty() {
            return Some(found);
        }
        let with_refound = self.refine(frame, markers, &found.pose);
        if with_refound.is_some() {
            return with_refound;
        }
        markers.drop_refound(&refound);
        self.refine(frame, markers, &found.pose).or_else(|| {
            // The optics stood at this pose before.
            let _ = self.optics.move_to(&found.pose);
            Some(found)
        })
    }
}
