//! The pose of one frame: where the last one puts the markers, or from anywhere.

use glam::{DMat3, DVec2, DVec3};

use super::refine::{MarkerSighting, RefinedPose, refine};
use super::residual_scale::ResidualScale;
use crate::track::identities::{Choice, DISCS, MarkerFrame, MarkerHypotheses, MarkerIdentities};
use crate::track::marks::{FittedDisc, MarkerView};
use crate::track::model::SensorModel;
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::Sighting;

/// A pose farther from rest than this is none, mm.
const MAX_TRANSLATION_MM: f64 = 20.0;
/// A pose turned farther from rest than this is none, rad: it is the camera that is turned.
const MAX_TURN_RAD: f64 = 0.4;
/// Discs that fit within this part of the largest residual need no rivals.
const CLEAR_PART: f64 = 0.25;
/// Markers that make a pose.
const MIN_SOUND: usize = 3;
/// Combinations of three markers that are tried for each one left out.
const MAX_TRIPLES: usize = 12;
/// A dot is dark where its level is below this part of the levels around; this share of the dots must be.
const DARK: f64 = 0.85;
const MIN_DARK_SHARE: f64 = 0.5;
/// Parts of the deepest press at which a marker is looked at before there is a pose.
const PRESSED_PARTS: [f64; 3] = [0.0, 0.5, 1.0];

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
    optics: SensorOptics,
    max_residual_px: f64,
    sightings: Vec<MarkerSighting>,
    residual_scale: ResidualScale,
    markers: Vec<Option<MarkerAtPose>>,
    /// Whether the platform cannot move: its pose is that at rest, always.
    is_fixed: bool,
    /// The last pose that was found, and what this frame gave.
    pose: Option<Rigid>,
    refined: Option<RefinedPose>,
    is_ambiguous: bool,
}

impl PoseFinder {
    /// For a sensor; `max_residual_px`: largest rms of the residuals that is a pose.
    pub fn new(model: &SensorModel, max_residual_px: f64) -> Self {
        let count = model.markers.all.len();
        let is_fixed = model.solver.is_none();
        Self {
            optics: model.optics.clone(),
            max_residual_px,
            sightings: Vec::with_capacity(count),
            residual_scale: ResidualScale::new(count),
            markers: vec![None; count],
            is_fixed,
            pose: is_fixed.then(Rigid::identity),
            refined: None,
            is_ambiguous: false,
        }
    }

    /// The optics at the last pose.
    pub fn optics(&self) -> &SensorOptics {
        &self.optics
    }

    /// The last pose that was found.
    pub fn last_pose(&self) -> Option<Rigid> {
        self.pose
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        self.pose = self.is_fixed.then(Rigid::identity);
        self.refined = None;
        self.residual_scale.restart();
    }

