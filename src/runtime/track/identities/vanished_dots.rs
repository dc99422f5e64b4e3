//! Dots that vanished.
//!
//! A part of the skin that jumps by a whole step of the pattern lies on the pattern again: its dots have their neighbours'
//! numbers, and little seems to have moved. But at its end a dot is gone, and where it was is bare skin with no other blob
//! about. No touch does that. Whatever moved since the dot was last seen, as far as it hangs together with the gap, may have
//! another one's number then, until the dot is seen again.
//!
//! Nor is a number sure that a dot got by a jump among dots that look like none: skin that is squeezed so hides whose place it is.

use glam::DVec2;

use super::dot_track::DotTrack;
use super::skin;
use crate::track::marks::MarkState;
use crate::track::model::DotModel;

/// A dot that moved by less than so many of its deviations, or by this, px, has not moved.
const STILL_SDS: f64 = 5.0;
const STILL_PX: f64 = 0.05;
/// A blob without a number this near to a gap, in parts of the spacing, may be the dot.
const BLOB_REACH: f64 = 1.0;

/// Bare skin is as bright as the ground of the dots around but for this part.
const GROUND_PART: f64 = 0.05;

/// A dot that jumped by more than this part of the spacing has its number from the dots beside it.
const JUMP: f64 = 0.5;

/// What is remembered of vanished dots; keeps its buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct VanishedDots {
    /// By dot: how far it was off its place when it was last found, px.
    last_off_px: Vec<Option<DVec2>>,
    is_gone: Vec<bool>,
    is_doubtful: Vec<bool>,
    /// By dot: whether it jumped among dots that look like none, and those still do.
    is_alone: Vec<bool>,
    stack: Vec<usize>,
}

/// Whether nothing is about where the skin has a dot that it could be: no blob without a number, no spot of two dots.
/// What is there now has the level of the ground of the dots around: light on a dot hides it too.
fn is_bare(
    models: &[DotModel],
    tracks: &[DotTrack],
    blobs: &[DVec2],
    index: usize,
    level_at: &impl Fn(DVec2) -> Option<f64>,
) -> bool {
    let at = |other: usize| tracks[other].expected_px;
    let by = |other: usize| tracks[other].off_px();
    let Some(place_px) = at(index) else { return false };
    let Some(lead) = skin::estimate(index, models, at, by) else { return false };
    let place_px = place_px + lead.displaced_px;
    let reach_px = BLOB_REACH * models[index].spacing_px;
    let may_be = |at: DVec2| at.distance(place_px) < reach_px;
    let is_double = |track: &DotTrack| track.fault.is_some_and(|fault| fault != MarkState::IdentityUnsure);
    let beside = models[index].neighbors.iter().map(|other| &tracks[*other]);
    let grounds = beside.clone().filter_map(|track| Some(track.spot?.ground));
    let (sum, count) = grounds.fold((0.0, 0.0), |(sum, count), ground| (sum + ground, count + 1.0));
    let is_ground = |level: f64| count > 0.0 && (level * count / sum - 1.0).abs() < GROUND_PART;
    level_at(place_px).is_some_and(is_ground)
        && !blobs.iter().any(|blob| may_be(*blob))
        && !beside.filter(|track| is_double(track)).filter_map(DotTrack::now_px).any(may_be)
}

impl VanishedDots {
    /// For so many dots.
    pub fn new(dots: usize) -> Self {
        Self {
            last_off_px: vec![None; dots],
            is_gone: vec![false; dots],
            is_doubtful: vec![false; dots],
            is_alone: vec![false; dots],
            stack: Vec::with_capacity(dots),
        }
    }

    /// Names the dots whose numbers are in doubt. `blobs`: those without a number, where the whole frame was searched.
    /// `level_at`: the frame's level at a place.
    pub fn judge(
        &mut self,
        models: &[DotModel],
        tracks: &mut [DotTrack],
        blobs: Option<&[DVec2]>,
        level_at: impl Fn(DVec2) -> Option<f64>,
    ) {
        for (index, track) in tracks.iter().enumerate() {
            if track.spot.is_some() {
                self.is_gone[index] = false;
            } else if !self.is_gone[index]
                && self.last_off_px[index].is_some()
                && track.state == MarkState::Lost
                && blobs.is_some_and(|blobs| is_bare(models, tracks, blobs, index, &level_at))
            {
                self.is_gone[index] = true;
                self.stack.push(index);
            }
        }
        if !self.is_gone.contains(&true) {
            self.is_doubtful.fill(false);
        }
        self.spread(models, tracks);
        self.find_alone(models, tracks);
        for (index, track) in tracks.iter_mut().enumerate() {
            if let Some(off_px) = track.off_px() {
                self.last_off_px[index] = Some(off_px);
                if self.is_doubtful[index] || self.is_alone[index] {
                    track.fault.get_or_insert(MarkState::IdentityUnsure);
                }
            }
        }
    }

