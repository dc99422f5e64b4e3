//! Which blob is which dot, from the constants' neighbour graph: no grid is assumed, and any dot may be missing.
//!
//! Most of the dome is where the pose puts it, or everything moved alike: the commonest offset between blobs and
//! expected dots gives the first pairs, of which the largest group counts. From there each dot that has neighbours in
//! place is looked for where the skin leads, the surest first. What fits nothing stays a blob without a name.

use glam::DVec2;

use super::buckets::Buckets;
use super::dot_track::DotTrack;
use super::groups::Groups;
use super::skin;
use crate::track::marks::DarkBlob;
use crate::track::model::DotModel;

/// Half of the square in which offsets are counted, px, and the side of its cells.
const VOTE_HALF_PX: f64 = 24.0;
const CELL_PX: f64 = 1.5;
const CELLS: usize = 32;
/// First pairs lie this near to the commonest offset, in parts of the dot's spacing.
const SEED_REACH: f64 = 0.2;
/// A blob is this near to where the neighbours lead, in parts of the dot's spacing.
const GROW_REACH: f64 = 0.38;
/// Dots of the first group are beside their places alike within this part of the spacing.
const ALIKE: f64 = 0.15;
/// A blob this near to where the skin leads, in parts of the spacing, is as sure as any; and what is added where only one
/// neighbour leads.
const SURE: f64 = 0.06;
const ONE_NEIGHBOR_COST: f64 = 0.1;
/// A blob's area over the dot's may lie between these.
const AREA_RATIO: [f64; 2] = [0.35, 2.2];
const MAX_ROUNDS: usize = 256;

/// What identities are looked for from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Hypothesis {
    /// The dots at rest, most of them beside their places by the commonest offset and this much more, px.
    FromRest { step_px: DVec2 },
    /// Where each dot was last.
    FromLast,
    /// The dots as they were followed into the frame.
    Followed,
}

/// Matches blobs to dots; keeps its buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct BlobMatcher {
    /// The blob of each dot.
    pub blob_of: Vec<Option<usize>>,
    /// Whether a blob is some dot's.
    pub taken: Vec<bool>,
    pairs: Vec<(f64, usize, usize)>,
    /// Where each dot is looked from.
    base: Vec<Option<DVec2>>,
    groups: Groups,
    buckets: Buckets,
}

impl BlobMatcher {
    /// Buffers for so many dots and blobs.
    pub fn new(dots: usize, blobs: usize) -> Self {
        Self {
            blob_of: Vec::with_capacity(dots),
            taken: Vec::with_capacity(blobs),
            pairs: Vec::with_capacity(dots),
            base: Vec::with_capacity(dots),
            groups: Groups::new(dots),
            buckets: Buckets::new(blobs),
        }
    }

    /// Takes in the blobs of a frame.
    pub fn take(&mut self, blobs: &[DarkBlob], size: [usize; 2]) {
        self.buckets.fill(blobs, size[0] as f64, size[1] as f64);
    }

    /// Fills [`BlobMatcher::blob_of`] with what one hypothesis leads to; the answer does not depend on the order of dots
    /// or blobs but for exact ties.
    ///
    /// The largest group of dots that lie beside their places alike is taken first. From there the skin leads on: each
    /// dot next to those in place is looked for where a plane through their displacements has it, the surest first.
    pub fn grow(
        &mut self,
        blobs: &[DarkBlob],
        models: &[DotModel],
        tracks: &[DotTrack],
        hypothesis: Hypothesis,
    ) {
        self.blob_of.clear();
        self.blob_of.resize(models.len(), None);
        self.taken.clear();
        self.taken.resize(blobs.len(), false);
        self.base.clear();
        self.base.extend(tracks.iter().map(|track| {
            match hypothesis {
                Hypothesis::FromRest { .. } => track.expected_px.filter(|_| track.is_wanted()),
                Hypothesis::Followed => track.now_px(),
                Hypothesis::FromLast => track
                    .expected_px
                    .zip(track.displaced_px)
                    .map(|(at, by)| at + by)
                    .filter(|_| track.is_wanted()),
            }
        }));
        let offset = match hypothesis {
            Hypothesis::FromRest { step_px } => self.commonest_offset(blobs, models) + step_px,
            Hypothesis::FromLast => self.commonest_offset(blobs, models),
            Hypothesis::Followed => DVec2::ZERO,
        };
        self.pairs.clear();
        for (index, model) in models.iter().enumerate() {
            if let Some(at) = self.base[index] {
                self.propose(blobs, model, index, at + offset, SEED_REACH);
            }
        }
        self.take_best(f64::INFINITY);
        if hypothesis == Hypothesis::Followed {
            return;
        }
        self.keep_largest_group(blobs, models);
        self.spread(blobs, models);
        if matches!(hypothesis, Hypothesis::FromLast) {
            // Dots that were not seen before: by where the skin at rest would have them.
            for (base, track) in self.base.iter_mut().zip(tracks) {
                *base = track.expected_px.filter(|_| track.is_wanted());
            }
            self.spread(blobs, models);
        }
    }

