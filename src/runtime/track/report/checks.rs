//! Whether the dots as a whole are as they should be.

use glam::DVec2;

use crate::track::identities::DotTrack;
use crate::track::marks::{DarkSpot, SpotShape};
use crate::track::model::DotModel;

/// Deviation of the blur of the dots' edges from which on a frame is blurred, px: twice a good lens's with its pixels. The
/// white markers' fit takes edges of half of it.
const BLURRED_PX: f64 = 1.0;
/// A way of the picture while the shutter was open from which on a frame is blurred, px, and the elongation that it makes at
/// least: a lens that is not quite the constants' makes less.
const STREAK_PX: f64 = 3.0;
const MIN_STREAK: f64 = 0.06;
/// Distance of the dots' odd rows from their even ones from which on a frame is interlaced, px, and over what the dots moved
/// by since the last frame: fields are half of a frame's time apart, or rows of the last frame are in this one.
const WOVEN_PX: f64 = 0.25;
const WOVEN_PARTS: std::ops::Range<f64> = 0.3..2.5;
/// What dots have in common is the mean of those without this part at each end: where they lie evenly around the axis what
/// each has of its own comes with both signs, and a median may be that of either half.
const TRIMMED_PART: f64 = 0.1;
/// Fewest dots that a frame is judged by.
const MIN_DOTS: usize = 8;
/// The platform stands still where the dots, by the median, move by less than this, px, and less than this part of what they
/// moved by in both frames before.
const STILL_PX: f64 = 0.04;
const STILL_PART: f64 = 0.12;
/// Moving is more than this, px, and in both frames before alike within this part.
const MOVING_PX: f64 = 0.25;
const STEADY_PART: f64 = 0.5;

/// Judges dots; keeps its buffer.
#[derive(Debug, Clone)]
pub(super) struct DotChecks {
    values: Vec<f64>,
    /// Median motion of the dots in the last frame and in the one before.
    motions_px: [Option<DVec2>; 2],
}

impl DotChecks {
    /// For so many dots.
    pub fn new(count: usize) -> Self {
        Self { values: Vec::with_capacity(count), motions_px: [None; 2] }
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        self.motions_px = [None; 2];
    }

    /// The median over the found dots, where they are enough.
    fn median_of(
        &mut self,
        tracks: &[DotTrack],
        of: impl Fn(&DotTrack, &DarkSpot) -> Option<f64>,
    ) -> Option<f64> {
        self.values.clear();
        self.values.extend(tracks.iter().filter_map(|track| of(track, track.spot.as_ref()?)));
        if self.values.len() < MIN_DOTS { None } else { quantile(&mut self.values, 0.5) }
    }

    /// What the found dots have in common, where they are enough: the mean of the middle ones of each axis.
    fn common(
        &mut self,
        tracks: &[DotTrack],
        of: impl Fn(&DotTrack, &DarkSpot) -> Option<DVec2>,
    ) -> Option<DVec2> {
        let mut middle_mean = |axis: fn(DVec2) -> f64| {
            self.values.clear();
            self.values.extend(tracks.iter().filter_map(|t| Some(axis(of(t, t.spot.as_ref()?)?))));
            if self.values.len() < MIN_DOTS { None } else { trimmed_mean(&mut self.values) }
        };
        Some(DVec2::new(middle_mean(|v| v.x)?, middle_mean(|v| v.y)?))
    }

    /// Whether the edges of half of the dots are blurred, or all of them are longer one way than the pose has them.
    pub fn are_blurred(&mut self, tracks: &[DotTrack]) -> bool {
        let wide = self.median_of(tracks, |_, spot| Some(looked_at(spot)?.edge_px));
        let elongation = self
            .common(tracks, |track, spot| looked_at(spot).map(|_| spot.elongation_beside(&track.outline)));
        let spread = self.median_of(tracks, |_, spot| Some(spot.spread_px2));
        let streak = elongation.zip(spread).is_some_and(|(elongation, spread)| {
            let elongation = elongation.length();
            // A shutter that is open over a way adds a twelfth of its square along it.
            elongation > MIN_STREAK && 12.0 * elongation * spread > STREAK_PX * STREAK_PX
        });
        streak || wide.is_some_and(|wide| wide > BLURRED_PX)
    }

