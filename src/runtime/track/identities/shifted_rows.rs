//! Rows of dots of which each may be the one before it.
//!
//! A patch of the skin with a sharp edge that lies most of a step of the pattern beside its place looks like its neighbours'
//! dots, a little off the other way. What tells is at its ends: behind it a dot has no blob, and before it two dots have
//! one, or a blob is no dot's. So from each dot that is not found a row is walked along the pattern, as long as its dots
//! lie back towards the gap; where it ends at such a place, numbers that are one further fit as well.

use glam::DVec2;

use super::dot_track::DotTrack;
use crate::track::marks::MarkState;
use crate::track::model::DotModel;

/// A dot that is beside its place by less than this part of the spacing is where it should be.
const MIN_OFF: f64 = 0.04;
/// Dots of a row are beside their places as the one before but for this part of the spacing.
const ALIKE: f64 = 0.2;
/// Two dots in one spot make it larger than the ones beside it by this part.
const DOUBLE: f64 = 1.06;
/// A dot that lies back by less than this part of the row's step is beside it.
const BESIDE: f64 = 0.25;
/// The pattern goes on in a row where a neighbour is this near to the next step, in parts of the spacing.
const STEP_REACH: f64 = 0.35;

/// Walks the rows; keeps its buffer.
#[derive(Debug, Clone, Default)]
pub(super) struct ShiftedRows {
    row: Vec<usize>,
    /// By dot: the step of the pattern to the next dot of its row.
    steps: Vec<Option<DVec2>>,
}

/// The neighbour of a dot that is a step of the pattern away.
fn beside(models: &[DotModel], index: usize, step_px: DVec2) -> Option<usize> {
    let from = &models[index];
    let off_px = |other: &usize| models[*other].rest_px.distance(from.rest_px + step_px);
    let nearest = from.neighbors.iter().copied().min_by(|a, b| off_px(a).total_cmp(&off_px(b)))?;
    (off_px(&nearest) < STEP_REACH * from.spacing_px).then_some(nearest)
}

impl ShiftedRows {
    /// For so many dots.
    pub fn new(dots: usize) -> Self {
        Self { row: Vec::with_capacity(dots), steps: Vec::with_capacity(dots) }
    }

    /// Names the dots of such rows. `has_blob`: whether a dot like that of a number is at a place, and is no found one.
    pub fn judge(
        &mut self,
        models: &[DotModel],
        tracks: &mut [DotTrack],
        mut has_blob: impl FnMut(&[DotTrack], usize, DVec2) -> bool,
    ) {
        self.steps.clear();
        self.steps.resize(models.len(), None);
        let is_gap = |index: usize| tracks[index].spot.is_none() && tracks[index].is_wanted();
        for gap in (0..models.len()).filter(|index| is_gap(*index)) {
            for first in &models[gap].neighbors {
                if self.walk(models, tracks, gap, *first, &mut has_blob) {
                    let step_px = models[*first].rest_px - models[gap].rest_px;
                    self.row.iter().for_each(|index| self.steps[*index] = Some(step_px));
                }
            }
        }
        // Where the patch lies a whole step beside its place, its rows look as if nothing were: those next to one that was
        // found, from a gap as far as that one is beside them.
        let mut is_more = self.steps.iter().any(Option::is_some);
        while is_more {
            is_more = false;
            for index in 0..models.len() {
                if self.steps[index].is_none() && tracks[index].spot.is_some() {
                    self.steps[index] = self.step_beside(models, tracks, index, is_gap);
                    is_more |= self.steps[index].is_some();
                }
            }
        }
        for (track, _) in tracks.iter_mut().zip(&self.steps).filter(|(_, step)| step.is_some()) {
            track.fault.get_or_insert(MarkState::IdentityUnsure);
        }
    }