    /// Of the dots in place, only the largest group in which each is beside its place as its neighbours are.
    fn keep_largest_group(&mut self, blobs: &[DarkBlob], models: &[DotModel]) {
        let mut groups = std::mem::take(&mut self.groups);
        let moved = |index: usize| self.moved(blobs, index);
        groups.find(
            models,
            |index| self.blob_of[index].is_some(),
            |one, other| {
                let apart = moved(one).zip(moved(other)).map(|(one, other)| one.distance(other));
                apart.is_some_and(|apart| apart < ALIKE * models[one].spacing_px)
            },
        );
        for index in 0..models.len() {
            if !groups.is_in_largest(index)
                && let Some(blob) = self.blob_of[index].take()
            {
                self.taken[blob] = false;
            }
        }
        self.groups = groups;
    }

    /// By how much a dot's blob is beside its place.
    fn moved(&self, blobs: &[DarkBlob], index: usize) -> Option<DVec2> {
        Some(blobs[self.blob_of[index]?].at_px - self.base[index]?)
    }

    /// From the dots in place to all that the skin leads to.
    fn spread(&mut self, blobs: &[DarkBlob], models: &[DotModel]) {
        for _ in 0..MAX_ROUNDS {
            self.pairs.clear();
            for (index, model) in models.iter().enumerate() {
                let Some(at) = self.base[index].filter(|_| self.blob_of[index].is_none()) else { continue };
                let base = |other: usize| self.base[other];
                let Some(lead) = skin::estimate(index, models, base, |other| self.moved(blobs, other)) else {
                    continue;
                };
                self.propose(blobs, model, index, at + lead.displaced_px, GROW_REACH);
                if lead.neighbors == 1
                    && let Some(last) = self.pairs.last_mut().filter(|pair| pair.1 == index)
                {
                    last.0 += ONE_NEIGHBOR_COST;
                }
            }
            // Sure ones first: they make the next ones surer.
            let best = self.pairs.iter().map(|pair| pair.0).fold(f64::INFINITY, f64::min);
            if self.take_best(2.0 * best.max(SURE)) == 0 {
                break;
            }
        }
    }

    /// How well the dots in place make one skin, as [`skin::smoothness`].
    pub fn smoothness(&self, blobs: &[DarkBlob], models: &[DotModel], tracks: &[DotTrack]) -> f64 {
        let at = |index: usize| tracks[index].expected_px;
        skin::smoothness(models, at, |index| Some(blobs[self.blob_of[index]?].at_px - at(index)?))
    }

    /// Whether a blob is at the place of a dot that is none of the pattern's, by the dots in place around it.
    pub fn has_blob_at(
        &self,
        blobs: &[DarkBlob],
        models: &[DotModel],
        model: &DotModel,
        expected_px: DVec2,
        tracks: &[DotTrack],
    ) -> Option<bool> {
        let place = |other: usize| tracks[other].expected_px;
        let by = |other: usize| Some(blobs[self.blob_of[other]?].at_px - place(other)?);
        let lead = skin::beside(model, expected_px, usize::MAX, models, place, by);
        let at = expected_px + lead.filter(|lead| lead.neighbors >= 2)?.displaced_px;
        let reach_px = GROW_REACH * model.spacing_px;
        let is_dot = |blob: usize| {
            let part = blobs[blob].area_px / model.outline.area_px;
            blobs[blob].at_px.distance(at) < reach_px && (AREA_RATIO[0]..AREA_RATIO[1]).contains(&part)
        };
        Some(self.buckets.near(at, reach_px).any(is_dot))
    }

    /// The offset that most dots agree in: the fullest 3 x 3 cells of all offsets between a dot and the blobs around.
    fn commonest_offset(&self, blobs: &[DarkBlob], models: &[DotModel]) -> DVec2 {
        let mut votes = [[0_u16; CELLS]; CELLS];
        for (model, base) in models.iter().zip(&self.base) {
            let Some(at) = *base else { continue };
            // Beyond the spacing other dots would vote for the lattice's next fit.
            let reach = (0.75 * model.spacing_px).min(VOTE_HALF_PX - CELL_PX);
            for index in self.buckets.near(at, reach) {
                let away = blobs[index].at_px - at;
                if away.length() < reach {
                    let cell = |v: f64| (((v + VOTE_HALF_PX) / CELL_PX) as usize).min(CELLS - 1);
                    votes[cell(away.y)][cell(away.x)] += 1;
                }
            }
        }
        let (mut best, mut offset) = (0.0, DVec2::ZERO);
        for y in 1..CELLS - 1 {
            for x in 1..CELLS - 1 {
                let (mut sum, mut moment) = (0.0, DVec2::ZERO);
                for (dy, row) in votes.iter().enumerate().skip(y - 1).take(3) {
                    for (dx, count) in row.iter().enumerate().skip(x - 1).take(3) {
                        let center = |i: usize| (i as f64 + 0.5) * CELL_PX - VOTE_HALF_PX;
                        sum += f64::from(*count);
                        moment += DVec2::new(center(dx), center(dy)) * f64::from(*count);
                    }
                }
                // Of equal votes the smaller motion.
                let score = sum - 1e-3 * (moment / f64::max(sum, 1.0)).length();
                if score > best {
                    (best, offset) = (score, moment / sum);
                }
            }
        }
        offset
    }

