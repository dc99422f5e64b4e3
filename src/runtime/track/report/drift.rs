//! A load that the skin does not show: camera, mount or lens are not as they were.
//!
//! A camera that turns shows platform and skin moved as one, just as a load on the platform does: a single frame cannot tell
//! them apart by the white markers. A load on the dome deforms the skin beside that, and moves its dots against the
//! platform. So a wrench beyond its deviations, frame after frame, while no place of the skin is moved, is none of a touch.
//! What presses on the platform beside the dome, or pulls at it, looks the same. A press along the rays, at the pole, moves the
//! dots so little that only a firm one is seen: where a touch that gives the wrench would not be seen, nothing is said.
//! On a rigid mount there is no wrench: what moves the whole picture, and no place of the skin beside others, is the camera.

use glam::DVec2;

use super::smooth_motion::{MotionSums, Terms, camera_terms};
use super::touch::TouchModel;
use crate::constants::Constants;
use crate::track::identities::DotTrack;
use crate::track::model::{DotModel, SensorModel};
use domecast_springs::Wrench;

/// A wrench beyond so many of its deviations is none of chance; on a rigid mount, a picture that has moved by so many times what
/// the dots of an untouched place are off by at most.
const MAX_SDS: f64 = 4.0;
/// For so many frames in a row.
const MIN_FRAMES: u32 = 10;
/// A touch would be seen where it is expected to move places by so many times that: modulus and object are known roughly.
const MIN_EXPECTED: f64 = 2.0;
/// What the terms of a camera leave of what a camera did, in parts of it: they are the first of a series.
const MAX_ROUGH: f64 = 0.05;
/// Places of the skin that must be moved for a touch: one may be a speck.
const MIN_TOUCHED: usize = 2;
/// Fewest dots of a place, and of the skin: the eight terms that a camera has explain a touch as well where dots are few.
const MIN_AROUND: f64 = 3.0;
const MIN_DOTS: usize = 32;

/// Where a dot was in the reference frames.
#[derive(Debug, Clone, Copy, Default)]
struct DotAtRest {
    /// Sums over the frames that show it: where it was seen, and by how much beside where the pose put it, px.
    now_px: DVec2,
    off_px: DVec2,
    frames: u32,
}

/// Judges frame after frame; keeps its buffer.
#[derive(Debug, Clone)]
pub(super) struct DriftCheck {
    /// How far a place of the skin can be beside an untouched one, px; `None` where the constants do not say it.
    max_still_px: Option<f64>,
    /// Of each dot, where the first frames are the rest.
    rest: Vec<DotAtRest>,
    /// Whether dots are judged by the reference frames alone: the constants' places were not measured.
    needs_rest: bool,
    is_rigid: bool,
    /// What a touch would show; `None` where the constants do not say it.
    touch: Option<TouchModel>,
    /// What it would show in this frame.
    expected_px: Vec<DVec2>,
    frames: u32,
}

impl DriftCheck {
    /// For a sensor of such constants.
    pub fn new(constants: &Constants, model: &SensorModel) -> Self {
        Self {
            max_still_px: model.max_still_px,
            rest: vec![DotAtRest::default(); model.dots.len()],
            needs_rest: !model.are_dots_measured,
            is_rigid: model.solver.is_none(),
            touch: TouchModel::new(constants, &model.optics),
            expected_px: Vec::with_capacity(model.dots.len()),
            frames: 0,
        }
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        self.frames = 0;
        self.rest.fill(DotAtRest::default());
    }

    /// Takes in a frame of the reference.
    pub fn add_rest(&mut self, tracks: &[DotTrack]) {
        for (rest, track) in self.rest.iter_mut().zip(tracks) {
            if let (Some(now), Some(off)) = (track.now_px(), track.off_px()) {
                rest.now_px += now;
                rest.off_px += off;
                rest.frames += 1;
            }
        }
    }

    /// Takes a frame in; whether camera, mount or lens have changed.
    pub fn is_drift(
        &mut self,
        load: Option<(Wrench, Wrench)>,
        tracks: &[DotTrack],
        models: &[DotModel],
        middle_px: DVec2,
    ) -> bool {
        let Some(max_still_px) = self.max_still_px else { return false };
        let has_moved = match load {
            Some((wrench, sd)) => {
                wrench.to_array().iter().zip(sd.to_array()).any(|(w, sd)| w.abs() > MAX_SDS * sd)
            }
            None => self.is_rigid && self.is_picture_moved(tracks, models, MAX_SDS * max_still_px),
        };
        let is_drift = has_moved
            && !self.is_touched(tracks, models, middle_px, max_still_px)
            && load.is_none_or(|(wrench, sd)| self.would_show(&wrench, &sd, models, middle_px, max_still_px));
        self.frames = if is_drift { self.frames.saturating_add(1) } else { 0 };
        self.frames >= MIN_FRAMES
    }