    /// From the gaps over all that moved; what is next to that is in doubt too.
    fn spread(&mut self, models: &[DotModel], tracks: &[DotTrack]) {
        while let Some(index) = self.stack.pop() {
            for other in &models[index].neighbors {
                let Some(last_px) = self.last_off_px[*other].filter(|_| !self.is_doubtful[*other]) else {
                    continue;
                };
                self.is_doubtful[*other] = true;
                let track = &tracks[*other];
                let is_still = track.off_px().zip(track.spot).is_some_and(|(off_px, spot)| {
                    off_px.distance(last_px) < f64::max(STILL_PX, STILL_SDS * spot.sd_px)
                });
                if !is_still {
                    self.stack.push(*other);
                }
            }
        }
    }

    /// Dots that jumped where half of the dots beside them, and more, look like none.
    fn find_alone(&mut self, models: &[DotModel], tracks: &[DotTrack]) {
        for (index, (model, track)) in models.iter().zip(tracks).enumerate() {
            let Some(off_px) = track.off_px() else { continue };
            let looks_wrong =
                |other: &&usize| tracks[**other].fault.is_some_and(|f| f != MarkState::IdentityUnsure);
            let wrong = model.neighbors.iter().filter(looks_wrong).count();
            let last_px = self.last_off_px[index].unwrap_or(DVec2::ZERO);
            let is_new = off_px.distance(last_px) > JUMP * model.spacing_px;
            self.is_alone[index] = 2 * wrong >= model.neighbors.len() && (is_new || self.is_alone[index]);
        }
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        self.last_off_px.fill(None);
        self.is_gone.fill(false);
        self.is_doubtful.fill(false);
        self.is_alone.fill(false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::marks::{DarkSpot, SpotOutline};

    const SPACING_PX: f64 = 20.0;
    const COLUMNS: usize = 9;

    fn unsure(tracks: &[DotTrack]) -> Vec<usize> {
        let is_unsure = |index: &usize| tracks[*index].fault == Some(MarkState::IdentityUnsure);
        (0..tracks.len()).filter(is_unsure).collect()
    }

    #[test]
    fn what_moved_beside_a_dot_that_vanished_is_unsure_until_it_is_seen_again() {
        let outline = SpotOutline { radius_px: 4.0, area_px: 50.0, spread_px2: 8.0, elongation: DVec2::ZERO };
        let models = DotModel::lattice(COLUMNS, 7, SPACING_PX, outline);
        let at_rest: Vec<DotTrack> = models
            .iter()
            .map(|model| {
                let spot = DarkSpot {
                    at_px: model.rest_px,
                    area_px: 50.0,
                    sd_px: 0.01,
                    ground: 150.0,
                    ..DarkSpot::default()
                };
                let expected_px = Some(model.rest_px);
                DotTrack {
                    expected_px,
                    outline,
                    state: MarkState::Ok,
                    spot: Some(spot),
                    ..DotTrack::default()
                }
            })
            .collect();
        let gap = 3 * COLUMNS + 2;
        let row = [gap + 1, gap + 2];
        let jumped = || {
            let mut tracks = at_rest.clone();
            tracks[gap].lose(MarkState::Lost);
            for index in row {
                if let Some(spot) = &mut tracks[index].spot {
                    spot.at_px.x += 0.5;
                }
            }
            tracks
        };
        let level = |_: DVec2| Some(152.0);
        let mut vanished = VanishedDots::new(models.len());
        vanished.judge(&models, &mut at_rest.clone(), None, level);
        // A blob beside the gap may be the dot.
        let mut tracks = jumped();
        let blob = models[gap].rest_px + 0.5 * SPACING_PX;
        vanished.clone().judge(&models, &mut tracks, Some(&[blob]), level);
        assert_eq!(unsure(&tracks), [0; 0]);
        // Light lies on it.
        let mut tracks = jumped();
        vanished.clone().judge(&models, &mut tracks, Some(&[]), |_| Some(220.0));
        assert_eq!(unsure(&tracks), [0; 0]);
        let mut tracks = jumped();
        vanished.judge(&models, &mut tracks, Some(&[]), level);
        let named = unsure(&tracks);
        assert!(row.iter().all(|index| named.contains(index)) && named.contains(&(gap + 3)), "{named:?}");
        assert!(!named.contains(&(gap + 4)) && named.len() < 12, "{named:?}");
        // It stays so, and ends with the gap.
        let mut tracks = jumped();
        vanished.judge(&models, &mut tracks, None, level);
        assert_eq!(unsure(&tracks), named);
        let mut tracks = at_rest.clone();
        vanished.judge(&models, &mut tracks, None, level);
        assert_eq!(unsure(&tracks), [0; 0]);
    }
}
