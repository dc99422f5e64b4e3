//! The pose of a frame without one to start from: discs that could be the markers, and what the dots say of them.

use glam::{DMat3, DVec2, DVec3};

use super::finder::{HELPED, PoseFinder};
use super::refine::RefinedPose;
use crate::track::identities::{Choice, DISCS, MarkerFrame, MarkerHypotheses, MarkerIdentities};
use crate::track::marks::MarkerView;
use crate::track::model::SensorModel;
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::{Sighting, refine_pose};

/// Discs that fit within this part of the largest residual need no rivals.
const CLEAR_PART: f64 = 0.25;
/// Combinations of three markers that are tried for each one left out.
const MAX_TRIPLES: usize = 12;
/// A dot is dark where its level is below this part of the levels around; this share of the dots must be.
const DARK: f64 = 0.85;
const MIN_DARK_SHARE: f64 = 0.5;
/// Parts of the deepest press at which a marker is looked at before there is a pose.
const PRESSED_PARTS: [f64; 3] = [0.0, 0.5, 1.0];

impl PoseFinder {
    /// Without a pose to start from.
    pub(super) fn find_anywhere(
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
                    .or_else(|| self.guess_of_two(frame, model, &hypotheses, markers))
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

    /// Two markers: the pose in which they would be, were the picture at rest turned, grown and shifted, is where dots are to be
    /// looked for. It is kept as a guess where the dots are dark there, and is no pose.
    fn guess_of_two(
        &mut self,
        frame: &MarkerFrame<'_, '_>,
        model: &SensorModel,
        hypotheses: &MarkerHypotheses,
        markers: &mut MarkerIdentities,
    ) -> Option<RefinedPose> {
        if (0..4).filter(|marker| hypotheses.is_seen(*marker)).count() != HELPED {
            return None;
        }
        let mut best: Option<(f64, Rigid, Choice)> = None;
        for (_, choice) in hypotheses.combinations(None).take(MAX_TRIPLES) {
            markers.choose(hypotheses, choice);
            let Some(guess) = self.guess_pose(frame, markers) else { continue };
            let share = self.dark_share(frame, model);
            if share >= MIN_DARK_SHARE && best.is_none_or(|(so_far, ..)| share > so_far) {
                best = Some((share, guess, choice));
            }
        }
        let (_, guess, choice) = best?;
        markers.choose(hypotheses, choice);
        self.optics.move_to(&guess).ok()?;
        markers.refit(frame, &self.optics);
        self.guess = Some(guess);
        None
    }

    /// A pose from two discs: the others are taken to be where the similarity that brings these two from rest brings them.
    fn guess_pose(&mut self, frame: &MarkerFrame<'_, '_>, markers: &MarkerIdentities) -> Option<Rigid> {
        let models = frame.models;
        let mut found =
            models.rest_px.iter().zip(markers.discs()).filter_map(|(rest, d)| Some((*rest, (*d)?)));
        let (one, other) = (found.next()?, found.next()?);
        let (before, after) = (other.0 - one.0, other.1.centroid_px - one.1.centroid_px);
        let grown = after.rotate(DVec2::new(before.x, -before.y)) / before.length_squared();
        let moved = models.all.iter().zip(&models.rest_px);
        let sightings = moved.map(|(m, rest)| (*m, one.1.centroid_px + grown.rotate(*rest - one.0)));
        let pose = refine_pose(&mut self.optics, sightings, &Rigid::identity())?;
        self.optics.move_to(&pose).ok().map(|()| pose)
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