    /// Means over the reference frames: where a dot was seen, and by how much beside where the pose put it. Without such frames
    /// where the constants have it; `None` of a dot of which neither is known.
    fn rest_of(&self, index: usize, models: &[DotModel]) -> Option<(DVec2, DVec2)> {
        match self.rest.get(index)? {
            DotAtRest { frames: 0, .. } if self.needs_rest => None,
            DotAtRest { frames: 0, .. } => Some((models.get(index)?.rest_px, DVec2::ZERO)),
            rest => Some((rest.now_px / f64::from(rest.frames), rest.off_px / f64::from(rest.frames))),
        }
    }

    /// Whether the dots lie elsewhere than at rest, rms.
    fn is_picture_moved(&self, tracks: &[DotTrack], models: &[DotModel], min_px: f64) -> bool {
        let (mut sum, mut count) = (0.0, 0.0);
        for (index, track) in tracks.iter().enumerate() {
            if let (Some(now), Some((rest, _))) = (track.now_px(), self.rest_of(index, models)) {
                (sum, count) = (sum + (now - rest).length_squared(), count + 1.0);
            }
        }
        sum > count * min_px * min_px
    }

    /// Whether some places of the skin have moved against the platform; also where too few dots are seen to tell.
    fn is_touched(
        &self,
        tracks: &[DotTrack],
        models: &[DotModel],
        middle_px: DVec2,
        max_still_px: f64,
    ) -> bool {
        let moved = |index: usize| {
            let (track, (_, rest)) = (tracks.get(index)?, self.rest_of(index, models)?);
            Some((camera_terms(track.expected_px?, middle_px), track.off_px()? - rest))
        };
        are_places_moved(moved, models, max_still_px).unwrap_or(true)
    }

    /// Whether a touch that gives the wrench would be seen, or none gives it; so too where the constants do not say how soft the dome is.
    fn would_show(
        &mut self,
        wrench: &Wrench,
        sd: &Wrench,
        models: &[DotModel],
        middle_px: DVec2,
        max_still_px: f64,
    ) -> bool {
        let Some(touch) = &self.touch else { return true };
        let Some(place_mm) = touch.place_mm(wrench, sd) else { return true };
        touch.motions_px(place_mm, wrench.force_n.length(), models, &mut self.expected_px);
        let moved = |index: usize| {
            Some((camera_terms(models.get(index)?.rest_px, middle_px), *self.expected_px.get(index)?))
        };
        are_places_moved(moved, models, MIN_EXPECTED * max_still_px).unwrap_or(false)
    }
}

