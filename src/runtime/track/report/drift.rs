//! A load that the skin does not show: the camera or its mount has moved.
//!
//! A camera that turns shows platform and skin moved as one, just as a load on the platform does: a single frame cannot tell
//! them apart by the white markers. A load on the dome deforms the skin beside that, and moves its dots against the
//! platform. So a wrench beyond its deviations, frame after frame, while no place of the skin is moved, is none of a touch.
//! What presses on the platform beside the dome, or pulls at it, looks the same.

use glam::DVec2;

use super::affine::{AffineSums, row_of};
use crate::track::identities::DotTrack;
use crate::track::model::DotModel;
use domecast_springs::Wrench;

/// A wrench beyond so many of its deviations is none of chance.
const MAX_SDS: f64 = 4.0;
/// For so many frames in a row.
const MIN_FRAMES: u32 = 10;
/// Places of the skin that must be moved for a touch: one may be a speck.
const MIN_TOUCHED: usize = 2;
/// Fewest dots of a place.
const MIN_AROUND: f64 = 3.0;

/// Judges frame after frame.
#[derive(Debug, Clone)]
pub(super) struct DriftCheck {
    /// How far a place of the skin can be beside an untouched one, px; `None` where the constants do not say it well
    /// enough to tell.
    max_still_px: Option<f64>,
    frames: u32,
}

impl DriftCheck {
    /// `max_still_px`: how far the dots of a place are at most, on the mean, from where an untouched skin has them.
    pub fn new(max_still_px: Option<f64>) -> Self {
        Self { max_still_px, frames: 0 }
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        self.frames = 0;
    }

    /// Takes a frame in; whether its load is none of the skin's.
    pub fn is_drift(
        &mut self,
        load: Option<(Wrench, Wrench)>,
        tracks: &[DotTrack],
        models: &[DotModel],
        middle_px: DVec2,
    ) -> bool {
        let Some(max_still_px) = self.max_still_px else { return false };
        let is_loaded = load.is_some_and(|(wrench, sd)| {
            wrench.to_array().iter().zip(sd.to_array()).any(|(w, sd)| w.abs() > MAX_SDS * sd)
        });
        if is_loaded && !is_touched(tracks, models, middle_px, max_still_px) {
            self.frames = self.frames.saturating_add(1);
        } else {
            self.frames = 0;
        }
        self.frames >= MIN_FRAMES
    }
}

/// Whether the dots of some places, each with those beside it, have moved against the platform; also where too few are
/// seen to tell. What is affine over the whole skin does not count: a camera that has moved shows what the calibration left
/// of the optics' errors from another side, a touch moves some places beside others.
fn is_touched(tracks: &[DotTrack], models: &[DotModel], middle_px: DVec2, max_still_px: f64) -> bool {
    let moved = |track: &DotTrack| Some((row_of(track.expected_px?, middle_px), track.off_px()?));
    let mut sums = AffineSums::default();
    tracks.iter().filter_map(moved).for_each(|(row, motion)| sums.add(&row, motion));
    let Some(affine) = sums.solve() else { return true };
    let displaced = |index: usize| moved(tracks.get(index)?).map(|(row, motion)| motion - affine.at(&row));
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
    touched >= MIN_TOUCHED || 2 * places < models.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::marks::{DarkSpot, SpotOutline};
    use glam::DVec3;

    const MIDDLE_PX: DVec2 = DVec2::splat(90.0);

    fn frame(moved: impl Fn(DVec2) -> DVec2) -> (Vec<DotTrack>, Vec<DotModel>) {
        let outline = SpotOutline { radius_px: 3.0, area_px: 28.0, spread_px2: 4.5, elongation: DVec2::ZERO };
        let models = DotModel::lattice(9, 9, 18.0, outline);
        let track = |model: &DotModel| {
            let at_px = model.rest_px + moved(model.rest_px);
            let spot = DarkSpot {
                at_px,
                contrast: 0.8,
                area_px: 28.0,
                spread_px2: 4.5,
                sd_px: 0.02,
                ground: 150.0,
                ..DarkSpot::default()
            };
            DotTrack { spot: Some(spot), expected_px: Some(model.rest_px), ..DotTrack::default() }
        };
        (models.iter().map(track).collect(), models)
    }

    fn load(force_n: f64) -> Option<(Wrench, Wrench)> {
        let of = |v: f64| Wrench { force_n: DVec3::splat(v), moment_nmm: DVec3::splat(v) };
        Some((of(force_n), of(0.05)))
    }

    #[test]
    fn a_load_that_the_skin_does_not_show_is_a_drift() {
        let (still, models) = frame(|_| DVec2::new(0.01, -0.02));
        // A skin pressed in around the middle: its dots seem to spread by what the rays lean.
        let (pressed, _) = frame(|at| {
            let away = at - DVec2::splat(72.0);
            away * 0.02 * (-away.length_squared() / 1800.0).exp()
        });
        let mut check = DriftCheck::new(Some(0.1));
        for number in 1..=MIN_FRAMES {
            assert_eq!(check.is_drift(load(1.0), &still, &models, MIDDLE_PX), number == MIN_FRAMES);
        }
        assert!(!check.is_drift(load(0.1), &still, &models, MIDDLE_PX), "a load within its deviation");
        for _ in 0..3 * MIN_FRAMES {
            assert!(!check.is_drift(load(1.0), &pressed, &models, MIDDLE_PX));
        }
        let mut blind = DriftCheck::new(None);
        assert!((0..3 * MIN_FRAMES).all(|_| !blind.is_drift(load(9.0), &still, &models, MIDDLE_PX)));
    }

    #[test]
    fn too_few_dots_tell_nothing() {
        let (mut tracks, models) = frame(|_| DVec2::ZERO);
        tracks.iter_mut().skip(20).for_each(|track| track.spot = None);
        let mut check = DriftCheck::new(Some(0.1));
        assert!((0..3 * MIN_FRAMES).all(|_| !check.is_drift(load(9.0), &tracks, &models, MIDDLE_PX)));
    }
}