    /// The step of a row beside a dot, where what is before the dot in the row's way is a gap or in such a row too.
    fn step_beside(
        &self,
        models: &[DotModel],
        tracks: &[DotTrack],
        index: usize,
        is_gap: impl Fn(usize) -> bool,
    ) -> Option<DVec2> {
        models[index].neighbors.iter().find_map(|other| {
            let step_px = self.steps[*other]?;
            let away_px = models[*other].rest_px - models[index].rest_px;
            let is_beside = away_px.dot(step_px) > -BESIDE * step_px.length_squared();
            let apart_px = tracks[index].off_px()?.distance(tracks[*other].off_px()?);
            let is_alike = apart_px < 0.5 * ALIKE * models[index].spacing_px;
            let before = beside(models, index, -step_px)?;
            (is_beside && is_alike && (is_gap(before) || self.steps[before].is_some())).then_some(step_px)
        })
    }

    /// Whether a row's next spot may be two dots'; `beyond`: the dot after it.
    fn is_double(&self, tracks: &[DotTrack], index: usize, beyond: Option<usize>) -> bool {
        let track = &tracks[index];
        let part = |index: usize| tracks[index].spot.map(|spot| spot.area_px / tracks[index].outline.area_px);
        let sides = self.row.last().copied().and_then(part).zip(beyond.and_then(part));
        // Larger than those on both sides: a touch or the rim makes dots larger step by step.
        let is_large =
            part(index).zip(sides).is_some_and(|(own, (row, beyond))| own > DOUBLE * row.max(beyond));
        is_large
            || track.state == MarkState::Merged
            || matches!(track.fault, Some(MarkState::Dirty | MarkState::Smeared))
    }