    /// Whether the odd rows of the dots are beside the even ones along the way that the dots moved; after
    /// [`DotChecks::have_stopped`]. Colour filters put rows apart too, but in frames that stand still, and not along a motion.
    pub fn are_woven(&mut self, tracks: &[DotTrack]) -> bool {
        let apart = self.common(tracks, |_, spot| Some(looked_at(spot)?.odd_rows_px));
        let (Some(apart), [Some(motion), _]) = (apart, self.motions_px) else { return false };
        let way = motion.normalize_or_zero();
        let along = apart.dot(way).abs();
        along > WOVEN_PX
            && WOVEN_PARTS.contains(&(along / motion.length()))
            && apart.perp_dot(way).abs() < 0.3 * along
    }

    /// Whether all that moved steadily stands still at once: nothing that has a mass does.
    pub fn have_stopped(&mut self, tracks: &[DotTrack]) -> bool {
        let x = self.median_of(tracks, |track, _| Some(track.motion_px?.x));
        let y = self.median_of(tracks, |track, _| Some(track.motion_px?.y));
        let now = x.zip(y).map(|(x, y)| DVec2::new(x, y));
        let before = self.motions_px;
        self.motions_px = [now, before[0]];
        let (Some(now), [Some(last), Some(other)]) = (now, before) else { return false };
        let moving = last.length().min(other.length());
        moving > MOVING_PX
            && last.distance(other) < STEADY_PART * moving
            && now.length() < STILL_PX.min(STILL_PART * moving)
    }

    /// Whether three quarters of the dots are farther from where the pose puts them than this part of their spacing: a
    /// finger moves some of the dots; foreign constants misplace nearly all.
    pub fn are_misplaced(&mut self, tracks: &[DotTrack], models: &[DotModel], max_misplaced: f64) -> bool {
        self.values.clear();
        for (track, model) in tracks.iter().zip(models) {
            if let (Some(now), Some(expected)) = (track.now_px(), track.expected_px) {
                self.values.push(now.distance(expected) / model.spacing_px);
            }
        }
        quantile(&mut self.values, 0.25).is_some_and(|quarter| quarter > max_misplaced)
    }
}

/// What a spot looks like in this frame, if it was looked at.
fn looked_at(spot: &DarkSpot) -> Option<&SpotShape> {
    spot.is_shape_new.then_some(&spot.shape)
}

/// The value that a part of the list is below; the list is reordered.
fn quantile(values: &mut [f64], part: f64) -> Option<f64> {
    let at = ((values.len() as f64 * part) as usize).min(values.len().checked_sub(1)?);
    Some(*values.select_nth_unstable_by(at, f64::total_cmp).1)
}

/// The mean of what is left of a list without [`TRIMMED_PART`] at each end; the list is reordered.
fn trimmed_mean(values: &mut [f64]) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let cut = (values.len() as f64 * TRIMMED_PART) as usize;
    let middle = &values[cut..values.len() - cut];
    (!middle.is_empty()).then(|| middle.iter().sum::<f64>() / middle.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_dots_have_of_their_own_cancels_and_what_they_share_stays() {
        assert_eq!(trimmed_mean(&mut []), None);
        assert_eq!(trimmed_mean(&mut [2.0]), Some(2.0));
        let mut values: Vec<f64> = (0..41).map(|i| if i % 2 == 0 { 0.3 } else { -0.3 }).collect();
        assert!(trimmed_mean(&mut values).unwrap().abs() < 0.01);
        values.iter_mut().for_each(|v| *v += 0.5);
        values[0] = 1e6;
        assert!((trimmed_mean(&mut values).unwrap() - 0.5).abs() < 0.03);
    }

    #[test]
    fn quantiles_of_short_lists() {
        assert_eq!(quantile(&mut [], 0.5), None);
        assert_eq!(quantile(&mut [3.0], 0.25), Some(3.0));
        assert_eq!(quantile(&mut [4.0, 1.0, 3.0, 2.0], 0.25), Some(2.0));
        assert_eq!(quantile(&mut [4.0, 1.0, 3.0, 2.0], 1.0), Some(4.0));
    }
}