    fn propose(&mut self, blobs: &[DarkBlob], model: &DotModel, index: usize, at: DVec2, reach: f64) {
        let reach_px = reach * model.spacing_px;
        let mut best: Option<(f64, usize)> = None;
        for blob in self.buckets.near(at, reach_px) {
            let part = blobs[blob].area_px / model.outline.area_px;
            let distance = blobs[blob].at_px.distance(at);
            let fits =
                !self.taken[blob] && distance < reach_px && (AREA_RATIO[0]..AREA_RATIO[1]).contains(&part);
            if fits && best.is_none_or(|(d, _)| distance < d) {
                best = Some((distance, blob));
            }
        }
        if let Some((distance, blob)) = best {
            self.pairs.push((distance / model.spacing_px, index, blob));
        }
    }

    /// Of the proposed pairs up to a cost the best first; returns how many were taken.
    fn take_best(&mut self, max_cost: f64) -> usize {
        self.pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut count = 0;
        for (cost, dot, blob) in &self.pairs {
            if *cost <= max_cost && !self.taken[*blob] && self.blob_of[*dot].is_none() {
                self.taken[*blob] = true;
                self.blob_of[*dot] = Some(*blob);
                count += 1;
            }
        }
        count
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::identities::false_dots::find_false_dots;
    use crate::track::marks::{MarkState, SpotOutline};

    const SPACING_PX: f64 = 20.0;

    /// Dots of a lattice, where they are expected, and blobs a third of the spacing away from there.
    fn scene(missing: &[usize]) -> (Vec<DotModel>, Vec<DotTrack>, Vec<DarkBlob>) {
        let outline = SpotOutline { radius_px: 3.5, area_px: 38.0, spread_px2: 6.0, ..Default::default() };
        let models = DotModel::lattice(6, 5, SPACING_PX, outline);
        let at =
            |i: usize| DVec2::new(30.0 + SPACING_PX * (i % 6) as f64, 30.0 + SPACING_PX * (i / 6) as f64);
        let track = |i: usize| DotTrack {
            expected_px: Some(at(i)),
            outline,
            state: MarkState::Missing,
            ..DotTrack::default()
        };
        // A shear on top of the shift: the neighbours lead where the commonest offset does not.
        let moved = |p: DVec2| p + DVec2::new(7.0 + 0.04 * (p.y - 30.0), -3.0);
        let blob = |i: usize| DarkBlob { at_px: moved(at(i)), area_px: 36.0, spread_px2: 6.0 };
        let seen = (0..models.len()).filter(|i| !missing.contains(i));
        let blobs = seen.rev().map(blob).collect();
        (models, (0..30).map(track).collect(), blobs)
    }

    #[test]
    fn shifted_and_sheared_blobs_keep_their_dots() {
        let missing = [8, 21];
        let (models, tracks, blobs) = scene(&missing);
        let mut matcher = BlobMatcher::new(30, 64);
        matcher.take(&blobs, [200, 160]);
        matcher.grow(&blobs, &models, &tracks, Hypothesis::FromRest { step_px: DVec2::ZERO });
        assert_eq!(matcher.blob_of.iter().flatten().count(), 28);
        for (dot, blob) in matcher.blob_of.iter().enumerate() {
            let Some(blob) = blob else {
                assert!(missing.contains(&dot));
                continue;
            };
            let y = tracks[dot].expected_px.unwrap().y - 30.0;
            let away = blobs[*blob].at_px - tracks[dot].expected_px.unwrap();
            assert!(away.distance(DVec2::new(7.0 + 0.04 * y, -3.0)) < 1e-9, "{dot}: {away}");
        }
    }

    #[test]
    fn a_blob_between_dots_that_are_found_is_a_false_dot() {
        let (models, mut tracks, mut blobs) = scene(&[]);
        let mut matcher = BlobMatcher::new(30, 64);
        matcher.take(&blobs, [200, 160]);
        matcher.grow(&blobs, &models, &tracks, Hypothesis::FromRest { step_px: DVec2::ZERO });
        for (track, blob) in tracks.iter_mut().zip(&matcher.blob_of) {
            track.spot = blob.map(|blob| crate::track::marks::DarkSpot {
                at_px: blobs[blob].at_px,
                contrast: 0.5,
                area_px: 36.0,
                spread_px2: 6.0,
                sd_px: 0.02,
                ground: 150.0,
                ..Default::default()
            });
        }
        let between = tracks[0].now_px().unwrap() + SPACING_PX * 0.5;
        blobs.push(DarkBlob { at_px: between, area_px: 30.0, spread_px2: 5.0 });
        // Too small, and too far from the pattern.
        blobs.push(DarkBlob { at_px: between + 2.0, area_px: 3.0, spread_px2: 0.5 });
        blobs.push(DarkBlob { at_px: DVec2::splat(-80.0), area_px: 30.0, spread_px2: 5.0 });
        let mut found = Vec::new();
        find_false_dots(&blobs, &models, &tracks, &mut found);
        assert_eq!(found, [between]);
    }
}