    /// The pose of the next frame, and the markers that it rests on.
    pub fn find(&mut self, frame: &MarkerFrame<'_, '_>, model: &SensorModel, markers: &mut MarkerIdentities) {
        self.is_ambiguous = false;
        if self.is_fixed {
            return;
        }
        let followed = self.pose.and_then(|pose| self.follow(frame, markers, &pose));
        self.refined = followed.or_else(|| self.find_anywhere(frame, model, markers));
        match (&self.refined, self.pose) {
            (Some(found), _) => self.pose = Some(found.pose),
            (None, Some(pose)) => {
                // It was movable a frame ago; if not, the optics stay where they are.
                let _ = self.optics.move_to(&pose);
            }
            (None, None) => {}
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

    /// From the discs that are found, from a pose nearby; the optics are left there.
    fn refine(
        &mut self,
        frame: &MarkerFrame<'_, '_>,
        markers: &MarkerIdentities,
        start: &Rigid,
    ) -> Option<RefinedPose> {
        self.sightings.clear();
        let found = frame.models.all.iter().zip(markers.discs());
        // What does not look like a marker is left out where enough others are there.
        let sound = markers.discs().iter().flatten().filter(|disc| disc.fault.is_none()).count();
        let is_used = |disc: &&FittedDisc| sound < MIN_SOUND || disc.fault.is_none();
        self.sightings.extend(found.filter_map(|(marker, disc)| {
            let disc = disc.as_ref().filter(is_used)?;
            Some(MarkerSighting {
                marker: *marker,
                centroid_px: disc.centroid_px,
                sd_px: disc.sd_px,
                random_sd_px: disc.noise_sd_px,
            })
        }));
        let refined = refine(&mut self.optics, &self.sightings, start)?;
        let cosine = 0.5 * (refined.pose.rotation.to_cols_array().iter().step_by(4).sum::<f64>() - 1.0);
        let near = refined.pose.translation_mm.length() < MAX_TRANSLATION_MM && cosine > MAX_TURN_RAD.cos();
        (refined.rms_px <= self.max_residual_px && near).then_some(refined)
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

    /// Without a pose to start from.
    fn find_anywhere(
        &mut self,
        frame: &MarkerFrame<'_, '_>,
        model: &SensorModel,
        markers: &mut MarkerIdentities,
    ) -> Option<RefinedPose> {
        markers.clear();
        if frame.models.all.len() != 4 {
            // Other numbers than the paper's four: the nearest to rest, or to the last pose, will do.
            let start = self.pose.unwrap_or(Rigid::identity());
            self.optics.move_to(&start).ok()?;
            markers.follow(frame, &self.optics);
            return self.refine(frame, markers, &start);
        }
        let mut views = [[None; 4]; 3];
        for (views, part) in views.iter_mut().zip(PRESSED_PARTS) {
            let down = DVec3::new(0.0, 0.0, -part * model.max_press_mm);
            if self.optics.move_to(&Rigid::new(DMat3::IDENTITY, down)).is_ok() {
                for (view, marker) in views.iter_mut().zip(&frame.models.all) {
                    *view = MarkerView::new(&self.optics, marker);
                }
            }
        }
        // Mostly the likeliest discs are the markers: only where they do not fit well the others are looked at too.
        let likeliest = markers.find_anywhere(frame, &views, 1);
        let coarse =
            self.best_of(frame, &likeliest, markers).filter(|found| self.is_clear(found)).or_else(|| {
                let hypotheses = markers.find_anywhere(frame, &views, DISCS);
                self.best_of(frame, &hypotheses, markers)
                    .or_else(|| self.best_of_three(frame, model, &hypotheses, markers))
            })?;
        // Fitted again as they look from there; and asked whether another pose fits as well.
        self.optics.move_to(&coarse.pose).ok()?;
        markers.refit(frame, &self.optics);
        let refined = self.refine(frame, markers, &coarse.pose)?;
        if self.sightings.len() < 4 {
            return Some(refined);
        }
        let mut sightings = [Sighting { id: 0, centroid_px: DVec2::ZERO }; 4];
        for (to, from) in sightings.iter_mut().zip(&self.sightings) {
            *to = Sighting { id: from.marker.id, centroid_px: from.centroid_px };
        }
        let solved = model.solver.as_ref().and_then(|solver| solver.solve(&sightings).ok());
        self.is_ambiguous = solved.is_some_and(|estimate| estimate.is_ambiguous());
        Some(refined)
    }

    /// Whether a pose fits so well that it needs no rivals.
    fn is_clear(&self, found: &RefinedPose) -> bool {
        found.rms_px < CLEAR_PART * self.max_residual_px
    }

    /// The combination of discs that a pose explains best; it is taken as found, or the likeliest if none is explained.
    fn best_of(
        &mut self,
        frame: &MarkerFrame<'_, '_>,
        hypotheses: &MarkerHypotheses,
        markers: &mut MarkerIdentities,
    ) -> Option<RefinedPose> {
        let mut best: Option<(RefinedPose, Choice)> = None;
        if !(0..4).all(|marker| hypotheses.is_seen(marker)) {
            return None;
        }
        let mut last_rank = 0;
        for (rank, choice) in hypotheses.combinations(None) {
            // The first choices fitting well need no rivals.
            let clear = best.as_ref().is_some_and(|(found, _)| self.is_clear(found));
            if rank > last_rank && clear {
                break;
            }
            last_rank = rank;
            markers.choose(hypotheses, choice);
            if let Some(refined) = self.refine(frame, markers, &Rigid::identity())
                && best.as_ref().is_none_or(|(b, _)| refined.rms_px < b.rms_px)
            {
                best = Some((refined, choice));
            }
        }
        markers.choose(hypotheses, best.as_ref().map_or([Some(0); 4], |(_, choice)| *choice));
        best.map(|(refined, _)| refined)
    }

    /// Three markers, where the fourth is hidden or what is taken for it fits no pose. Any three places fit some pose, so
    /// the dots decide: the pose counts that puts most of them where it is dark.
    fn best_of_three(
        &mut self,
        frame: &MarkerFrame<'_, '_>,
        model: &SensorModel,
        hypotheses: &MarkerHypotheses,
        markers: &mut MarkerIdentities,
    ) -> Option<RefinedPose> {
        let seen = (0..4).filter(|marker| hypotheses.is_seen(*marker)).count();
        let mut best: Option<(f64, RefinedPose, Choice)> = None;
        for left_out in (0..4).filter(|marker| seen == 4 || (seen == 3 && !hypotheses.is_seen(*marker))) {
            for (_, choice) in hypotheses.combinations(Some(left_out)).take(MAX_TRIPLES) {
                markers.choose(hypotheses, choice);
                let Some(refined) = self.refine(frame, markers, &Rigid::identity()) else { continue };
                let share = self.dark_share(frame, model);
                if share >= MIN_DARK_SHARE && best.as_ref().is_none_or(|(so_far, ..)| share > *so_far) {
                    best = Some((share, refined, choice));
                }
            }
        }
        let (found, choice) =
            best.map_or((None, [Some(0); 4]), |(_, refined, choice)| (Some(refined), choice));
        markers.choose(hypotheses, choice);
        found
    }

    /// The share of the dots that the optics put where the frame is darker than half a spacing beside.
    fn dark_share(&self, frame: &MarkerFrame<'_, '_>, model: &SensorModel) -> f64 {
        let level = |at: DVec2| {
            let mut level = [0.0_f32];
            frame.plane.square_into(at.x.round() as i32, at.y.round() as i32, 1, &mut level);
            f64::from(level[0])
        };
        let (mut dark, mut all) = (0.0, 0.0);
        for dot in &model.dots {
            let Ok(at) = self.optics.project(dot.surface_mm) else { continue };
            let beside = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
            let beside = beside.map(|(x, y)| level(at + DVec2::new(x, y) * 0.5 * dot.spacing_px));
            all += 1.0;
            dark += if level(at) < DARK * 0.25 * beside.iter().sum::<f64>() { 1.0 } else { 0.0 };
        }
        dark / f64::max(all, 1.0)
    }
}