    /// Walks from a gap over its neighbour; whether the row ends where a blob is too many.
    fn walk(
        &mut self,
        models: &[DotModel],
        tracks: &[DotTrack],
        gap: usize,
        first: usize,
        has_blob: &mut impl FnMut(&[DotTrack], usize, DVec2) -> bool,
    ) -> bool {
        self.row.clear();
        let mut step_px = models[first].rest_px - models[gap].rest_px;
        // What is behind the gap did not move with the row.
        let behind = beside(models, gap, -step_px).and_then(|behind| tracks[behind].off_px());
        let still_px = behind.unwrap_or(DVec2::ZERO);
        let mut row_px: Option<DVec2> = None;
        let mut next = Some(first);
        while let Some(index) = next {
            let track = &tracks[index];
            if self.is_double(tracks, index, beside(models, index, step_px)) {
                return !self.row.is_empty();
            }
            let Some(off_px) = track.off_px().map(|by| by - still_px) else { return false };
            let spacing_px = models[index].spacing_px;
            let is_off = off_px.length() > MIN_OFF * spacing_px;
            let is_alike = row_px.is_none_or(|row_px| row_px.distance(off_px) < ALIKE * spacing_px);
            if !is_off || !is_alike || self.row.len() >= models.len() {
                break;
            }
            self.row.push(index);
            row_px = Some(off_px);
            next = beside(models, index, step_px);
            if let Some(next) = next {
                step_px = models[next].rest_px - models[index].rest_px;
            }
        }
        let (Some(last), Some(off_px)) = (self.row.last(), row_px) else { return false };
        let Some(place_px) = tracks[*last].expected_px.map(|at| at + still_px) else { return false };
        // The patch's last dot beside the row's, or the dot that the row's last one took the place of.
        has_blob(tracks, *last, place_px + step_px + off_px) || has_blob(tracks, *last, place_px)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::marks::{DarkSpot, SpotOutline};

    const SPACING_PX: f64 = 20.0;
    const COLUMNS: usize = 9;

    /// A lattice of dots that are found at rest but for what `change` does.
    fn judged(change: impl Fn(usize, usize, &mut DotTrack), blobs: &[DVec2]) -> Vec<DotTrack> {
        let outline = SpotOutline { radius_px: 4.0, area_px: 50.0, spread_px2: 8.0, elongation: DVec2::ZERO };
        let models = DotModel::lattice(COLUMNS, 7, SPACING_PX, outline);
        let mut tracks: Vec<DotTrack> = models
            .iter()
            .enumerate()
            .map(|(index, model)| {
                let spot = DarkSpot { at_px: model.rest_px, area_px: 50.0, ..DarkSpot::default() };
                let expected_px = Some(model.rest_px);
                let state = MarkState::Ok;
                let mut track =
                    DotTrack { expected_px, outline, state, spot: Some(spot), ..DotTrack::default() };
                change(index % COLUMNS, index / COLUMNS, &mut track);
                track
            })
            .collect();
        ShiftedRows::new(models.len())
            .judge(&models, &mut tracks, |_, _, at| blobs.iter().any(|blob| blob.distance(at) < 4.0));
        tracks
    }

    fn unsure(tracks: &[DotTrack]) -> Vec<usize> {
        let is_unsure = |index: &usize| tracks[*index].fault == Some(MarkState::IdentityUnsure);
        (0..tracks.len()).filter(is_unsure).collect()
    }

    /// Dots of columns 3 to 5 and rows 2 to 4 are one further in truth: what is taken for them is `off` beside their places,
    /// and nothing is where the one in column 2 should be.
    fn patch(off: f64) -> impl Fn(usize, usize, &mut DotTrack) {
        move |x, y, track| {
            if (2..5).contains(&y) && x == 2 {
                track.lose(MarkState::Lost);
            }
            if (2..5).contains(&y)
                && (3..6).contains(&x)
                && let Some(spot) = &mut track.spot
            {
                spot.at_px.x += off * SPACING_PX;
            }
        }
    }

    #[test]
    fn rows_between_a_gap_and_a_dot_too_many_are_unsure() {
        let rows: Vec<usize> = (2..5).flat_map(|y| (3..6).map(move |x| y * COLUMNS + x)).collect();
        // Moved by 0.6, 0.8, 1.2 of the spacing: the dots before the patch are double, or its last ones stand beside them.
        for off in [-0.4, -0.2, 0.2] {
            let double = |x: usize, y: usize, track: &mut DotTrack| {
                patch(off)(x, y, track);
                if (2..5).contains(&y) && x == 6 {
                    track.fault = Some(MarkState::Smeared);
                }
            };
            assert_eq!(unsure(&judged(double, &[])), rows, "{off}");
            let blobs = [2.0, 3.0, 4.0].map(|y| DVec2::new(6.0 + off, y) * SPACING_PX);
            assert_eq!(unsure(&judged(patch(off), &blobs)), rows, "{off}");
        }
        // Moved by a whole step but for the turn of the patch: the middle row looks as if nothing were.
        let turned = |x: usize, y: usize, track: &mut DotTrack| {
            patch(0.08 * (y as f64 - 3.0))(x, y, track);
            if (2..5).contains(&y)
                && x == 6
                && let Some(spot) = &mut track.spot
            {
                spot.area_px *= 1.1;
            }
        };
        assert_eq!(unsure(&judged(turned, &[])), rows);
    }

    #[test]
    fn a_gap_or_a_dot_too_many_alone_makes_nothing_unsure() {
        assert_eq!(unsure(&judged(patch(0.0), &[])), [0; 0]);
        // Dots are broken, others dirty, the skin is at rest.
        let dirty = |x: usize, y: usize, track: &mut DotTrack| {
            patch(0.0)(x, y, track);
            if x == 7 {
                track.fault = Some(MarkState::Dirty);
            }
        };
        assert_eq!(unsure(&judged(dirty, &[])), [0; 0]);
        // The skin is pulled smoothly over a broken dot.
        let pulled = |x: usize, y: usize, track: &mut DotTrack| {
            patch(0.0)(x, y, track);
            if let Some(spot) = &mut track.spot {
                spot.at_px.x += 0.1 * SPACING_PX * (4.0 - (x as f64 - 4.0).abs());
            }
        };
        assert_eq!(unsure(&judged(pulled, &[])), [0; 0]);
    }
}