/// Whether the dots of some places, each with those beside it, have moved on the mean by more than `max_still_px`; `None` where
/// too few are seen to tell. `moved`: of a dot, with the terms of its place. What a lens or another camera can make of the whole
/// picture does not count: a touch moves some places beside others.
fn are_places_moved(
    moved: impl Fn(usize) -> Option<(Terms, DVec2)>,
    models: &[DotModel],
    max_still_px: f64,
) -> Option<bool> {
    let mut sums = MotionSums::camera();
    (0..models.len()).filter_map(&moved).for_each(|(terms, motion)| sums.add(&terms, motion));
    let smooth = sums.solve(MIN_DOTS)?;
    let mut square = 0.0;
    (0..models.len()).filter_map(&moved).for_each(|(terms, _)| square += smooth.at(&terms).length_squared());
    let max_still_px = max_still_px.max(MAX_ROUGH * (square / sums.places() as f64).sqrt());
    let displaced = |index: usize| moved(index).map(|(terms, motion)| motion - smooth.at(&terms));
    let (mut places, mut touched) = (0, 0);
    for (index, model) in models.iter().enumerate() {
        let (mut sum, mut count) = (DVec2::ZERO, 0.0);
        for own in std::iter::once(index).chain(model.neighbors.iter().copied()).filter_map(displaced) {
            (sum, count) = (sum + own, count + 1.0);
        }
        if count >= MIN_AROUND {
            places += 1;
            touched += usize::from(sum.length() > max_still_px * count);
        }
    }
    if touched >= MIN_TOUCHED { Some(true) } else { (2 * places >= models.len()).then_some(false) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::marks::{DarkSpot, SpotOutline};
    use glam::DVec3;

    const MIDDLE_PX: DVec2 = DVec2::splat(90.0);
    const PUSHED_PX: DVec2 = DVec2::new(2.0, -1.0);

    fn check(needs_rest: bool, is_rigid: bool) -> DriftCheck {
        DriftCheck {
            max_still_px: Some(0.1),
            rest: vec![DotAtRest::default(); 81],
            needs_rest,
            is_rigid,
            touch: None,
            expected_px: Vec::new(),
            frames: 0,
        }
    }

    /// Dots where a platform that moved by so much has them, but for what `moved` says.
    fn frame(platform_px: DVec2, moved: impl Fn(DVec2) -> DVec2) -> (Vec<DotTrack>, Vec<DotModel>) {
        let outline = SpotOutline { radius_px: 3.0, area_px: 28.0, spread_px2: 4.5, elongation: DVec2::ZERO };
        let models = DotModel::lattice(9, 9, 18.0, outline);
        let track = |model: &DotModel| {
            let at_px = model.rest_px + platform_px + moved(model.rest_px);
            let spot = DarkSpot {
                at_px,
                contrast: 0.8,
                area_px: 28.0,
                spread_px2: 4.5,
                sd_px: 0.02,
                ground: 150.0,
                ..DarkSpot::default()
            };
            let expected_px = Some(model.rest_px + platform_px);
            DotTrack { spot: Some(spot), expected_px, ..DotTrack::default() }
        };
        (models.iter().map(track).collect(), models)
    }

    fn load(force_n: f64) -> Option<(Wrench, Wrench)> {
        let of = |v: f64| Wrench { force_n: DVec3::splat(v), moment_nmm: DVec3::splat(v) };
        Some((of(force_n), of(0.05)))
    }

    /// A skin pressed in around a place: its dots seem to spread by what the rays lean.
    fn press(at: DVec2) -> DVec2 {
        let away = at - DVec2::splat(72.0);
        away * 0.02 * (-away.length_squared() / 1800.0).exp()
    }

    /// The frame from which on a sequence of alike ones is a drift.
    fn first_drift(
        check: &mut DriftCheck,
        load: Option<(Wrench, Wrench)>,
        frame: &(Vec<DotTrack>, Vec<DotModel>),
    ) -> Option<u32> {
        (1..=3 * MIN_FRAMES).find(|_| check.is_drift(load, &frame.0, &frame.1, MIDDLE_PX))
    }

    #[test]
    fn a_load_that_the_skin_does_not_show_is_a_drift() {
        let still = frame(PUSHED_PX, |_| DVec2::new(0.01, -0.02));
        let other_lens = frame(PUSHED_PX, |at| {
            let from = (at - MIDDLE_PX) / 90.0;
            from * from.length_squared() * 3.0 + from * from * 2.0
        });
        let new = || check(false, false);
        assert_eq!(first_drift(&mut new(), load(1.0), &still), Some(MIN_FRAMES));
        assert_eq!(first_drift(&mut new(), load(1.0), &other_lens), Some(MIN_FRAMES));
        assert_eq!(first_drift(&mut new(), load(0.1), &still), None, "a load within its deviation");
        assert_eq!(first_drift(&mut new(), load(1.0), &frame(PUSHED_PX, press)), None);
        assert_eq!(first_drift(&mut check(true, false), load(9.0), &still), None, "nothing was measured");
        let mut silent = DriftCheck { max_still_px: None, ..new() };
        assert_eq!(first_drift(&mut silent, load(9.0), &still), None);
    }

    #[test]
    fn on_a_rigid_mount_the_reference_says_where_the_picture_was() {
        let printed = |at: DVec2| (at * 0.7).map(f64::sin);
        let mut check = check(true, true);
        check.add_rest(&frame(DVec2::ZERO, printed).0);
        check.add_rest(&frame(DVec2::ZERO, printed).0);
        let shifted = |moved: fn(DVec2) -> DVec2| {
            let mut frame = frame(DVec2::ZERO, |at| printed(at) + PUSHED_PX + moved(at));
            frame.0[3].spot = None;
            frame
        };
        assert_eq!(first_drift(&mut check, None, &frame(DVec2::ZERO, printed)), None);
        assert_eq!(first_drift(&mut check, None, &shifted(|_| DVec2::ZERO)), Some(MIN_FRAMES));
        assert_eq!(first_drift(&mut check, None, &shifted(press)), None);
        check.restart();
        assert_eq!(first_drift(&mut check, None, &shifted(|_| DVec2::ZERO)), None);
    }

    #[test]
    fn too_few_dots_tell_nothing() {
        let mut few = frame(PUSHED_PX, |_| DVec2::ZERO);
        few.0.iter_mut().skip(20).for_each(|track| track.spot = None);
        assert_eq!(first_drift(&mut check(false, false), load(9.0), &few), None);
    }
}
